"""Controllers that talk alike: how their lines are framed, how they are met."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from kempelen.robots.grbl.connect import Greeting, greet
from kempelen.robots.grbl.framing import Bare, Framing
from kempelen.robots.grbl.gcode import GripperWiring
from kempelen.robots.grbl.link import Link
from kempelen.robots.grbl.mechanics import Mechanics
from kempelen.robots.grbl.timing import Timing


class Greet(Protocol):
    """Finds out everything about the controller at the other end, see `connect.greet`."""

    async def __call__(
        self, link: Link, mechanics: Mechanics, wiring: GripperWiring, timing: Timing, *, apply_settings: bool
    ) -> Greeting:
        """What was found."""
        ...


@dataclass(frozen=True, slots=True)
class Family:
    """Controllers that talk alike.

    Attributes:
        framing: Makes the framing of a connection.
        greet: Meets a controller.
    """

    framing: Callable[[], Framing]
    greet: Greet


GRBL = Family(Bare, greet)
