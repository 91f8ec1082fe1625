"""Help texts: complete, readable, and there at once."""

import re
import subprocess
import sys
from typing import Any

import pytest
import typer

from kempelen import __version__
from kempelen.cli.main import app

COMMANDS = sorted(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
GAMES = ("play", "watch", "replay", "resume")
COMMON = (
    "--config", "--robot", "--port", "--engine", "--level", "--move-time", "--speed", "--planner",
    "--data-dir", "--report",
)  # fmt: skip
HEAVY = {
    "asyncio", "chess", "mujoco", "numpy", "prompt_toolkit", "pydantic", "rich.console", "serialx", "sqlite3",
}  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
def test_examples_stand_on_lines_of_their_own(kempelen: Any, command: str) -> None:
    told = kempelen(command, "--help")
    assert told.code == 0
    lines = [line.strip() for line in told.out.splitlines()]
    examples = [line for line in lines if line.startswith("kempelen ")]
    assert "Examples:" in lines
    assert examples
    for example in examples:
        assert len(re.findall(r"\bkempelen (?!twin|play --port)", example)) <= 2, example


@pytest.mark.parametrize("command", GAMES)
def test_common_options_of_every_game(kempelen: Any, command: str) -> None:
    told = kempelen(command, "--help")
    assert [option for option in COMMON if option not in told.out] == []
    for part in ("The game", "The robot", "Files and screen", "default: (twin)"):
        assert part in told.out


def test_the_version(kempelen: Any) -> None:
    told = kempelen("--version")
    assert (told.code, told.out) == (0, f"kempelen {__version__}\n")


def test_nothing_heavy_is_imported_before_a_command_runs() -> None:
    script = "import sys, kempelen.cli.main; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert HEAVY & set(ran.stdout.split()) == set()


def test_a_command_that_does_not_exist(kempelen: Any) -> None:
    told = kempelen("plya")
    assert told.code == 2
    assert "play" in told.err
