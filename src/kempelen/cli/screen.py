"""What the live picture shows: events go in, a picture for a given width comes out. No terminal in here."""

import textwrap
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import chess
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from kempelen.app.narrate import colour_name, move_number, sentence, thinking_text
from kempelen.cli.board import HEIGHT, WIDTH, Look, board_picture, piece_sign
from kempelen.cli.score import captured, move_log
from kempelen.core import events
from kempelen.core.pieces import piece_name
from kempelen.core.places import Transfer
from kempelen.core.protocols import Checkpoint, GripperState, RobotState

STATUS_ROWS = 4
BACKGROUND_ROWS = 2
MESSAGE_ROWS = 4
NARROW = 64  # columns below which the status stands under the board
_WIDE = 106  # columns from which the moves have a column of their own
_GAP = 3
_LOG_WIDTH = 24
_BAR = 12


def rows(width: int) -> int:
    """Height of the picture."""
    return 1 + HEIGHT + BACKGROUND_ROWS + MESSAGE_ROWS + (STATUS_ROWS if width < NARROW else 0)


class Watched(Protocol):
    """What the picture asks of a running game."""

    @property
    def board(self) -> chess.Board:
        """The committed moves."""
        ...

    @property
    def robot(self) -> RobotState:
        """The robot's latest state."""
        ...

    @property
    def length(self) -> int | None:
        """Half-moves of the score that is being replayed; None in other modes."""
        ...

    @property
    def seconds_left(self) -> float | None:
        """Until the motion at hand should end, s; None when nothing moves or nobody knows."""
        ...


@dataclass
class GameScreen:
    """The picture's state.

    Args:
        game: Asked for what changes without an event.
        look: What the terminal can show.
        flipped: Whether Black sits at the bottom.
    """

    game: Watched
    look: Look = field(default_factory=Look)
    flipped: bool = False
    title: str = ""
    doing: str = ""
    thought: str = ""
    messages: list[str] = field(default_factory=list)
    _pieces: dict[chess.Square, chess.Piece] = field(default_factory=dict)
    _held: Transfer | None = None
    _marked: tuple[chess.Square, ...] = ()
    _position: chess.Board = field(default_factory=chess.Board)
    _log: list[str] = field(default_factory=list)
    _captured: tuple[list[chess.Piece], list[chess.Piece]] = field(default_factory=lambda: ([], []))
    _number: int = 0
    _move: str = ""
    _paused: str = ""

    # --- events in ----------------------------------------------------------------------------------------

    def say(self, text: str) -> None:
        """A line for the person."""
        self.messages = [*self.messages, text][-MESSAGE_ROWS:]

    def hush(self) -> None:
        """What was said has been read."""
        self.messages = []

    def note(self, event: events.Event) -> None:
        """Take in what happened."""
        takers: dict[type, Callable[[Any], None]] = {
            events.GameStarted: self._begin,
            events.ModeSwapped: self._swap,
            events.TurnBegan: self._turn,
            events.EngineThinking: self._think,
            events.MoveProposed: self._propose,
            events.CheckpointReached: self._reach,
            events.TransferDone: self._transferred,
            events.MoveCommitted: self._settle,
            events.MoveTakenBack: self._settle,
            events.Paused: self._pause,
            events.Resumed: self._pause,
        }
        if take := takers.get(type(event)):
            take(event)
        elif text := sentence(event):
            self.say(text)

    def _swap(self, event: events.ModeSwapped) -> None:
        self._entitle(event.white, event.black)
        self.say(sentence(event))

    def _turn(self, event: events.TurnBegan) -> None:
        self._position = chess.Board(event.fen)
        self._move, self.doing = "", f"waiting for {event.player}"

    def _think(self, event: events.EngineThinking) -> None:
        self.thought, self.doing = thinking_text(event.thinking, self._position), "thinking"

    def _transferred(self, event: events.TransferDone) -> None:
        self._held, self._pieces = None, event.layout.board_part()

    def _pause(self, event: events.Paused | events.Resumed) -> None:
        self._paused = sentence(event).rstrip(".").lower() if isinstance(event, events.Paused) else ""

    def _begin(self, event: events.GameStarted) -> None:
        self._number = event.game
        self._entitle(event.white, event.black)
        if event.resumed:
            self.say(sentence(event))
        self._position = chess.Board(event.fen)
        self._pieces = event.layout.board_part()
        self.doing = "getting ready"
        self._read_score()

    def _entitle(self, white: str, black: str) -> None:
        self.title = f"Game {self._number}: {white} against {black}"

    def _propose(self, event: events.MoveProposed) -> None:
        back = "taking back " if event.ply <= len(self.game.board.move_stack) else ""
        self._move = f"{back}{move_number(event)} {event.san}"
        self.doing = "made by hand" if event.by_hand else "on its way"
        move = chess.Move.from_uci(event.uci)
        self._marked = (move.from_square, move.to_square)

    def _reach(self, event: events.CheckpointReached) -> None:
        self.doing = sentence(event)
        if event.checkpoint is Checkpoint.CARRYING:
            self._held = event.transfer
            if (square := event.transfer.source.square) is not None:
                self._pieces.pop(square, None)

    def _settle(self, event: events.MoveCommitted | events.MoveTakenBack) -> None:
        self._held, self._pieces = None, event.layout.board_part()
        self._position = chess.Board(event.fen)
        self.doing = "made" if isinstance(event, events.MoveCommitted) else "taken back"
        if isinstance(event, events.MoveTakenBack):
            self.thought = ""
            self.say(sentence(event))
        self._read_score()

    def _read_score(self) -> None:
        """Once for each move: writing a whole game in SAN takes too long for every picture."""
        board = self.game.board
        self._log, self._captured = move_log(board), captured(board)
        last = board.peek() if board.move_stack else None
        self._marked = (last.from_square, last.to_square) if last else ()

    # --- picture out ----------------------------------------------------------------------------------------

    def picture(self, width: int) -> RenderableType:
        """The picture, `rows` lines high."""
        title = Text(self.title, style="bold", no_wrap=True, overflow="ellipsis")
        board = board_picture(self._pieces, self._marked, flipped=self.flipped, look=self.look)
        below = (self._background(), self._notices(width))
        if width < NARROW:
            return Group(title, board, self._status(), *below)
        grid = Table.grid(padding=(0, _GAP, 0, 0))
        side = width - WIDTH - _GAP
        if width < _WIDE:
            status = self._status()
            log = self._moves(HEIGHT - status.row_count - 1)
            grid.add_row(board, Group(log, Text(), status) if log.plain else status)
            grid.columns[1].width = side
        else:
            grid.add_row(board, self._status(), self._moves(HEIGHT))
            grid.columns[1].width = side - _LOG_WIDTH - _GAP
        return Group(title, grid, *below)

    def _moves(self, rows: int) -> Text:
        return Text("\n".join(self._log[-rows:]), no_wrap=True)

    def _status(self) -> Table:
        """What the robot does: `STATUS_ROWS` rows."""
        state = self.game.robot
        return _rows(
            ("robot", self._robot(state)),
            ("gripper", self._gripper(state)),
            ("now", self._now()),
            ("game", self._progress()),
        )

    def _background(self) -> Table:
        """What is thought, and what was taken: `BACKGROUND_ROWS` rows over the whole width."""
        return _rows(
            ("engine" if self.thought else "", self.thought),
            ("taken" if any(self._captured) else "", self._taken()),
        )

    @staticmethod
    def _robot(state: RobotState) -> str:
        if state.reported_position is None:
            return state.phase.value
        x, y, z = state.reported_position
        return f"{state.phase.value:<8} x {x:5.1f}  y {y:5.1f}  z {z:5.1f} mm"

    def _gripper(self, state: RobotState) -> str:
        if self._held is not None and state.gripper is GripperState.CLOSED:
            return f"holds the {piece_name(self._held.piece)}"
        return state.gripper.value

    def _now(self) -> Text:
        if self._paused:
            return Text(self._paused, style="bold yellow")
        text, left = Text(self.doing), self.game.seconds_left
        return text if left is None else text.append(f", {left:.1f} s left", style="dim")

    def _taken(self) -> str:
        white, black = ("".join(piece_sign(piece, self.look) for piece in side) for side in self._captured)
        return "   ".join(
            f"{name} {signs}" for name, signs in (("White's", white), ("Black's", black)) if signs
        )

    def _progress(self) -> Text:
        board, length = self.game.board, self.game.length
        text = Text(self._move or f"move {board.fullmove_number}, {colour_name(board.turn)} to move", "bold")
        if length:
            played = len(board.move_stack)
            full, empty = "█░" if self.look.glyphs else "#-"
            done = round(_BAR * min(played / length, 1.0))
            text.append(f"  {full * done}{empty * (_BAR - done)} {played} of {length}", style="not bold")
        return text

    def _notices(self, width: int) -> Text:
        lines = [line for text in self.messages for line in _wrapped(text, width)]
        return Text("\n".join(lines[-MESSAGE_ROWS:]), style="yellow", no_wrap=True)


def _rows(*rows: tuple[str, str | Text]) -> Table:
    table = Table.grid(padding=(0, 1, 0, 0))
    table.add_column(style="dim", min_width=8, no_wrap=True)
    table.add_column(no_wrap=True, overflow="ellipsis")
    for row in rows:
        table.add_row(*row)
    return table


def _wrapped(text: str, width: int) -> list[str]:
    return [line for part in text.splitlines() for line in textwrap.wrap(part, max(width - 1, 20)) or [""]]
