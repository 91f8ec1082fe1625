"""Where everything on the table is now, for the 3D view.

On the twin the poses are the physics' own, by its side door: for eyes only, nothing of it reaches the stack.
On a machine the tool is where the robot reports it, and the pieces stand where the journal has them.
"""

from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from kempelen.app.calibration_file import load_calibration
from kempelen.app.station import Station
from kempelen.app.table_session import digest
from kempelen.core.places import Layout, Place
from kempelen.core.protocols import GripperState, RobotPhase, RobotState
from kempelen.core.table import Table
from kempelen.game.state import GameState
from kempelen.server.scene import quaternion
from kempelen.server.topics import PieceView, Point

Truth = Callable[[], Awaitable[Mapping[str, Any] | None]]

_MOTION = frozenset({RobotPhase.HOMING, RobotPhase.MOVING, RobotPhase.HOLDING, RobotPhase.JOGGING})
_DIGITS = 1  # of a millimetre
_TURN_DIGITS = 3  # of a quaternion
_ANGLE_DIGITS = 4  # of a radian


@dataclass(frozen=True, slots=True)
class Sample:
    """One look.

    Attributes:
        pieces: All of them.
        resting: Whether nothing moves, so that one may look less often.
        table: Names what stands still.
        joints: Of an arm, rad; None for other robots.
    """

    tool: Point | None
    closed: bool
    hand: Point | None
    pieces: tuple[PieceView, ...]
    resting: bool
    table: str
    joints: tuple[float, ...] | None = None


class SceneSource(Protocol):
    """Somebody who knows where everything is."""

    async def sample(self) -> Sample | None:
        """Look; None when there is nothing to see.

        Raises:
            KempelenError: It cannot be told.
        """
        ...


class TableName:
    """Names what stands still: the same table has the same name.

    Args:
        table: As it is in use.
    """

    def __init__(self, table: Callable[[], Table]) -> None:
        self._table = table
        self._named: Table | None = None
        self._name = ""

    @property
    def name(self) -> str:
        """Of the table in use now."""
        table = self._table()
        if table is not self._named:
            self._named, self._name = table, digest(table)
        return self._name


class TwinScene:
    """The truth of a twin.

    Args:
        truth: As `kempelen.app.station.Station.truth`.
        table: As it is in use.
    """

    def __init__(self, truth: Truth, table: Callable[[], Table]) -> None:
        self._truth = truth
        self._table = TableName(table)

    async def sample(self) -> Sample | None:
        """Ask the twin."""
        truth = await self._truth()
        if truth is None:
            return None
        return Sample(
            tool=_rounded(truth["tool"]),
            closed=bool(truth["closed"]),
            hand=None if truth["hand"] is None else _rounded(truth["hand"]),
            pieces=tuple(_piece(number, piece) for number, piece in enumerate(truth["pieces"])),
            resting=bool(truth["resting"]),
            table=self._table.name,
            joints=_angles(truth.get("joints")),
        )


def _piece(number: int, piece: Mapping[str, Any]) -> PieceView:
    letter = str(piece["kind"])
    w, x, y, z = (round(part, _TURN_DIGITS) for part in piece["q"])
    return PieceView(
        id=number,
        letter=letter if piece["white"] else letter.lower(),
        at=_rounded((piece["x"], piece["y"], piece["z"])),
        quaternion=(w, x, y, z),
    )


def _rounded(point: Any) -> Point:
    x, y, z = (round(float(part), _DIGITS) for part in point)
    return x, y, z


def _angles(joints: Iterable[float] | None) -> tuple[float, ...] | None:
    return None if joints is None else tuple(round(angle, _ANGLE_DIGITS) for angle in joints)


class JournalScene:
    """A real table: the tool as reported, the pieces as the journal has them.

    Args:
        state: Of the game; None without one.
        table: As it is in use.
        robot: As it reported last.
    """

    def __init__(
        self,
        state: Callable[[], GameState | None],
        table: Callable[[], Table],
        robot: Callable[[], RobotState],
    ) -> None:
        self._state = state
        self._table = table
        self._name = TableName(table)
        self._robot = robot
        self._ids: dict[Place, int] = {}
        self._letters: dict[int, str] = {}

    async def sample(self) -> Sample:
        """Put together what is known."""
        robot = self._robot()
        tool = None if robot.reported_position is None else _rounded(robot.reported_position)
        return Sample(
            tool=tool,
            closed=robot.gripper is not GripperState.OPEN,
            hand=None,
            pieces=tuple(sorted(self._pieces(tool), key=lambda piece: piece.id)),
            resting=robot.phase not in _MOTION,
            table=self._name.name,
            joints=_angles(robot.joints),
        )

    def _pieces(self, tool: Point | None) -> list[PieceView]:
        """All of them; the one that is carried hangs at the tool."""
        state, table = self._state(), self._table()
        if state is None:
            return []
        self._follow(state.layout)
        pending = state.pending
        held = pending.at_hand if pending is not None and pending.carrying and tool is not None else None
        pieces = []
        for place, piece in state.layout.items():
            at = _rounded(table.centre(place))
            if held is not None and tool is not None and place == held.source:
                at = _rounded((tool[0], tool[1], tool[2] - table.pieces[piece.piece_type].grip_height))
            pieces.append(self._piece(place, piece.symbol(), at, table))
        return pieces

    def _piece(self, place: Place, letter: str, at: Point, table: Table) -> PieceView:
        return PieceView(
            id=self._ids[place], letter=letter, at=at, quaternion=quaternion(table.robot_from_board)
        )

    def _follow(self, layout: Layout) -> None:
        """Give each piece the number it had; one that is elsewhere now is the same as one that is gone."""
        here = {place: piece.symbol() for place, piece in layout.items()}
        kept = {p: n for p, n in self._ids.items() if here.get(p) == self._letters[n]}
        free = [n for p, n in self._ids.items() if p not in kept]
        for place in sorted(set(here) - set(kept)):
            number = next((n for n in free if self._letters[n] == here[place]), None)
            if number is None:
                number = len(self._letters)
                self._letters[number] = here[place]
            else:
                free.remove(number)
            kept[place] = number
        self._ids = kept


def table_in_view(station: Station) -> Table:
    """What the 3D view is built from: on the twin the true table, elsewhere the one that is known.

    Raises:
        CalibrationError: the calibration file is damaged.
    """
    if station.config.on_twin:
        return station.config.build_table()
    if station.session is not None:
        return station.session.hand.table
    return station.config.build_table(load_calibration(station.config.calibration_path))


def scene_source(station: Station) -> SceneSource | None:
    """Who knows where everything on the station's table is; None when no table is up."""
    session = station.session
    if session is None:
        return None
    if session.control is not None:
        table = table_in_view(station)
        return TwinScene(station.truth, lambda: table)
    return JournalScene(
        lambda: None if station.live is None else station.live.arbiter.state,
        lambda: session.hand.table,
        lambda: station.robot,
    )
