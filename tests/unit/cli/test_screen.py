"""The picture: events in, lines out."""

import io
from dataclasses import dataclass, field

import chess
import pytest
from rich.console import Console

from kempelen.cli.board import Look, board_picture
from kempelen.cli.score import captured, move_log
from kempelen.cli.screen import MESSAGE_ROWS, GameScreen, rows
from kempelen.core import events
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import Checkpoint, GripperState, RobotPhase, RobotState, Thinking
from kempelen.core.table import Table, start_layout

TABLE = Table()
LETTERS = Look(colours=False, glyphs=False)
PAWN = chess.Piece.from_symbol("P")
E4 = Transfer(PAWN, Place("e2"), Place("e4"))


@dataclass
class Game:
    """What a running game would tell."""

    board: chess.Board = field(default_factory=chess.Board)
    robot: RobotState = field(
        default_factory=lambda: RobotState(
            RobotPhase.MOVING, homed=True, reported_position=(1.0, 22.5, 200.0), gripper=GripperState.CLOSED
        )
    )
    length: int | None = None
    seconds_left: float | None = None


def layout_of(board: chess.Board) -> Layout:
    return start_layout(TABLE, board)


def begun(game: Game, look: Look = LETTERS) -> GameScreen:
    screen = GameScreen(game, look)
    screen.note(
        events.GameStarted(4, "play", "Ada", "Engine", game.board.fen(), layout_of(game.board), resumed=False)
    )
    return screen


def drawn(screen: GameScreen, width: int = 79) -> str:
    out = io.StringIO()
    console = Console(file=out, width=width, color_system=None, force_terminal=True)
    console.print(screen.picture(width), end="")
    return out.getvalue()


def propose(san: str, game: Game) -> events.MoveProposed:
    move = game.board.parse_san(san)
    return events.MoveProposed(len(game.board.move_stack) + 1, game.board.turn, san, move.uci(), (E4,))


def test_every_part_stands_in_the_picture() -> None:
    game = Game(length=46, seconds_left=1.24)
    screen = begun(game)
    screen.note(events.TurnBegan(chess.WHITE, "Ada", game.board.fen()))
    line = tuple(map(chess.Move.from_uci, ("e2e4", "e7e5", "g1f3")))
    screen.note(events.EngineThinking(chess.WHITE, Thinking(depth=12, centipawns=35, line=line)))
    screen.note(propose("e4", game))
    screen.note(events.CheckpointReached(E4, Checkpoint.CARRYING))
    picture = drawn(screen)
    for part in (
        "Game 4: Ada against Engine",
        "moving   x   1.0  y  22.5  z 200.0 mm",
        "holds the white pawn",
        "carrying the pawn to e4, 1.2 s left",
        "1. e4  ------------ 0 of 46",
        "depth 12, +0.35, e4 e5 Nf3",
    ):
        assert part in picture, picture


def test_a_held_piece_is_on_no_square_and_a_carried_one_on_its_target() -> None:
    game = Game()
    screen = begun(game)
    assert "2  P  P  P  P  P  P  P  P" in drawn(screen)
    screen.note(propose("e4", game))
    screen.note(events.CheckpointReached(E4, Checkpoint.CARRYING))
    assert "2  P  P  P  P [.] P  P  P" in drawn(screen)
    assert "4  .  .  .  . [.] .  .  ." in drawn(screen)
    screen.note(events.TransferDone(E4, layout_of(game.board).after(E4)))
    assert "4  .  .  .  . [P] .  .  ." in drawn(screen)


def test_the_move_log_grows_and_the_last_move_is_marked() -> None:
    game = Game()
    screen = begun(game)
    for san in ("e4", "e5", "Nf3"):
        colour = game.board.turn
        game.board.push_san(san)
        fen, layout = game.board.fen(), layout_of(game.board)
        screen.note(events.MoveCommitted(len(game.board.move_stack), colour, san, "", fen, layout))
    picture = drawn(screen, 110)
    assert "1. e4       e5" in picture
    assert "2. Nf3" in picture
    assert "3  .  .  .  .  . [N] .  ." in picture
    game.board.pop()
    screen.note(events.MoveTakenBack(3, "Nf3", game.board.fen(), layout_of(game.board)))
    assert "Taken back: Nf3" in drawn(screen)
    assert "2. Nf3" not in drawn(screen, 110)


def test_taking_back_is_told_apart_from_making() -> None:
    game = Game()
    game.board.push_san("e4")
    screen = begun(game)
    screen.note(events.MoveProposed(1, chess.WHITE, "e4", "e2e4", (E4,)))
    assert "taking back 1. e4" in drawn(screen)


def test_what_was_taken_and_who_took_over() -> None:
    game = Game()
    for san in ("e4", "d5", "exd5", "Qxd5", "Nc3", "Qxg2", "Bxg2"):
        game.board.push_san(san)
    screen = begun(game)
    assert "White's PP   Black's qp" in drawn(screen)
    screen.note(events.ModeSwapped("watch", "Deep", "Blue"))
    assert "Game 4: Deep against Blue" in drawn(screen)
    assert "Mode watch: Deep against Blue." in drawn(screen)


def test_a_pause_stands_out_until_it_ends() -> None:
    screen = begun(Game())
    screen.note(events.Paused(in_transfer=True))
    assert "paused in mid-transfer" in drawn(screen)
    screen.note(events.Resumed())
    assert "paused" not in drawn(screen)


def test_messages_are_wrapped_and_the_oldest_go() -> None:
    screen = begun(Game())
    for number in range(9):
        screen.say(f"message {number} " + "word " * 20)
    lines = [line for line in drawn(screen).splitlines() if "word" in line or "message" in line]
    assert len(lines) == MESSAGE_ROWS
    assert "message 8" in "".join(lines)
    assert "message 0" not in "".join(lines)


def test_what_was_read_goes_but_not_by_itself() -> None:
    game = Game()
    screen = begun(game)
    screen.say("Move the white pawn from e2 to e4")
    screen.note(propose("e4", game))
    assert "Move the white pawn" in drawn(screen)
    screen.hush()
    assert "Move the white pawn" not in drawn(screen)


def test_a_resumed_game_says_so_and_a_faulty_robot_too() -> None:
    game = Game()
    screen = GameScreen(game, LETTERS)
    fen = game.board.fen()
    screen.note(events.GameStarted(2, "play", "A", "B", fen, layout_of(game.board), plies=6, resumed=True))
    screen.note(events.RobotChanged(RobotState(message="The limit switch of x is pressed.")))
    assert "goes on after 6 half-moves" in drawn(screen)
    assert "Robot: The limit switch of x is pressed." in drawn(screen)


def test_a_robot_that_does_not_know_where_it_is() -> None:
    screen = begun(Game(robot=RobotState(RobotPhase.LOCKED)))
    assert "robot    locked" in drawn(screen)
    assert "unknown" in drawn(screen)


@pytest.mark.parametrize("width", [39, 50, 63, 64, 79, 105, 106, 150])
def test_the_picture_never_outgrows_its_height_and_width(width: int) -> None:
    game = Game(length=300, seconds_left=12.0)
    screen = begun(game)
    for _ in range(6):
        screen.say("a long message " * 10)
    screen.note(
        events.EngineThinking(chess.WHITE, Thinking(depth=30, line=(chess.Move.from_uci("e2e4"),) * 1))
    )
    game.board.push_san("e4")
    lines = drawn(screen, width).split("\n")
    assert len(lines) <= rows(width) + 1
    assert max(map(len, lines)) <= width


def test_a_board_for_black_and_one_in_colours() -> None:
    board = chess.Board()
    flipped = board_picture(board.piece_map(), flipped=True, look=LETTERS).plain.splitlines()
    assert flipped[0] == "1  R  N  B  K  Q  B  N  R "
    assert flipped[-1].split() == list("hgfedcba")
    coloured = board_picture(board.piece_map(), (chess.E2,))
    assert "♛" in coloured.plain
    assert "[" not in coloured.plain
    marked = [span.style for span in coloured.spans if "#a3a95a" in str(span.style)]
    assert len(marked) == 1  # e2 is a light square


@pytest.mark.parametrize(
    ("options", "colours", "glyphs"),
    [
        ({"color_system": "truecolor"}, True, True),
        ({"color_system": "256"}, True, True),
        ({"color_system": "standard"}, False, False),
        ({"color_system": None}, False, False),
        ({"color_system": "truecolor", "no_color": True}, False, False),
    ],
)
def test_what_a_terminal_can_show(options: dict[str, str | bool], colours: bool, glyphs: bool) -> None:
    console = Console(file=io.StringIO(), force_terminal=True, **options)  # type: ignore[arg-type]
    assert Look.of(console) == Look(colours=colours, glyphs=glyphs)


def test_the_log_of_a_game_that_black_began() -> None:
    board = chess.Board("7k/8/8/8/8/8/R7/K7 b - - 3 20")
    for san in ("Kg7", "Ra7+", "Kf6"):
        board.push_san(san)
    assert move_log(board) == [" 20. …        Kg7", " 21. Ra7+     Kf6"]
    assert move_log(chess.Board()) == []


def test_a_pawn_taken_in_passing_counts() -> None:
    board = chess.Board()
    for san in ("e4", "a6", "e5", "d5", "exd6"):
        board.push_san(san)
    assert captured(board) == ([], [chess.Piece.from_symbol("p")])
