"""What a page shows, as topics: each is one value that is replaced whole, so that only the newest counts.

A client gets a snapshot of the topics it may see, and after that every topic that changed. One that lags
skips values, never piles them up (`kempelen.server.hub`).
"""

from typing import Annotated, Literal

from pydantic import Field

from kempelen.server.model import Model
from kempelen.server.said import Said

Colour = Literal["white", "black"]
Point = tuple[float, float, float]
Square = Annotated[str, Field(pattern="^[a-h][1-8]$")]


class Fault(Model):
    """Something is wrong, and there is a button that mends it.

    Attributes:
        title: A few plain words.
        title_said: The same for other languages.
        text: What, where, and what to do.
        text_said: The same for other languages.
        remedy: Command that mends it; None where only a person can.
    """

    title: str
    title_said: tuple[Said, ...] = ()
    text: str
    text_said: tuple[Said, ...] = ()
    remedy: Literal["connect", "home", "recover", "resume", "resume_game", "leave_game"] | None = None


class StationView(Model):
    """The table and what is done with it.

    Attributes:
        phase: ``off``: no robot is connected; ``connecting``; ``ready``: connected, no game; ``starting`` a
            game; ``playing``; ``leaving`` it.
        busy: What takes a while at the moment, in plain words; empty for nothing.
        busy_said: The same for other languages.
        robot_kind: Name of the driver.
        port: The wire: "twin", a device, a socket.
        on_twin: Whether the machine is the simulated one.
        speed: The twin's time scale; 0 for as fast as it can.
        calibrated: Whether the board was measured; else the configured position counts.
        game: Number of the running game.
        again: Whether the game that is over can be played once more.
        faults: The gravest first.
    """

    phase: Literal["off", "connecting", "ready", "starting", "playing", "leaving"] = "off"
    busy: str = ""
    busy_said: tuple[Said, ...] = ()
    robot_kind: str = "gantry"
    port: str = "twin"
    on_twin: bool = True
    speed: float = 1.0
    calibrated: bool = False
    game: int | None = None
    again: bool = False
    faults: tuple[Fault, ...] = ()


class RobotView(Model):
    """The robot as it reports itself.

    Attributes:
        phase: As `kempelen.core.protocols.RobotPhase`.
        position: x, y, z, mm, robot frame, as reported; None before homing.
        gripper: ``open``, ``closed`` or ``unknown``.
        message: One plain sentence when something is wrong.
    """

    phase: str = "disconnected"
    homed: bool = False
    position: Point | None = None
    gripper: str = "unknown"
    message: str = ""


class SideView(Model):
    """Who plays one colour."""

    name: str
    kind: str


class MoveView(Model):
    """A half-move that counts.

    Attributes:
        fen: The position after it.
    """

    ply: int
    san: str
    uci: str
    fen: str


class ClockView(Model):
    """A chess clock. The robot's time counts for nobody.

    Attributes:
        white: Seconds left when it was last read.
        black: Seconds left.
        running: Whose time runs; None for nobody's.
        at: Server time of the reading, s since the epoch.
    """

    white: float
    black: float
    running: Colour | None
    at: float


class GameView(Model):
    """The game on the table.

    Attributes:
        number: In the journal.
        mode: ``play``, ``watch``, ``replay``.
        people: Colours that a person plays.
        moves: All of them.
        fen: The position now.
        turn: Who is to move.
        person_to_move: Whether a move of a person is waited for now.
        legal: UCI moves that the person may make; empty when none is waited for.
        check: Square of a king in check.
        captured: Pieces taken, by letter as in FEN, of each colour.
        paused: Whether the game is.
        in_transfer: Whether the robot rests in mid-transfer, perhaps with a piece in the gripper.
        draw_offer: Colour that offers a draw, when it waits for an answer.
        result: ``1-0`` …; empty while it goes on.
        reason: Of the result.
        length: Half-moves of the score that is being replayed.
        by_hand: Whether a person's moves are made on the board by hand, and seen.
    """

    number: int
    mode: Literal["play", "watch", "replay"]
    white: SideView
    black: SideView
    people: tuple[Colour, ...]
    start_fen: str
    fen: str
    moves: tuple[MoveView, ...]
    turn: Colour
    person_to_move: bool
    legal: tuple[str, ...]
    check: str | None
    captured: dict[Colour, str]
    paused: bool
    in_transfer: bool
    draw_offer: Colour | None
    result: str
    reason: str
    length: int | None
    clock: ClockView | None
    by_hand: bool


class ThinkingView(Model):
    """What the engine thinks; scores from White's side.

    Attributes:
        line: In SAN.
        adapted: Elo at which an engine that adapts to the other side has chosen; null for all others.
    """

    colour: Colour
    depth: int
    centipawns: int | None
    mate: int | None
    line: tuple[str, ...]
    nodes: int
    adapted: int | None = None


class ActivityView(Model):
    """What the robot is doing now: "carrying the knight to f3".

    Attributes:
        kind: ``approaching``, ``carrying``, ``leaving``, ``parking``, ``homing``, ``looking``, ``waiting``.
        piece: FEN letter of the piece it is about.
        source: Where it stands.
        target: Where it will.
        number: Of this transfer, from 1.
        count: Transfers of the move.
        ends_at: When it should be done, s since the epoch; None where that cannot be told.
    """

    kind: Literal["approaching", "carrying", "leaving", "parking", "homing", "looking", "waiting"]
    piece: str | None = None
    source: str | None = None
    target: str | None = None
    number: int = 0
    count: int = 0
    ends_at: float | None = None


class Candidate(Model):
    """A move that may have been made."""

    uci: str
    san: str


class PromptView(Model):
    """Something that a person is asked for, or told to do.

    Attributes:
        id: To answer it by.
        kind: ``do``: put something right and confirm; ``yes_no``; ``which_move``: choose a candidate;
            ``advice``: nothing to answer, it goes by itself; ``draw``: an offer to answer.
        text: In plain words.
        text_said: The same for other languages.
        square: To light up.
        piece: FEN letter.
        candidates: Of ``which_move``.
    """

    id: str
    kind: Literal["do", "yes_no", "which_move", "advice", "draw"]
    text: str
    text_said: tuple[Said, ...] = ()
    square: str | None = None
    piece: str | None = None
    candidates: tuple[Candidate, ...] = ()


class EyesView(Model):
    """How the board is seen.

    Attributes:
        there: Whether there is a camera at all.
        on: Whether it is played by.
        sight: As `kempelen.core.senses.Sight`.
        message: What is wrong and what to do.
        hand: Whether a hand is over the board.
        recording: File that is being recorded to, by name; empty for none.
    """

    there: bool = False
    on: bool = False
    sight: str = "no camera"
    message: str = ""
    hand: bool = False
    recording: str = ""


class SquaresView(Model):
    """One look of the eye.

    Attributes:
        fps: Observations a second.
        occupancy: 64 times the probabilities of empty, white, black; a1, b1, … h8.
        heights: 64 mm above the board; None where not measured.
        sight: As `kempelen.core.senses.Sight`, of this look: what passes at once is in no other topic.
        message: What is wrong and what to do.
    """

    fps: float
    occupancy: tuple[tuple[float, float, float], ...]
    heights: tuple[float | None, ...] | None
    sight: str = "clear"
    message: str = ""


class PieceView(Model):
    """A piece on the table, truly (twin) or as the journal has it.

    Attributes:
        id: Stays with it for a game.
        letter: As in FEN.
        at: Its foot, mm, robot frame.
        quaternion: w, x, y, z, from the piece's frame to the robot's.
    """

    id: int
    letter: str
    at: Point
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


class SceneView(Model):
    """Where everything is now.

    Attributes:
        tool: The tool point, mm, robot frame; None when unknown.
        closed: Whether the gripper is.
        hand: Where the virtual person's hand is; None when it is away.
        pieces: Only those that moved since the last one, in a delta; all of them in a snapshot.
        whole: Whether ``pieces`` holds all that there are: others are gone.
        table: Identifies what stands still: when it is another one, GET /api/scene has other geometry.
        joints: Angles of an arm's joints, rad; None for other robots, and while unknown.
    """

    tool: Point | None
    closed: bool
    hand: Point | None
    pieces: tuple[PieceView, ...]
    whole: bool = True
    table: str = ""
    joints: tuple[float, ...] | None = None


class CalibrationView(Model):
    """A calibration in the making.

    Attributes:
        active: Whether one is being made.
        touched: Corners so far, mm, robot frame.
        residuals: Of a fit through them, mm, by corner; empty with fewer than two.
        square: As fitted, mm.
        problem: Why it cannot be used as it is; empty when it can.
        fits: Sentences of the fit check: what does not fit, and by how much.
    """

    active: bool = False
    touched: dict[str, Point] = Field(default_factory=dict)
    residuals: dict[str, float] = Field(default_factory=dict)
    square: float | None = None
    problem: str = ""
    fits: tuple[str, ...] = ()


TopicName = Literal[
    "station", "robot", "game", "thinking", "activity", "prompts", "eyes", "squares", "scene", "calibration",
    "clients",
]  # fmt: skip


class ClientsView(Model):
    """Who is connected."""

    operators: int = 0
    players: int = 0
    spectators: int = 0


class Topics(Model):
    """All topics; those that a client does not follow, or may not see, are None."""

    station: StationView | None = None
    robot: RobotView | None = None
    game: GameView | None = None
    thinking: ThinkingView | None = None
    activity: ActivityView | None = None
    prompts: tuple[PromptView, ...] | None = None
    eyes: EyesView | None = None
    squares: SquaresView | None = None
    scene: SceneView | None = None
    calibration: CalibrationView | None = None
    clients: ClientsView | None = None
