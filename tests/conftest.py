"""Shared fixtures: nothing may leak from a test."""

import asyncio
import gc
import inspect
import os
import threading
import time
from collections.abc import AsyncIterator, Iterator
from multiprocessing import resource_tracker
from pathlib import Path

import hypothesis
import pytest
import pytest_asyncio

os.environ.setdefault("KEMPELEN_SENSOR", "none")  # tests of other things do not wait for cameras

hypothesis.settings.register_profile("kempelen", derandomize=True, deadline=None)
hypothesis.settings.load_profile("kempelen")

_LONG = ("browser", "scenario")
"""Folders of files that take minutes each, most of it waiting."""


@pytest.hookimpl(trylast=True)  # after they were shuffled
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long files come first: a worker that began one last would work alone in the end."""
    items.sort(key=lambda item: item.path.parent.name not in _LONG)


_GRACE = 2.0  # s: the kernel and joining threads are asynchronous; a leak is what is still there after this


def _children() -> set[str]:
    """This process's children, "pid (name)", zombies that wait to be reaped included."""
    found = set()
    for thread in Path("/proc/self/task").iterdir():
        try:
            children = (thread / "children").read_text(encoding="ascii").split()
        except OSError:  # it has just ended
            continue
        for child in children:
            if int(child) != _lasting_child():
                found.add(f"{child} {_name(child)}")
    return found


def _name(pid: str) -> str:
    try:
        return f"({Path('/proc', pid, 'comm').read_text(encoding='utf-8').strip()})"
    except OSError:  # it has just ended
        return "(ended)"


def _lasting_child() -> int | None:
    """The standard library's one tracker of shared memory lives as long as the interpreter."""
    return getattr(resource_tracker._resource_tracker, "_pid", None)


def _listening() -> set[str]:
    """Inodes of this process's sockets that listen on TCP, and its terminals."""
    found, sockets = set(), set()
    for fd in Path("/proc/self/fd").iterdir():
        try:
            target = str(fd.readlink())
        except OSError:  # the listing's own descriptor
            continue
        opened = f"fd {fd.name} -> {target}"
        if target.startswith("socket:"):
            sockets.add((target, opened))
        elif "ptmx" in target or ("/pts/" in target and int(fd.name) > 2):
            found.add(opened)
    listening = _listening_sockets() if sockets else set()
    return found | {opened for target, opened in sockets if target in listening}


def _listening_sockets() -> set[str]:
    listening = set()
    for table in ("/proc/self/net/tcp", "/proc/self/net/tcp6"):
        try:
            rows = Path(table).read_text().splitlines()[1:]
        except OSError:
            continue
        listening |= {f"socket:[{row.split()[9]}]" for row in rows if row.split()[3] == "0A"}
    return listening


def _threads() -> set[str]:
    """Threads that a program's end would wait for or that outlive their owner."""
    return {f"{t.name} ({t.ident})" for t in threading.enumerate() if not t.name.startswith("pytest_timeout")}


_WATCHED = {"child processes": _children, "listening ports and terminals": _listening, "threads": _threads}


def _leaks(before: dict[str, set[str]]) -> dict[str, set[str]]:
    return {what: new for what, look in _WATCHED.items() if (new := look() - before[what])}


@pytest.fixture(autouse=True)
def no_leaks() -> Iterator[None]:
    """Fail a test that leaves child processes, open ports, terminals or threads behind."""
    before = {what: look() for what, look in _WATCHED.items()}
    yield
    deadline = time.monotonic() + _GRACE
    while (leaks := _leaks(before)) and time.monotonic() < deadline:
        gc.collect()
        time.sleep(0.01)  # waiting for an end that is under way, not ordering events
    if leaks:
        pytest.fail("; ".join(f"leaked {what}: {', '.join(sorted(found))}" for what, found in leaks.items()))


@pytest.fixture(autouse=True)
def no_leaked_tasks(request: pytest.FixtureRequest, no_leaks: None) -> None:
    """Fail an asynchronous test that leaves tasks behind; depends on `no_leaks` to be finalised before it."""
    del no_leaks
    if inspect.iscoroutinefunction(getattr(request.node, "obj", None)):
        request.getfixturevalue("_tasks_of_the_test")


@pytest_asyncio.fixture
async def _tasks_of_the_test() -> AsyncIterator[None]:
    before = asyncio.all_tasks()
    yield
    left = [task for task in asyncio.all_tasks() - before if task is not asyncio.current_task()]
    if left:
        pytest.fail(f"leaked tasks: {', '.join(sorted(str(task.get_coro()) for task in left))}")
