"""What a client may ask for: one model per command, told apart by ``name``.

Every request carries an ``id`` that its client made up: the same one again gets the first one's answer, and
nothing is done twice.
"""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from kempelen.server.model import Model
from kempelen.server.said import Said
from kempelen.server.topics import Colour

Role = Literal["operator", "player", "spectator"]
Uci = Annotated[str, Field(pattern="^[a-h][1-8][a-h][1-8][qrbn]?$")]
Coordinate = Annotated[float, Field(ge=-5000, le=5000)]
Text = Annotated[str, Field(max_length=300)]
Pgn = Annotated[str, Field(max_length=2_000_000)]


class Command(Model):
    """What all have.

    Attributes:
        id: Made up by the client, unique: the same again is answered with the first one's answer.
    """

    needs: ClassVar[Role] = "operator"
    id: Annotated[str, Field(min_length=8, max_length=64, pattern="^[A-Za-z0-9_-]+$")]


class Connect(Command):
    """Connect a robot."""

    name: Literal["connect"]
    kind: Annotated[str, Field(min_length=1, max_length=60)] = "gantry"
    port: Annotated[str, Field(min_length=1, max_length=300)] = "twin"


class Disconnect(Command):
    """Let go of it."""

    name: Literal["disconnect"]


class Home(Command):
    """Find the reference switches."""

    name: Literal["home"]


class Recover(Command):
    """Clear an alarm or a stop; homing follows."""

    name: Literal["recover"]


class EStop(Command):
    """End all motion now."""

    needs: ClassVar[Role] = "player"
    name: Literal["estop"]


class Jog(Command):
    """Keep moving; motion ends when these stop coming, or their client goes away. WebSocket only."""

    name: Literal["jog"]
    direction: tuple[
        Annotated[float, Field(ge=-1, le=1)],
        Annotated[float, Field(ge=-1, le=1)],
        Annotated[float, Field(ge=-1, le=1)],
    ]
    speed: Annotated[float, Field(gt=0, le=500)]


class JogStop(Command):
    """End jogging."""

    name: Literal["jog_stop"]


class CalibrationBegin(Command):
    """Measure the board anew; a running game is paused, its move finished first."""

    name: Literal["calibration_begin"]


class Touch(Command):
    """The closed fingertips are at this outer corner now."""

    name: Literal["touch"]
    corner: Literal["a1", "h1", "h8", "a8"]


class CalibrationByCamera(Command):
    """Find the board by the camera whose place over the robot is known."""

    name: Literal["calibration_by_camera"]


class CalibrationApply(Command):
    """Keep what was touched, and use it from now on.

    Attributes:
        square: Side of a square, mm, where it is known.
    """

    name: Literal["calibration_apply"]
    square: Annotated[float, Field(ge=10, le=120)] | None = None


class CalibrationCancel(Command):
    """Keep the one before."""

    name: Literal["calibration_cancel"]


class Clock(Model):
    """Time control: ``minutes`` for the game, ``increment`` s a move."""

    minutes: Annotated[float, Field(gt=0, le=600)]
    increment: Annotated[float, Field(ge=0, le=180)] = 0.0


class NewGame(Command):
    """Begin a game.

    Attributes:
        side: The person's colour in ``play``, and after a take-over.
        level: "1" to "20", an Elo, "maia-1500", "full".
        pgn: What ``replay`` plays.
        pgn_game: Which game of it, from 1.
        take_over: Number of the move at which the person takes the replay over.
        hands: Who carries a person's pieces; "auto": the person, where a camera looks.
        set_up: Whether the robot first sets up the position, from where the last game left the pieces.
    """

    name: Literal["new_game"]
    mode: Literal["play", "watch", "replay"]
    fen: Annotated[str, Field(max_length=120)] = ""
    side: Colour = "white"
    engine: Annotated[str, Field(max_length=1000)] = ""
    level: Annotated[str, Field(min_length=1, max_length=20)] = "full"
    move_time: Annotated[float, Field(ge=0.01, le=600)] = 1.0
    opponent: Annotated[str, Field(max_length=1000)] = ""
    opponent_level: Annotated[str, Field(max_length=20)] = ""
    pgn: Pgn = ""
    pgn_game: Annotated[int, Field(ge=1, le=100_000)] = 1
    take_over: Annotated[int, Field(ge=1, le=10_000)] | None = None
    clock: Clock | None = None
    hands: Literal["auto", "robot", "person"] = "auto"
    set_up: bool = False


class SetUp(Command):
    """Let the robot set up a position, from wherever the pieces stand.

    Attributes:
        fen: The position wanted; empty for the beginning of a game.
        standing: Where the pieces are now: as the ``last`` game left them, or that of this number, or a FEN.
    """

    name: Literal["set_up"]
    fen: Annotated[str, Field(max_length=120)] = ""
    standing: Annotated[str, Field(min_length=1, max_length=120)] = "last"


class Rematch(Command):
    """The game that is over once more: same players, engines and clock.

    Attributes:
        swapped: Whether the person has the other colour now.
    """

    name: Literal["rematch"]
    swapped: bool = False


class ResumeGame(Command):
    """Go on with a game of the journal; the newest unfinished one when none is named."""

    name: Literal["resume_game"]
    game: Annotated[int, Field(ge=1)] | None = None


class LeaveGame(Command):
    """Robot at rest, game kept."""

    name: Literal["leave_game"]


class SwapMode(Command):
    """Other players take over, from this move on."""

    name: Literal["swap_mode"]
    mode: Literal["play", "watch", "replay"]
    side: Colour | None = None
    pgn: Pgn = ""
    pgn_game: Annotated[int, Field(ge=1, le=100_000)] = 1


class Pause(Command):
    """Stop at once, a piece in the gripper or not."""

    needs: ClassVar[Role] = "player"
    name: Literal["pause"]


class Resume(Command):
    """Go on."""

    needs: ClassVar[Role] = "player"
    name: Literal["resume"]


class Finish(Command):
    """While paused: complete the move in hand."""

    needs: ClassVar[Role] = "player"
    name: Literal["finish"]


class Takeback(Command):
    """Undo half-moves on the table; None: to where a person was last to move."""

    needs: ClassVar[Role] = "player"
    name: Literal["takeback"]
    plies: Annotated[int, Field(ge=1, le=2000)] | None = None


class Resign(Command):
    """The person's side gives up; in a game of two persons, the side to move."""

    needs: ClassVar[Role] = "player"
    name: Literal["resign"]


class OfferDraw(Command):
    """The person's side offers a draw."""

    needs: ClassVar[Role] = "player"
    name: Literal["draw"]


class Move(Command):
    """A move of the person's side. On the twin with a camera the virtual hand makes it on the board.

    Attributes:
        ply: Half-moves played when it was chosen: a stale one is refused.
    """

    needs: ClassVar[Role] = "player"
    name: Literal["move"]
    uci: Uci
    ply: Annotated[int, Field(ge=0)] | None = None


class HandCarry(Command):
    """Twin: the virtual hand carries a piece from one point of the table to another, legal or not.

    Attributes:
        source: x, y, mm, robot frame; the piece nearest to it is taken.
        target: x, y, mm.
    """

    needs: ClassVar[Role] = "player"
    name: Literal["hand_carry"]
    source: tuple[Coordinate, Coordinate]
    target: tuple[Coordinate, Coordinate]


class Answer(Command):
    """Answer a prompt.

    Attributes:
        prompt: Its id.
        text: "yes", "no", "done", or a move in UCI.
    """

    needs: ClassVar[Role] = "player"
    name: Literal["answer"]
    prompt: Annotated[str, Field(max_length=64)]
    text: Text = "done"


class SetSpeed(Command):
    """Twin: time scale; 0 for as fast as it can."""

    name: Literal["speed"]
    speed: Annotated[float, Field(ge=0, le=1000)]


class SetEyes(Command):
    """Play by the camera, or without."""

    name: Literal["eyes"]
    on: bool


class SetEyeParameter(Command):
    """Override a parameter of the reader; None: what the reader takes by itself."""

    name: Literal["eye_parameter"]
    parameter: Annotated[str, Field(max_length=60)]
    value: float | None


class Record(Command):
    """Begin or end recording what the camera sees."""

    name: Literal["record"]
    on: bool


class Bumped(Command):
    """The board was moved: measure it by camera."""

    name: Literal["bumped"]


AnyCommand = Annotated[
    Connect | Disconnect | Home | Recover | EStop | Jog | JogStop
    | CalibrationBegin | Touch | CalibrationByCamera | CalibrationApply | CalibrationCancel
    | NewGame | SetUp | Rematch | ResumeGame | LeaveGame | SwapMode
    | Pause | Resume | Finish | Takeback | Resign | OfferDraw | Move | HandCarry | Answer
    | SetSpeed | SetEyes | SetEyeParameter | Record | Bumped,
    Field(discriminator="name"),
]  # fmt: skip


class Reply(Model):
    """What became of a command.

    Attributes:
        error: Why it was refused or failed; empty when done.
        hint: What to do next.
        kind: Of the error: ``game``, ``config``, ``link`` …, as `kempelen.core.errors` tells them apart.
        error_said: For other languages; empty where there is nothing but English.
        hint_said: Likewise.
    """

    id: str
    ok: bool
    error: str = ""
    hint: str = ""
    kind: str = ""
    error_said: tuple[Said, ...] = ()
    hint_said: tuple[Said, ...] = ()
    result: dict[str, Any] = Field(default_factory=dict)
