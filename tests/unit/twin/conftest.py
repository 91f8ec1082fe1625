"""A virtual controller on the bench, with a host that types; a table with somebody to drive its robot."""

from collections.abc import Callable, Mapping

import pytest

from kempelen.testing.world_driver import SCENE, WorldDriver
from kempelen.twin.grbl import Eeprom, Machine, VirtualGrbl
from kempelen.twin.physics import World

TRAVEL = (700.0, 450.0, 200.0)
START = (-400.0, -250.0, -100.0)


class Bench:
    """A host's side of the wire.

    Args:
        homed: Booted, knowing where it is, Idle.
        baud: Of the line.
        settings: That differ from the defaults.
        start: True position at power-up.
    """

    def __init__(
        self,
        *,
        homed: bool = True,
        baud: int = 0,
        settings: Mapping[int, float] | None = None,
        start: tuple[float, float, float] = START,
    ) -> None:
        eeprom = Eeprom.for_travel(TRAVEL, dict(settings or {}))
        self.grbl = VirtualGrbl(Machine(TRAVEL, start), eeprom=eeprom, baud=baud)
        if homed:
            self.grbl.assume_homed()
        self.step_s = 0.008

    def send(self, data: bytes, seconds: float = 0.0) -> str:
        """Write to the wire, let ``seconds`` pass; what has come back."""
        self.grbl.receive(data)
        self.grbl.advance(0.0)
        return self._taken() + self.wait(seconds)

    def wait(self, seconds: float) -> str:
        """What comes back while ``seconds`` pass."""
        end = self.grbl.time_s + seconds
        heard = ""
        while self.grbl.time_s < end - 1e-12:
            self.grbl.advance(min(self.step_s, end - self.grbl.time_s))
            heard += self._taken()
        return heard

    def settle(self, limit: float = 60.0) -> str:
        """What comes back until nothing goes on any more."""
        heard, end = "", self.grbl.time_s + limit
        self.grbl.advance(0.0)
        while not self.grbl.idle():
            assert self.grbl.time_s < end, f"still busy after {limit} s: {self.grbl.state}"
            self.grbl.advance(self.step_s)
            heard += self._taken()
        return heard + self._taken()

    def status(self) -> str:
        """The answer to ``?``."""
        return self.send(b"?")

    def _taken(self) -> str:
        return self.grbl.take_output().decode("latin-1")


@pytest.fixture
def bench() -> Callable[..., Bench]:
    """Makes benches."""
    return Bench


@pytest.fixture
def driver() -> WorldDriver:
    """The start position on the usual table."""
    return WorldDriver(World(SCENE, seed=5))
