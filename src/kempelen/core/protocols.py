"""What the rooms of the house ask of each other.

Every device is an async context manager whose constructor does no I/O. Cancelling a motion means: physically
at rest, then return. ``stop`` and ``hold`` never queue behind a motion.
"""

from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol, Self

import chess

from kempelen.core.geometry import Array
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.table import WorkSpace

# --- robot ------------------------------------------------------------------------------------------------


class RobotPhase(StrEnum):
    """What a robot is doing, in the words shown to people."""

    DISCONNECTED = "disconnected"
    LOCKED = "locked"  # must be homed
    HOMING = "homing"
    IDLE = "idle"
    MOVING = "moving"
    HOLDING = "holding"  # decelerating after `hold`
    HELD = "held"  # at rest in mid-motion, `resume` goes on
    JOGGING = "jogging"
    ALARM = "alarm"


class GripperState(StrEnum):
    """What the gripper was last told, as far as the controller still knows."""

    OPEN = "open"
    CLOSED = "closed"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class RobotState:
    """A snapshot.

    Attributes:
        reported_position: (x, y, z) mm in the robot frame as the controller last reported; None before
            homing.
        memory_kept: After connecting: whether the controller had kept running (position and gripper as
            before) or was reset (both lost).
        joints: Joint angles as the controller last reported them, rad, base first; None before homing
            and for a robot without turning joints.
        message: One plain sentence when something is wrong, with what to do.
    """

    phase: RobotPhase = RobotPhase.DISCONNECTED
    homed: bool = False
    reported_position: tuple[float, float, float] | None = None
    gripper: GripperState = GripperState.UNKNOWN
    memory_kept: bool = False
    message: str = ""
    joints: tuple[float, ...] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Follow:
    """Drive the tool point along a polyline.

    Attributes:
        vertices: (n, 3) mm, robot frame; the first is where the tool point is now.
        seconds: Predicted time.
    """

    vertices: Array
    seconds: float


@dataclass(frozen=True, slots=True, eq=False)
class FollowJoints:
    """Drive an arm's joints along a polyline in joint space; a robot without joints refuses it.

    Attributes:
        vertices: (n, k) rad, joint angles, base first; the first row is where the joints are now.
        times: (n,) s, rising, from 0: when each vertex is passed.
        seconds: Predicted time.
    """

    vertices: Array
    times: Array
    seconds: float


@dataclass(frozen=True, slots=True)
class SetGripper:
    """Close or open the gripper and wait ``seconds`` for it to settle."""

    closed: bool
    seconds: float


Action = Follow | FollowJoints | SetGripper


class Robot(Protocol):
    """A driver for one machine."""

    name: str
    space: WorkSpace

    @property
    def state(self) -> RobotState:
        """The latest snapshot."""
        ...

    async def __aenter__(self) -> Self:
        """Connect. Believes nothing: not homed, payload unknown.

        Raises:
            LinkError: no such port, no permission, another device answers.
            SettingsError: the controller's settings do not fit; the message names each and its fix.
        """
        ...

    async def __aexit__(self, *exc: object) -> None:
        """Bring the machine to rest and let go of the port."""
        ...

    def watch(self) -> AsyncIterator[RobotState]:
        """Each new snapshot; a slow reader skips to the newest."""
        ...

    async def home(self) -> None:
        """Find the reference switches; believed only when the controller proves it.

        Raises:
            AlarmError: a switch was not found.
            LinkError: the line fell silent.
        """
        ...

    async def run(self, group: Sequence[Action]) -> None:
        """Carry out an atomic group; returns when the machine is physically at the end.

        Raises:
            BusyError: another group is at work.
            NotHomedError: home first.
            StoppedError: `stop` or `cancel` ended it.
            AlarmError: the controller raised an alarm.
            LinkError: the line was lost; nothing is resent.
            MotionError: a vertex lies outside of the work space (nothing was sent).
        """
        ...

    async def retract(self) -> None:
        """Straight up to the top of the work space; raises as `run`."""
        ...

    async def hold(self) -> None:
        """Decelerate now, keeping the group; returns at rest. Between groups the next one waits."""
        ...

    async def resume(self) -> None:
        """Go on after `hold`."""
        ...

    async def cancel(self) -> None:
        """Hold, then drop the rest of the group; position is kept. `run` raises StoppedError."""
        ...

    async def stop(self) -> None:
        """E-stop: everything ends now; homing is needed afterwards."""
        ...

    async def recover(self) -> None:
        """After an alarm, a stop or a lost line: clear it (connect again), so that `home` can follow."""
        ...

    async def jog(self, direction: tuple[float, float, float], speed: float) -> None:
        """Keep moving along ``direction`` at ``speed`` mm/s; a keep-alive: motion ends when the calls do."""
        ...

    async def jog_stop(self) -> None:
        """End jogging; returns at rest."""
        ...


# --- hand -------------------------------------------------------------------------------------------------


class Checkpoint(StrEnum):
    """Instants of a transfer that the journal records before the hand goes on."""

    GRIPPING = "gripping"  # open for certain; about to approach and close on the piece at its source
    CARRYING = "carrying"  # closed on the piece; about to carry it to its target and open there
    RELEASED = "released"  # open around the piece, which stands on its target; about to rise clear of it


OnCheckpoint = Callable[[Checkpoint], Awaitable[None]]


@dataclass(frozen=True, slots=True)
class TransferReport:
    """Times of one transfer, s.

    Attributes:
        seconds: Measured, from the first byte to the hand free and clear.
        predicted: By the planner.
        bound: The provable lower bound for the carry.
        carry: Measured, from the grip to the release.
    """

    transfer: Transfer
    seconds: float
    predicted: float
    bound: float
    carry: float


class Hand(Protocol):
    """Robot, gripper and planner: carries transfers."""

    @property
    def state(self) -> RobotState:
        """The robot's latest snapshot."""
        ...

    async def prepare(self) -> None:
        """Home if needed, open the gripper; afterwards it is empty, open and parked."""
        ...

    async def carry(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> TransferReport:
        """Carry one piece over the standing ones (``standing`` includes the piece at its source).

        ``checkpoint`` is awaited at each `Checkpoint`, with the robot at rest, before the hand goes on: a
        piece is let go only after CARRYING and the hand rises from it only after RELEASED was recorded.
        Returns with the hand open, perhaps still around the piece: the next motion rises first. Cancelled or
        failed: at rest, the gripper as it was.
        """
        ...

    async def finish_held(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> None:
        """After a restart with the piece in the gripper: home with it, put it on its target; ends as `carry`.

        ``standing`` does not include the piece.
        """
        ...

    async def park(self, standing: Layout) -> None:
        """High, clear of the camera."""
        ...

    async def hold(self) -> None:
        """Pause at once, also with a piece in the gripper."""
        ...

    async def resume(self) -> None:
        """Go on after `hold`."""
        ...

    async def stop(self) -> None:
        """E-stop."""
        ...


# --- minds ------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Thinking:
    """What an engine thinks at the moment.

    Attributes:
        centipawns: From the side to move; None when a mate is seen.
        mate: Moves to mate, negative when being mated.
        line: Principal variation.
        adapted: Elo at which an engine that adapts to the other side has chosen; None for all others.
    """

    depth: int = 0
    centipawns: int | None = None
    mate: int | None = None
    line: tuple[chess.Move, ...] = ()
    nodes: int = 0
    adapted: int | None = None


@dataclass(frozen=True, slots=True)
class EngineChoice:
    """A move and the last thought behind it.

    Attributes:
        move: Legal; the null move when the engine gives up.
        resigns: The engine has said that it gives the game up.
        offers_draw: It has offered a draw with its move.
    """

    move: chess.Move
    thinking: Thinking = field(default_factory=Thinking)
    resigns: bool = False
    offers_draw: bool = False


OnThinking = Callable[[Thinking], None]


class Engine(Protocol):
    """A program that thinks. Async context manager; restarts itself when it dies or hangs."""

    name: str

    async def __aenter__(self) -> Self:
        """Start it.

        Raises:
            EngineError: not executable, not an engine of this protocol.
        """
        ...

    async def __aexit__(self, *exc: object) -> None:
        """End it; no process is left behind."""
        ...

    async def choose(
        self, board: chess.Board, *, seconds: float | None = None, on_thinking: OnThinking | None = None
    ) -> EngineChoice:
        """A legal move for ``board`` (its move stack is the game so far).

        Args:
            board: Not changed.
            seconds: Time for this move; None means the configured one.
            on_thinking: Called in the loop for each new thought.

        Raises:
            EngineError: no move within the allowed restarts; never taken for mate.
        """
        ...


# --- people ----------------------------------------------------------------------------------------------


class Person(Protocol):
    """Who answers when a hand other than the robot's is needed: the operator, or the twin's virtual person.

    Every request may come a second time after a restart, when the first one was cut off: what is already done
    is then left as it is.
    """

    async def carry(self, transfers: Sequence[Transfer]) -> None:
        """Make a move by hand; returns when it is made."""
        ...

    async def supply(self, piece: chess.Piece, place: Place, reason: str) -> None:
        """Bring a piece that the robot does not have and stand it on ``place``."""
        ...

    async def remove(self, piece: chess.Piece, place: Place, reason: str) -> None:
        """Take a piece that nobody needs away from ``place``, off the table."""
        ...

    async def put_right(self, request: str) -> None:
        """Do what the sentence says, where the table differs from the game."""
        ...

    async def is_holding(self, piece: chess.Piece) -> bool:
        """Look whether the closed gripper holds ``piece``."""
        ...


Options = Mapping[str, str | int | float | bool]
