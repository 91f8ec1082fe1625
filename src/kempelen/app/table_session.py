"""A table that is up: the wire's far end (twin or machine), the robot, the hand."""

import hashlib
import json
import tempfile
from contextlib import AsyncExitStack
from importlib.metadata import entry_points
from pathlib import Path
from typing import Self

from kempelen.app.arm_calibration import calibrated_arm
from kempelen.app.arm_setup import arm_setup, arm_spec, driver_options
from kempelen.app.calibration_file import load_calibration
from kempelen.app.careful_hand import CarefulHand
from kempelen.app.config import NODE_PORT, Config
from kempelen.app.fitting import require_table
from kempelen.app.kept_arm import KeptArm
from kempelen.app.network import link_of, table_name
from kempelen.app.other_hand import TableHand
from kempelen.app.timed_hand import TimedHand
from kempelen.core.errors import ConfigError
from kempelen.core.places import Layout
from kempelen.core.protocols import Robot
from kempelen.core.table import Table
from kempelen.nodes.door import RemoteDoor
from kempelen.nodes.messages import key_of
from kempelen.nodes.remote_robot import RemoteRobot
from kempelen.robots.hand import CartesianHand
from kempelen.twin.cameras.settings import CameraSpec
from kempelen.twin.client import Door, TwinControl, TwinProcess
from kempelen.twin.reed.settings import ReedSpec
from kempelen.twin.spec import CONTROL_FOLDER, TwinSpec

ROBOTS = "kempelen.robots"


def robot_kinds() -> list[str]:
    """Names of the installed drivers."""
    return sorted(point.name for point in entry_points(group=ROBOTS))


def make_robot(config: Config, port: str, table: Table) -> Robot:
    """The driver that the configuration names; no I/O yet.

    Raises:
        ConfigError: no such driver.
    """
    found = entry_points(group=ROBOTS, name=config.robot.kind)
    if not found:
        raise ConfigError(
            f"There is no driver for a robot of kind '{config.robot.kind}'.",
            hint=f"Installed: {', '.join(robot_kinds())}.",
        )
    robot: Robot = next(iter(found)).load()(port, table, driver_options(config))
    return robot


def digest(table: Table) -> str:
    """Identifies table and calibration in the journal."""
    described = {
        "pose": table.robot_from_board.matrix.round(4).tolist(),
        "square": round(table.square, 4),
        "trays": [tray.model_dump() for tray in table.trays],
        "pieces": table.pieces.model_dump(),
    }
    return hashlib.sha256(json.dumps(described, sort_keys=True).encode()).hexdigest()[:16]


def calibrated_table(config: Config) -> Table:
    """The table as configured and calibrated, checked for fit.

    Raises:
        FitError: something does not fit; the message says what and by how much.
        CalibrationError: the calibration file is damaged.
    """
    table = config.build_table(load_calibration(config.calibration_path))
    require_table(config, table)
    return table


def twin_speed(config: Config) -> float:
    """The twin's time scale; 0 for as fast as it can."""
    return 0.0 if config.twin.speed == "max" else float(config.twin.speed)


class TableSession:
    """Async context manager: everything from the wire up to the hand.

    Args:
        config: What to connect to.
        table: Where things are.
        layout: What stands where when the twin's table is laid.
        state: File that keeps the twin's table between runs.
        resume: Whether to go on from ``state``.
        camera: Over the table of a twin of our own; None for none.

    Attributes:
        driver: Of the robot itself.
        robot: The driver; of an arm one that makes up for its drift.
        careful: The hand that sees to an arm's drift; None for other robots, and where that is switched off.
        twin: Its process; None on a real machine or a twin of somebody else's.
        control: The twin's side door, if there is one: for reports and the virtual person alone.
    """

    def __init__(
        self,
        config: Config,
        table: Table,
        layout: Layout,
        *,
        state: Path,
        resume: bool,
        camera: CameraSpec | None = None,
    ) -> None:
        self._config = config
        self._cameras = () if camera is None else (camera,)
        self.table = table
        self._layout = layout
        self._state = state
        self._resume = resume
        self._stack = AsyncExitStack()
        self.driver: Robot
        self.robot: Robot
        self.careful: CarefulHand | None = None
        self.twin: TwinProcess | None = None
        self.control: Door | None = None

    async def __aenter__(self) -> Self:
        """Start the twin if it is wanted, connect the robot.

        Raises:
            TwinError: the twin does not start, or nobody answers at its control socket.
            LinkError: the port does not answer as a robot.
            SettingsError: the controller's settings do not fit.
        """
        try:
            port = await self._far_end()
            self.driver = self.robot = await self._connected(port)
            self.hand = TimedHand(self._hand(), self.control)
        except BaseException:
            await self._stack.aclose()
            raise
        return self

    async def _connected(self, port: str) -> Robot:
        """The driver; a node's may be that of a twin, which then has its side door there."""
        if not port.startswith(NODE_PORT):
            return await self._stack.enter_async_context(make_robot(self._config, port, self.table))
        table = table_name(port.removeprefix(NODE_PORT))
        link = await self._stack.enter_async_context(link_of(self._config))
        robot = await self._stack.enter_async_context(RemoteRobot(link, table))
        if await link.standing(key_of(table, "door")):
            self.control = RemoteDoor(link, table)
        return robot

    def _hand(self) -> TableHand:
        """The hand that suits the robot; an arm's drift is kept account of unless that is switched off."""
        planner, setup = self._config.planner, arm_setup(self._config)
        if setup is None:
            return CartesianHand(self.robot, self.table, planner=planner.name, clearances=planner.clearances)
        from kempelen.robots.arm_hand import ArmHand  # noqa: PLC0415 - an arm's planning is nothing to a gantry

        arm = calibrated_arm(self._config.arm_calibration_path, setup.arm)
        if not setup.drift_budget:
            return ArmHand(self.robot, self.table, arm, clearances=planner.clearances)
        self.robot = kept = KeptArm(self.robot, arm)
        hand = ArmHand(kept, self.table, arm, clearances=planner.clearances)
        self.careful = CarefulHand(hand, kept)
        return self.careful

    async def _far_end(self) -> str:
        if not self._config.on_twin:
            if self._config.twin.control:
                control = TwinControl(Path(self._config.twin.control))
                self.control = await self._stack.enter_async_context(control)
            return self._config.robot.port
        if self._config.twin.control:
            raise ConfigError(
                f"The control socket {self._config.twin.control} is that of a twin started separately.",
                hint="Name its port too: --port PORT --twin-control SOCKET",
            )
        folder = self._stack.enter_context(tempfile.TemporaryDirectory(prefix=CONTROL_FOLDER))
        self._state.parent.mkdir(parents=True, exist_ok=True)
        # The world is as configured; what a calibration says about it may be wrong, and must then show.
        spec = TwinSpec.of(
            self._config.build_table(),
            self._layout,
            control=Path(folder) / "control",
            speed=twin_speed(self._config),
            seed=self._config.twin.seed,
            scatter=self._config.twin.scatter,
            baud=self._config.twin.baud,
            state=str(self._state),
            resume=self._resume,
            cameras=self._cameras,
            reed=self._reed(Path(folder)),
            arm=arm_spec(self._config),
        )
        self.twin = await self._stack.enter_async_context(TwinProcess(spec))
        self.control = self.twin.control
        return self.twin.address

    def _reed(self, folder: Path) -> ReedSpec | None:
        """The twin's board; plugged in again it is found at the same port."""
        spec = self._config.twin_reed
        return spec.model_copy(update={"link": str(folder / "reed")}) if spec and not spec.link else spec

    @property
    def ring(self) -> str:
        """Frames of the camera over the table.

        Raises:
            ConfigError: this is no twin of our own.
            TwinError: it has no camera.
        """
        if self.twin is None:
            raise ConfigError(
                "Only a twin of our own has a camera.", hint="Name another one, or play with --sensor none."
            )
        return self.twin.ring

    def use(self, table: Table) -> None:
        """The table was measured again; not while a piece is being carried."""
        self.table = self.hand.table = table

    async def __aexit__(self, *exc: object) -> None:
        """Robot at rest, port free, twin put away."""
        await self._stack.aclose()
