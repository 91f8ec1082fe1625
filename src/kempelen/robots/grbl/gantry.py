"""A Cartesian machine under GRBL 1.1. The robot frame is the work coordinate system G54."""

from collections.abc import Awaitable, Callable

from kempelen.core.protocols import Options, Robot
from kempelen.core.table import Table, WorkSpace
from kempelen.robots.grbl.gcode import GripperWiring
from kempelen.robots.grbl.mechanics import Straight
from kempelen.robots.grbl.options import read_options
from kempelen.robots.grbl.robot import GrblRobot
from kempelen.robots.grbl.timing import Timing
from kempelen.robots.transport import Transport, open_port


def driver(port: str, table: Table, options: Options) -> Robot:
    """The driver registered as ``gantry``; does no I/O.

    Args:
        port: ``/dev/tty...``, a pseudo-terminal's path, or ``socket://host:port``.
        table: Its work space is what the machine must reach.
        options: See `GantryOptions`.

    Raises:
        ConfigError: an unknown option, or a value out of range.
    """
    chosen = read_options(options)
    return GrblGantry(
        lambda: open_port(port, baud=chosen.baud),
        table.space,
        wiring=chosen.wiring,
        apply_settings=chosen.apply_settings,
    )


class GrblGantry(GrblRobot):
    """Implements `kempelen.core.protocols.Robot`.

    Args:
        connect: Opens the port; called on entering and on recovering from a lost line.
        space: The work space, in the robot frame; also what the controller's settings must fit.
        wiring: Of the gripper.
        timing: Patience.
        apply_settings: Send settings that do not fit instead of refusing them.
    """

    def __init__(
        self,
        connect: Callable[[], Awaitable[Transport]],
        space: WorkSpace,
        *,
        wiring: GripperWiring | None = None,
        timing: Timing | None = None,
        apply_settings: bool = False,
    ) -> None:
        super().__init__(
            connect, Straight(space), wiring=wiring, timing=timing, apply_settings=apply_settings
        )
