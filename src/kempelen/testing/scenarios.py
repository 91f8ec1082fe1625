"""The whole program as its users run it: a process of its own, its lines read, its death arranged.

A `Program` is one run of ``python -m kempelen``. A `Kill` says at which instant it dies, `seeded_kills` deals
them out, and `play_killed` plays one game through any number of deaths and resumes.
"""

import asyncio
import json
import os
import queue
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from kempelen.app.audit import disagreements
from kempelen.app.paths import twin_state_path
from kempelen.core.errors import JournalError
from kempelen.core.table import Table
from kempelen.game.journal import JournalReader
from kempelen.game.state import GameState
from kempelen.twin.client import TwinProcess
from kempelen.twin.keeping import StateLock
from kempelen.twin.spec import CONTROL_FOLDER, TwinSpec

LINE_S = 90.0
"""Longest wait for a line of output: an idle machine needs about three."""

NO_SUCH_LINE = "\x00"
"""A line that is never printed: the program runs to its end."""


def children_of(pid: int) -> dict[int, str]:
    """Command lines of the processes that a process has started and not yet outlived."""
    found = {}
    for child in Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split():
        with suppress(OSError):  # it has just ended
            words = Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")
            found[int(child)] = b" ".join(words).decode()
    return found


def twin_of(pid: int) -> int:
    """The process of a program's twin.

    Raises:
        LookupError: it runs none.
    """
    for child, command in children_of(pid).items():
        if "kempelen.twin" in command:
            return child
    raise LookupError(f"process {pid} runs no twin")


class Program:
    """One run of the program. Context manager: killed at the end of the block if it still runs.

    Args:
        arguments: As typed after ``kempelen``.
        typing: Whether the test types; otherwise nobody sits at the terminal.

    Attributes:
        lines: What it has printed so far and was read.
    """

    def __init__(self, *arguments: str, typing: bool = False) -> None:
        environment = {**os.environ, "COLUMNS": "200"}
        # A file of its own: an orphaned twin may keep it open, and is not waited for.
        handle, name = tempfile.mkstemp(prefix="kempelen-errors-")
        self._errors = Path(name)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "kempelen", *arguments],
            stdin=subprocess.PIPE if typing else subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=handle,
            text=True,
            env=environment,
        )
        os.close(handle)
        self.lines: list[str] = []
        self._fresh: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._reading = threading.Thread(target=self._read, name="program-output")
        self._reading.start()

    def _read(self) -> None:
        for line in self._process.stdout or ():
            self._fresh.put(line.rstrip("\n"))
        self._fresh.put(None)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.kill()
        self._errors.unlink()

    @property
    def pid(self) -> int:
        """Of the program."""
        return self._process.pid

    @property
    def output(self) -> str:
        """Everything printed so far."""
        return "\n".join(self.lines)

    @property
    def errors(self) -> str:
        """What went to the error output."""
        return self._errors.read_text(encoding="utf-8")

    def next_line(self, seconds: float = LINE_S) -> str | None:
        """The next line printed; None when the program has closed its output.

        Raises:
            TimeoutError: it said nothing for so long.
        """
        try:
            line = self._fresh.get(timeout=seconds)
        except queue.Empty:
            raise TimeoutError(f"nothing for {seconds} s after:\n{self.output}") from None
        if line is None:
            self._fresh.put(None)
        else:
            self.lines.append(line)
        return line

    def until(self, text: str, times: int = 1) -> bool:
        """Read until a line contains ``text`` for the n-th time; False when the output ended before."""
        while times > 0 and (line := self.next_line()) is not None:
            times -= text in line
        return times == 0

    def type(self, line: str) -> None:
        """Type a line."""
        if self._process.stdin is None:
            raise RuntimeError("nobody types here: typing=False")
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def send(self, number: signal.Signals) -> None:
        """A signal, as Ctrl-C (SIGINT), ``kill`` (SIGTERM) or a closed terminal (SIGHUP) send one."""
        self._process.send_signal(number)

    def kill_twin(self) -> None:
        """``kill -9`` for its twin."""
        os.kill(twin_of(self.pid), signal.SIGKILL)

    def kill(self) -> int:
        """``kill -9``, if it still runs; its exit code."""
        self._process.kill()
        return self.wait()

    def wait(self, seconds: float = LINE_S) -> int:
        """Its exit code, once it has ended and everything it printed is read.

        Raises:
            TimeoutExpired: it does not end.
        """
        if self._process.stdin is not None:
            with suppress(BrokenPipeError):
                self._process.stdin.close()
        code = self._process.wait(seconds)
        self._reading.join()
        while self.next_line() is not None:
            pass
        if self._process.stdout is not None:
            self._process.stdout.close()
        return code


@dataclass(frozen=True, slots=True)
class Kill:
    """An instant of death.

    Attributes:
        after: What the program has to print; empty: the instant is counted from its start.
        times: How often.
        delay: And then so long, s.
        twin_too: Whether the twin's process dies with it, and its table.
    """

    after: str
    times: int
    delay: float
    twin_too: bool = False

    def strike(self, program: Program) -> bool:
        """Wait for the instant and kill; False when the program ended before it."""
        if self.after and not program.until(self.after, self.times):
            return False
        time.sleep(self.delay)  # the instant itself, chosen by the seed: nothing is waited for
        if self.twin_too:
            program.kill_twin()
        return program.kill() == -signal.SIGKILL


NEVER = Kill(NO_SUCH_LINE, 1, 0.0)


def seeded_kills(seed: int) -> Iterator[Kill]:
    """Deaths without end: at events (most with a piece held), at any time in a game, in start-up and homing.

    Every six of them are one of each kind, so that any number of them is well mixed.
    """
    rng = random.Random(seed)  # noqa: S311 - seeded instants, not secrets
    kinds: list[Callable[[], Kill]] = [
        lambda: Kill("carrying", rng.randint(1, 4), rng.uniform(0.0, 0.08)),
        lambda: Kill("carrying", rng.randint(1, 4), rng.uniform(0.0, 0.02)),
        lambda: Kill("fetching", rng.randint(1, 4), rng.uniform(0.0, 0.08)),
        lambda: Kill("stands on", rng.randint(1, 3), rng.uniform(0.0, 0.03)),
        lambda: Kill("Game ", 1, rng.uniform(0.0, 0.6)),
        lambda: Kill("", 0, rng.uniform(0.1, 3.0)),
    ]
    while True:
        rng.shuffle(kinds)
        yield from [kind() for kind in kinds]


@dataclass
class KilledGame:
    """What became of a game that was killed again and again.

    Attributes:
        report: As the last program wrote it; empty when even that one was killed, after the game's end.
        wrong: Where the twin's table and the journal differ in the end.
        state: As the journal has it.
        kills: Deaths in all.
        held: Deaths with a piece in the gripper, as the journal has it.
        output: Of each program.
    """

    report: dict[str, Any] = field(default_factory=dict)
    state: GameState | None = None
    kills: int = 0
    held: int = 0
    wrong: list[str] = field(default_factory=list)
    output: list[str] = field(default_factory=list)


def play_killed(
    data: Path, command: Sequence[str], kills: Iterator[Kill], *options: str, most: int = 1 << 30
) -> KilledGame:
    """Begin a game, kill the program, resume it and so on until ``kills`` are used up; then to the end.

    Args:
        data: Its data directory; holds no other game.
        command: Begins the game.
        kills: One for each run; the rest is left for another game when this one ends early.
        options: For every run.
        most: Deaths after which no more are wanted.

    Raises:
        AssertionError: a program ended by itself, and not with the game.
    """
    report = data / "report.json"
    options = (*options, "--data-dir", str(data), "--report", str(report))
    result = KilledGame()
    while result.state is None or result.state.ended is None:
        kill = next(kills, NEVER) if result.kills < most else NEVER
        with Program(*(("resume", "1") if result.state else command), *options) as program:
            killed = kill.strike(program)
            code = program.wait()
            result.output.append(program.output + program.errors)
        result.state = _state(data)
        if killed:
            result.kills += 1
            result.held += _holding(result.state)
        else:
            assert code == 0, f"exit code {code} after {result.kills} kills:\n{result.output[-1]}"
            result.report = json.loads(report.read_text(encoding="utf-8"))
    result.wrong = result.report["disagreements"] if result.report else asyncio.run(_look(data, result.state))
    return result


async def _look(data: Path, state: GameState) -> list[str]:
    """At the table that a killed program has left; nothing is wrong with one that was cleared away."""
    kept = twin_state_path(data, 1)
    await StateLock.released(kept)
    if not kept.exists():
        return []
    table, layout = Table(), state.layout
    with tempfile.TemporaryDirectory(prefix=CONTROL_FOLDER) as folder:
        control = Path(folder) / "control"
        async with TwinProcess(
            TwinSpec.of(table, layout, control=control, state=str(kept), resume=True, speed=0)
        ) as twin:
            return disagreements(table, layout, await twin.control.ask("settle"))


def _holding(state: GameState | None) -> bool:
    pending = state.pending if state else None
    return pending is not None and pending.carrying


def _state(data: Path) -> GameState | None:
    """The first game in a journal."""
    try:
        with JournalReader(data / "journal.sqlite3") as journal:
            return journal.state(1) if journal.games() else None
    except JournalError:  # killed before it had made one
        return None
