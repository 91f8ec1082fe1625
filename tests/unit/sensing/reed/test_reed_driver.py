"""The reed board's driver: greeting, strangers, damage, loss, lamps; two boards."""

import asyncio
from collections.abc import Callable

import chess
import pytest

from kempelen.app.reed import only_board
from kempelen.core.errors import ConfigError, LinkError, SensorError
from kempelen.core.reed import Change, Sound
from kempelen.core.senses import Sight
from kempelen.sensing.reed import board as driver
from kempelen.sensing.reed.board import ReedBoard, Told, Trouble
from kempelen.sensing.reed.sensor import ReedSensor
from kempelen.testing.transports import MemoryTransport
from kempelen.twin.reed.device import Device, Line


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("GREETING_S", "ASK_AGAIN_S", "SILENT_S", "_FIRST_WAIT_S", "_LONGEST_WAIT_S"):
        monkeypatch.setattr(driver, name, getattr(driver, name) / 20)


class Wire:
    """A virtual board in memory, opened as often as wanted."""

    def __init__(self, device: Device | None = None) -> None:
        self.device = device or Device()
        self.device.power_up(chess.Board().occupied)
        self.device.take_output()
        self.now, self.magnets = 0, chess.Board().occupied
        self.opened: list[MemoryTransport] = []
        self.broken = ""

    async def open(self) -> MemoryTransport:
        if self.broken:
            raise LinkError(self.broken)
        self.opened.append(MemoryTransport("board", self._hear))
        return self.opened[-1]

    def _hear(self, data: bytes) -> None:
        self.device.receive(self.now, data)
        self.opened[-1].feed(self.device.take_output())

    def hold(self, ms: int) -> None:
        for _ in range(ms):
            self.now += 1
            self.device.scan(self.now, self.magnets)
        self.opened[-1].feed(self.device.take_output())


class Heard:
    """What a driver told."""

    def __init__(self) -> None:
        self.told: list[Told | Trouble] = []
        self._news = asyncio.Event()

    def __call__(self, message: Told | Trouble) -> None:
        self.told.append(message)
        self._news.set()

    @property
    def troubles(self) -> list[str]:
        return [each.text for each in self.told if isinstance(each, Trouble)]

    async def until(self, done: Callable[[], bool]) -> None:
        async with asyncio.timeout(10):
            while not done():
                self._news.clear()
                await self._news.wait()


async def test_greeted_then_told_lit_and_heard() -> None:
    wire, heard = Wire(), Heard()
    async with ReedBoard("memory", wire.open, heard) as board:
        assert board.hello.identity == "7F3A09C1"
        board.light(1 << chess.E4)
        board.sound(Sound.WARN)
        wire.magnets ^= 1 << chess.E2
        wire.hold(50)
        await heard.until(lambda: any(isinstance(each, Change) for each in heard.told))
        assert (wire.device.lit, wire.device.sounds) == (1 << chess.E4, [Sound.WARN])
    assert wire.device.lit == 0


async def test_another_device_and_nobody_are_told_apart() -> None:
    async def grbl() -> MemoryTransport:
        stream = MemoryTransport("grbl")
        stream.feed(b"\r\nGrbl 1.1h ['$' for help]\r\n")
        return stream

    with pytest.raises(SensorError, match=r'Another device answers at P: it says "Grbl 1\.1h'):
        await ReedBoard("P", grbl, Heard()).__aenter__()

    async def silent() -> MemoryTransport:
        return MemoryTransport("silence")

    with pytest.raises(SensorError, match="No reed board answers at P"):
        await ReedBoard("P", silent, Heard()).__aenter__()


@pytest.mark.parametrize(("version", "old"), [(2, "program"), (0, "board's firmware")])
async def test_another_version_of_the_protocol_is_refused(version: int, old: str) -> None:
    with pytest.raises(SensorError, match=f"speaks version {version} .* Bring the {old} up to date"):
        await ReedBoard("P", Wire(Device(version=version)).open, Heard()).__aenter__()


async def test_two_boards_have_to_be_told_apart_by_name() -> None:
    wires = {"/dev/a": Wire(Device("0000000A")), "/dev/b": Wire(Device("0000000B"))}
    with pytest.raises(ConfigError, match="2 reed boards answer: 0000000A at /dev/a and 0000000B at /dev/b"):
        await only_board(wires, lambda name: wires[name].open())
    wires["/dev/a"].broken = "taken"
    assert await only_board(wires, lambda name: wires[name].open()) == "/dev/b"
    wires["/dev/b"].broken = "taken"
    with pytest.raises(SensorError, match="No reed board answers; asked: /dev/a, /dev/b"):
        await only_board(wires, lambda name: wires[name].open())


async def test_a_lost_line_is_told_and_found_again_with_its_lamps() -> None:
    wire, heard = Wire(), Heard()
    async with ReedBoard("memory", wire.open, heard, heard) as board:
        board.light(5)
        wire.device.lit = 0
        wire.opened[-1].lose()
        await heard.until(lambda: board.connections >= 2 and Trouble("") in heard.told)
        assert wire.device.lit == 5
        assert any(isinstance(each, Trouble) and "cable" in each.text for each in heard.told)


async def test_a_silent_board_and_another_one_in_its_place_are_told() -> None:
    wire, heard = Wire(), Heard()
    async with ReedBoard("memory", wire.open, heard, heard):
        wire.device.identity = "0000000B"
        await heard.until(lambda: any("Another reed board" in text for text in heard.troubles))
        assert "has said nothing for" in heard.troubles[0]
        wire.device.identity = "7F3A09C1"
        await heard.until(lambda: Trouble("") in heard.told)


async def test_damaged_lines_are_asked_for_again() -> None:
    wire, heard = Wire(Device(seed=5, line=Line(damage=0.01))), Heard()
    async with ReedBoard("memory", wire.open, heard) as board:
        for _ in range(40):
            wire.hold(25)
            await asyncio.sleep(0)
        await heard.until(lambda: board.damaged > 3)
        assert all(not isinstance(each, Trouble) for each in heard.told)


async def test_the_sensor_reports_only_what_was_read_after_it_was_asked() -> None:
    wire = Wire()
    async with ReedSensor("memory", wire.open) as sensor:
        wire.hold(1000)
        looks = sensor.observe()
        seen = await anext(looks)
        assert seen.valid
        assert sensor.reading.closed == chess.Board().occupied
        wire.opened[-1].lose()
        wire.broken = "it was unplugged"
        async with asyncio.timeout(10):
            while seen.sight is not Sight.STALE:
                seen = await anext(looks)
        await looks.aclose()  # type: ignore[attr-defined]
        assert "it was unplugged" in seen.message or "cable" in seen.message


async def test_the_squares_that_a_sentence_names_are_lit() -> None:
    wire = Wire()
    async with ReedSensor("memory", wire.open) as sensor:
        sensor.warn("Put the white knight from e5 back on g1.")
        assert wire.device.lit == 1 << chess.E5 | 1 << chess.G1
        assert wire.device.sounds == [Sound.WARN]
        sensor.warn("")
        assert wire.device.lit == 0
