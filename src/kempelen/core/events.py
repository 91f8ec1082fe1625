"""What the arbiter tells its observers, as it happens.

Events are for eyes only: live boards, logs, reports. Nothing in the game depends on who listens; what must
last is in the journal. Each is frozen and complete in itself, so that an observer that missed some can go on.
"""

from dataclasses import dataclass

import chess

from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import Checkpoint, RobotState, Thinking, TransferReport
from kempelen.core.senses import Sight


@dataclass(frozen=True, slots=True)
class GameStarted:
    """A game begins, or goes on after an exit.

    Attributes:
        game: Its number in the journal.
        plies: Half-moves played so far.
        resumed: Whether it went on from the journal.
    """

    game: int
    mode: str
    white: str
    black: str
    fen: str
    layout: Layout
    plies: int = 0
    resumed: bool = False


@dataclass(frozen=True, slots=True)
class TurnBegan:
    """A player is asked for a move."""

    colour: chess.Color
    player: str
    fen: str


@dataclass(frozen=True, slots=True)
class EngineThinking:
    """A new thought of the engine whose turn it is."""

    colour: chess.Color
    thinking: Thinking


@dataclass(frozen=True, slots=True)
class MoveProposed:
    """A legal move was chosen; the robot or a hand makes it now, or undoes it.

    Attributes:
        number: Of the full move, as on the score sheet; 0 where it is not known.
        takeback: Whether the move is being undone.
    """

    ply: int
    colour: chess.Color
    san: str
    uci: str
    transfers: tuple[Transfer, ...]
    by_hand: bool = False
    number: int = 0
    takeback: bool = False


@dataclass(frozen=True, slots=True)
class SettingUp:
    """The robot brings the pieces to where the game begins."""

    transfers: tuple[Transfer, ...]
    fen: str


@dataclass(frozen=True, slots=True)
class PositionSetUp:
    """The pieces stand where the game begins."""

    fen: str
    layout: Layout


@dataclass(frozen=True, slots=True)
class TransferStarted:
    """The hand sets out for one piece.

    Attributes:
        number: From 1, of ``count`` transfers of this move.
    """

    transfer: Transfer
    number: int
    count: int


@dataclass(frozen=True, slots=True)
class CheckpointReached:
    """The transfer at hand has come this far, and the journal knows it."""

    transfer: Transfer
    checkpoint: Checkpoint


@dataclass(frozen=True, slots=True)
class TransferDone:
    """The piece stands on its target and the gripper has let go of it.

    Attributes:
        report: Times; None when the hand could not measure them (recovery, a person's hand).
    """

    transfer: Transfer
    layout: Layout
    report: TransferReport | None = None


@dataclass(frozen=True, slots=True)
class MoveCommitted:
    """A move is part of the game."""

    ply: int
    colour: chess.Color
    san: str
    uci: str
    fen: str
    layout: Layout


@dataclass(frozen=True, slots=True)
class MoveTakenBack:
    """A half-move was undone, on the table too."""

    ply: int
    san: str
    fen: str
    layout: Layout


@dataclass(frozen=True, slots=True)
class Paused:
    """The robot is at rest and the game waits.

    Attributes:
        in_transfer: Whether it rests in mid-transfer.
    """

    in_transfer: bool = False


@dataclass(frozen=True, slots=True)
class Resumed:
    """The game goes on."""


@dataclass(frozen=True, slots=True)
class ModeSwapped:
    """Other players took over; everything played so far is kept."""

    mode: str
    white: str
    black: str


@dataclass(frozen=True, slots=True)
class RobotChanged:
    """The robot's state as the arbiter saw it last."""

    state: RobotState


@dataclass(frozen=True, slots=True)
class OperatorAsked:
    """Only a person can go on from here; the game waits.

    Attributes:
        text: What to do, in plain words.
        piece: The piece it is about, if it is about one.
        place: Where it belongs.
    """

    text: str
    piece: chess.Piece | None = None
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class OperatorAnswered:
    """The operator has done what the last `OperatorAsked` wanted."""

    text: str


@dataclass(frozen=True, slots=True)
class SensorChanged:
    """The board sensor sees the board again, or no more.

    Attributes:
        message: What is wrong and what to do; empty when all is well.
    """

    sight: Sight
    message: str = ""


@dataclass(frozen=True, slots=True)
class HandOverBoard:
    """A hand came over the board, or left: while it is there the robot does not set out."""

    over: bool


@dataclass(frozen=True, slots=True)
class SensorUnsure:
    """The board was changed, and more than one move would explain it; typing one of them settles it.

    Attributes:
        question: In plain words; empty when it has settled itself.
        candidates: In UCI, the likeliest first.
    """

    question: str
    candidates: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class BoardDiffers:
    """What stands on the board is no position that the game could have.

    Attributes:
        advice: What to put where; empty when the board is right again.
        piece: That is missed, if one is.
        place: Where it belongs.
    """

    advice: str
    piece: chess.Piece | None = None
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class DrawOffered:
    """A side offers a draw; its opponent is asked."""

    colour: chess.Color


@dataclass(frozen=True, slots=True)
class DrawDeclined:
    """The offer of ``colour`` was declined, or lapsed with the next move."""

    colour: chess.Color


@dataclass(frozen=True, slots=True)
class ClockChanged:
    """The chess clock was started, stopped or set.

    Attributes:
        white: Left, s.
        black: Left, s.
        running: Whose time runs from now on; None for nobody's.
    """

    white: float
    black: float
    running: chess.Color | None


@dataclass(frozen=True, slots=True)
class GameOver:
    """The end.

    Attributes:
        result: ``1-0``, ``0-1``, ``1/2-1/2``, or ``*`` when a replayed score ends without one.
        reason: In plain words: ``checkmate``, ``threefold repetition``, ``score ends``.
    """

    result: str
    reason: str


Event = (
    GameStarted
    | TurnBegan
    | EngineThinking
    | MoveProposed
    | SettingUp
    | PositionSetUp
    | TransferStarted
    | CheckpointReached
    | TransferDone
    | MoveCommitted
    | MoveTakenBack
    | Paused
    | Resumed
    | ModeSwapped
    | RobotChanged
    | OperatorAsked
    | OperatorAnswered
    | SensorChanged
    | HandOverBoard
    | SensorUnsure
    | BoardDiffers
    | DrawOffered
    | DrawDeclined
    | ClockChanged
    | GameOver
)
