"""The facts that the journal holds, one class for each kind.

A record is written before the world is touched (an intent) or after the world has answered (a step, a
commit). All records of a game, applied in order (`kempelen.game.state`), give the game: position, layout, the
move in hand and how far it has come. A kind's fields may grow defaults, never change meaning: old journals
must stay readable.
"""

from enum import StrEnum
from typing import Annotated, Any, Literal

import chess
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    JsonValue,
    PlainSerializer,
    TypeAdapter,
    ValidationError,
)

from kempelen.core.errors import JournalError, KempelenError
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import Checkpoint
from kempelen.game.transfers import Crowded, Missing, Request


def _piece(text: Any) -> Any:
    return chess.Piece.from_symbol(text) if isinstance(text, str) else text


def _place(text: Any) -> Any:
    return _unless_bad(Place.parse, text) if isinstance(text, str) else text


def _unless_bad(parse: Any, text: str) -> Any:
    try:
        return parse(text)
    except KempelenError as error:  # pydantic collects ValueErrors only
        raise ValueError(str(error)) from error


def _transfer(text: Any) -> Any:
    if not isinstance(text, str):
        return text
    symbol, source, target = text.split(" ")
    return Transfer(_piece(symbol), _place(source), _place(target))


def _layout(pieces: Any) -> Any:
    if isinstance(pieces, Layout):
        return pieces
    return Layout({_place(place): _piece(symbol) for place, symbol in dict(pieces).items()})


PieceField = Annotated[chess.Piece, BeforeValidator(_piece), PlainSerializer(lambda piece: piece.symbol())]
PlaceField = Annotated[Place, BeforeValidator(_place), PlainSerializer(str)]
TransferField = Annotated[
    Transfer,
    BeforeValidator(_transfer),
    PlainSerializer(lambda t: f"{t.piece.symbol()} {t.source} {t.target}"),
]
LayoutField = Annotated[
    Layout,
    BeforeValidator(_layout),
    PlainSerializer(lambda layout: {str(place): piece.symbol() for place, piece in sorted(layout.items())}),
]


class Purpose(StrEnum):
    """What a group of transfers does to the game."""

    MOVE = "move"
    TAKEBACK = "takeback"
    SETUP = "setup"  # the position that the game begins with, from wherever the pieces stand


class _Fact(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)


class PlayerSpec(_Fact):
    """Enough to set up a player again: its kind, the name shown, and what that kind needs."""

    kind: str
    name: str
    details: dict[str, JsonValue] = Field(default_factory=dict)


class PairingSpec(_Fact):
    """A mode and the players of both sides."""

    mode: str
    white: PlayerSpec
    black: PlayerSpec


class TakeOverSpec(_Fact):
    """Another pairing that takes over when the game has reached a ply.

    Attributes:
        ply: Of the position (`chess.Board.ply`): 0 before White's first move, 38 before White's 20th.
    """

    ply: Annotated[int, Field(ge=0)]
    pairing: PairingSpec


class ClockSpec(_Fact):
    """Time control: s for the game, and s for each move."""

    seconds: float
    increment: float = 0.0


class Begun(_Fact):
    """A game begins.

    Attributes:
        headers: PGN tags known from the start.
        table: Digest of the table and its calibration.
        robot: Kind of robot; empty in journals older than the second kind.
        layout: Where every piece stands, spares included; where the board is not as ``start_fen`` has it,
            the robot sets that up first.
        clock: None: the game is played without one.
    """

    kind: Literal["begun"] = "begun"
    headers: dict[str, str]
    start_fen: str = chess.STARTING_FEN
    chess960: bool = False
    pairing: PairingSpec
    take_over: TakeOverSpec | None = None
    hands: Literal["robot", "person"] = "robot"
    table: str = ""
    robot: str = ""
    layout: LayoutField
    clock: ClockSpec | None = None


class Reopened(_Fact):
    """A program goes on with the game after an exit."""

    kind: Literal["reopened"] = "reopened"
    program: str = ""


class OperatorNeeded(_Fact):
    """A decided move, or takeback, waits for the operator; nothing was carried yet."""

    kind: Literal["operator-needed"] = "operator-needed"
    purpose: Purpose
    ply: int
    uci: str
    need: Literal["supply", "remove"]
    piece: PieceField
    place: PlaceField

    @property
    def request(self) -> Request:
        """What the operator has to do."""
        return (Missing if self.need == "supply" else Crowded)(self.piece, self.place)


class LayoutChanged(_Fact):
    """The operator stood a piece on a place, or took it away.

    Attributes:
        piece: What stands there from now on; None: nothing.
    """

    kind: Literal["layout-changed"] = "layout-changed"
    place: PlaceField
    piece: PieceField | None = None
    reason: str = ""


class Intended(_Fact):
    """A move, or its taking back, is about to be made on the table.

    Attributes:
        ply: Of the move, from 1; 0 when the position is set up.
        uci: Empty when the position is set up.
        by_hand: A person's hand makes it.
    """

    kind: Literal["intended"] = "intended"
    purpose: Purpose
    ply: int
    uci: str
    transfers: tuple[TransferField, ...]
    by_hand: bool = False


class Step(_Fact):
    """A transfer of the move in hand has come to a checkpoint.

    Attributes:
        index: Of the transfer in the intent, from 0.
    """

    kind: Literal["step"] = "step"
    index: int
    checkpoint: Checkpoint


class Missed(_Fact):
    """A transfer that was thought done had not happened: its piece was seen where it came from.

    Attributes:
        index: Of the transfer, from 0; it is the next one to be made.
    """

    kind: Literal["missed"] = "missed"
    index: int


class HandEmpty(_Fact):
    """The hand holds nothing and is around no piece: it was parked, or somebody looked."""

    kind: Literal["hand-empty"] = "hand-empty"


class Interrupted(_Fact):
    """The robot's motion is being cut off; its gripper may no longer be as the last step says."""

    kind: Literal["interrupted"] = "interrupted"
    why: str = ""


class Committed(_Fact):
    """The move in hand, or its taking back, is part of the game now."""

    kind: Literal["committed"] = "committed"
    purpose: Purpose
    ply: int
    uci: str
    san: str


class Helped(_Fact):
    """A person had to do, or to see, what the robot could not: an intervention."""

    kind: Literal["helped"] = "helped"
    how: str = ""


class TakebackAsked(_Fact):
    """Half-moves shall be taken back until only ``plies`` are left.

    Attributes:
        by_hand: A person has taken them back on the board already.
    """

    kind: Literal["takeback-asked"] = "takeback-asked"
    plies: int
    by_hand: bool = False


class Paused(_Fact):
    """The robot rests and the game waits."""

    kind: Literal["paused"] = "paused"


class Resumed(_Fact):
    """The game goes on."""

    kind: Literal["resumed"] = "resumed"


class Clocked(_Fact):
    """What the chess clock shows, s."""

    kind: Literal["clocked"] = "clocked"
    white: float
    black: float


class ModeSwapped(_Fact):
    """Other players take over; everything played so far is kept."""

    kind: Literal["mode-swapped"] = "mode-swapped"
    pairing: PairingSpec
    take_over: TakeOverSpec | None = None


class TableChanged(_Fact):
    """The table was measured again; the game is kept."""

    kind: Literal["table-changed"] = "table-changed"
    table: str


Result = Literal["1-0", "0-1", "1/2-1/2", "*"]
RESULTS: tuple[Result, ...] = ("1-0", "0-1", "1/2-1/2", "*")


class Ended(_Fact):
    """The game is over."""

    kind: Literal["ended"] = "ended"
    result: Result
    reason: str


Record = (
    Begun
    | Reopened
    | OperatorNeeded
    | LayoutChanged
    | Intended
    | Step
    | Missed
    | HandEmpty
    | Interrupted
    | Helped
    | Committed
    | TakebackAsked
    | Paused
    | Resumed
    | Clocked
    | ModeSwapped
    | TableChanged
    | Ended
)

_RECORD: TypeAdapter[Record] = TypeAdapter(Annotated[Record, Field(discriminator="kind")])


def to_json(record: Record) -> str:
    """One line of JSON."""
    return record.model_dump_json()


def from_json(text: str) -> Record:
    """Read what `to_json` wrote.

    Raises:
        JournalError: It is no record of this version.
    """
    try:
        return _RECORD.validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise JournalError(
            f"A record cannot be read: {where}: {first['msg']}; it says {text[:120]}.",
            hint="The journal is damaged or was written by another version of the program.",
        ) from error
