"""The firmware's own C++, compiled for this machine, against the twin's board and against the driver."""

import asyncio
import os
import random
import shutil
import subprocess
import tty
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Self

import chess
import pytest

from kempelen.core.reed import Ask, Buzz, Change, Lamps, Sound, Wiring, encode
from kempelen.robots.transport import open_port
from kempelen.sensing.reed.board import ReedBoard, Told
from kempelen.twin.reed.device import Device
from kempelen.twin.reed.matrix import Matrix, Scan

SOURCE = Path(__file__).parents[3] / "firmware" / "reed-board"
COMPILER = next(filter(None, map(shutil.which, ("g++", "clang++", "c++"))), None)
pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C++ compiler (g++, clang++, c++) is installed")


@pytest.fixture(scope="module")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("firmware") / "board"
    command: list[str | Path] = [
        str(COMPILER),
        "-std=c++11",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-O1",
        "-o",
        out,
        SOURCE / "host.cpp",
    ]
    subprocess.run(command, check=True, capture_output=True)
    return out


def line(word: str, now: int, scan: Scan) -> str:
    live = "".join(f"{row:02X}" for row in scan.live)
    return f"{word} {now} {scan.closed:016X} {live}\n"


def edges(rng: random.Random, contacts: int, count: int) -> Iterator[tuple[int, int]]:
    """Milliseconds and contacts: switches that change and bounce, several at a time."""
    now = 0
    for _ in range(count):
        squares = rng.sample(range(64), rng.choice((1, 1, 2)))
        for _ in range(rng.randrange(12)):
            now += 1
            yield now, contacts ^ sum(rng.getrandbits(1) << square for square in squares)
        contacts ^= sum(1 << square for square in squares)
        for _ in range(rng.randrange(5, 60)):
            now += 1
            yield now, contacts


@pytest.mark.parametrize("matrix", [Matrix(), Matrix(bare=0x0010_0000_0420_0200), Matrix(Wiring.PLAIN)])
def test_the_firmware_says_what_the_twin_says(firmware: Path, matrix: Matrix) -> None:
    """The same edges, bounces and missing diodes; the same lines, byte for byte."""
    rng = random.Random(11)
    device = Device("0000BEEF", matrix)
    contacts = chess.Board().occupied & ~0xFF if matrix.wiring is Wiring.PLAIN else chess.Board().occupied
    told = [line("begin", 0, matrix.scan(contacts))]
    device.power_up(contacts)
    expected = device.take_output()
    for now, closed in edges(rng, contacts, 60):
        told.append(line("scan", now, matrix.scan(closed)))
        device.scan(now, closed)
        expected += device.take_output()
    run = subprocess.run(
        [firmware, "0000BEEF", matrix.wiring], input="".join(told).encode(), capture_output=True, check=True
    )
    assert expected.count(b"\nE ") > 40
    assert run.stdout == expected


def test_the_firmware_obeys_and_refuses(firmware: Path) -> None:
    said = [
        encode(Lamps(1 << 28 | 1)), encode(Buzz(Sound.WARN)), encode(Ask("S", 513)), encode(Ask("H")),
        b"H*0000\n", b"Q*%04X\n" % 0x0000, b"x" * 120 + b"\n", b"L 12*8C36\n", b"B loud*0000\n",
    ]  # fmt: skip
    script = line("begin", 0, Scan(0, (0,) * 8)).encode()
    script += b"".join(b"host 5 " + each for each in said)
    run = subprocess.run([firmware], input=script, capture_output=True, check=True)
    lines = [each.partition(b"*")[0].decode() for each in run.stdout.splitlines()]
    assert lines[1:5] == [
        "# lamps 0000000010000001", "# sound warn", "S 65535 5 0000000000000000 0000000000000000 513",
        "H 1 kempelen-reed 00000001 diodes 1",
    ]  # fmt: skip
    assert [each for each in lines[5:] if not each.startswith("N ")] == []
    assert lines.count("N long") == 1


class FirmwarePort:
    """The compiled firmware at a pseudo-terminal. Async context manager."""

    def __init__(self, firmware: Path) -> None:
        self._firmware = firmware
        self._now = 0

    async def __aenter__(self) -> Self:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.name = os.ttyname(slave)
        self._slave = slave
        pipe = asyncio.subprocess.PIPE
        self._process = await asyncio.create_subprocess_exec(self._firmware, stdin=pipe, stdout=pipe)
        os.set_blocking(self._master, False)
        asyncio.get_running_loop().add_reader(self._master, self._from_host)
        self._pump = asyncio.create_task(self._to_host())
        return self

    async def __aexit__(self, *exc: object) -> None:
        asyncio.get_running_loop().remove_reader(self._master)
        self._pump.cancel()
        await asyncio.gather(self._pump, return_exceptions=True)
        if self._process.stdin is not None:
            self._process.stdin.close()
        await self._process.wait()
        os.close(self._master)
        os.close(self._slave)

    def _write(self, text: bytes) -> None:
        if self._process.stdin is not None:
            self._process.stdin.write(text)

    def _from_host(self) -> None:
        with suppress(BlockingIOError, OSError):
            for each in os.read(self._master, 4096).splitlines(keepends=True):
                self._write(b"host %d " % self._now + each)

    async def _to_host(self) -> None:
        while self._process.stdout is not None and (said := await self._process.stdout.readline()):
            if not said.startswith(b"#"):
                os.write(self._master, said)

    def hold(self, closed: int, ms: int, *, begin: bool = False) -> None:
        if begin:
            self._write(line("begin", self._now, Scan(closed, (0,) * 8)).encode())
        for _ in range(ms):
            self._now += 1
            self._write(line("scan", self._now, Scan(closed, (0,) * 8)).encode())


async def test_the_driver_plays_with_the_firmware(firmware: Path) -> None:
    """Over a pseudo-terminal: greeted, a move in its order, lamps, and not a byte misread."""
    start = chess.Board().occupied
    e2, e4 = 1 << chess.E2, 1 << chess.E4
    told: list[Told] = []
    both = asyncio.Event()

    def take(message: Told) -> None:
        told.append(message)
        if sum(isinstance(each, Change) for each in told) == 2:
            both.set()

    async with FirmwarePort(firmware) as port:
        port.hold(start, 1, begin=True)
        async with ReedBoard("pty", lambda: open_port(port.name), take) as board:
            assert (board.hello.identity, board.hello.wiring) == ("00000001", Wiring.DIODES)
            board.light(e2 | e4)
            port.hold(start & ~e2, 60)
            port.hold(start & ~e2 | e4, 60)
            async with asyncio.timeout(20):
                await both.wait()
        assert (board.damaged, board.refused) == (0, 0)
    moves = [(each.square, each.placed) for each in told if isinstance(each, Change)]
    assert moves == [(chess.E2, False), (chess.E4, True)]
