from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

CONFTEST = Path(__file__).parents[1] / "conftest.py"

LEAKS = {
    "tasks": "async def test(): KEPT.append(asyncio.create_task(asyncio.sleep(60)))",
    "child processes": "def test(): KEPT.append(subprocess.Popen(['sleep', '1']))",
    "listening ports": "def test(): KEPT.append(socket.create_server(('127.0.0.1', 0)))",
    "terminals": "def test(): KEPT.append(os.openpty())",
    "threads": "def test(): KEPT.append(threading.Timer(1, print)); KEPT[0].start()",
}
HEADER = "import asyncio, os, socket, subprocess, threading\nKEPT = []\n"


@pytest.mark.parametrize("what", LEAKS)
def test_a_test_that_leaks_fails(what: str, pytester: pytest.Pytester) -> None:
    pytester.makeconftest(CONFTEST.read_text(encoding="utf-8").replace("_GRACE = 2.0", "_GRACE = 0.05"))
    pytester.makeini("[pytest]\nasyncio_mode = auto\nasyncio_default_fixture_loop_scope = function\n")
    pytester.makepyfile(HEADER + LEAKS[what])
    outcome = pytester.runpytest_subprocess("-q", "-p", "no:randomly")
    outcome.assert_outcomes(passed=1, errors=1)
    outcome.stdout.fnmatch_lines([f"*Failed: leaked*{what}*"])


def test_a_clean_test_passes(pytester: pytest.Pytester) -> None:
    pytester.makeconftest(CONFTEST.read_text(encoding="utf-8"))
    pytester.makeini("[pytest]\nasyncio_mode = auto\nasyncio_default_fixture_loop_scope = function\n")
    pytester.makepyfile(
        "import asyncio\n"
        "async def test():\n"
        "    await asyncio.to_thread(sum, [1])\n"
        "    process = await asyncio.create_subprocess_exec('true')\n"
        "    await process.wait()\n"
    )
    pytester.runpytest_subprocess("-q", "-p", "no:randomly").assert_outcomes(passed=1)
