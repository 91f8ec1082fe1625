"""What the live picture shows: events go in, a picture for a given width comes out. No terminal in here."""

import textwrap
from dataclasses import dataclass, field
from typing import Protocol

import chess
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from kempelen.cli.board import HEIGHT, WIDTH, Look, board_picture, piece_sign
from kempelen.cli.narrate import colour_name, move_number, sentence, thinking_text
from kempelen.cli.score import captured, move_log
from kempelen.core import events
from kempelen.core.pieces import piece_name
from kempelen.core.places import Transfer
from kempelen.core.protocols import Checkpoint, GripperState, RobotState

MESSAGE_ROWS = 4
ROWS = 1 + HEIGHT + MESSAGE_ROWS
NARROW = 64  # columns below which the status stands under the board
_WIDE = 106  # columns from which the moves have a column of their own
_GAP = 3
_LOG_WIDTH = 24
_BAR = 16


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
    _move: str = ""
    _paused: str = ""

    # --- events in ----------------------------------------------------------------------------------------

    def say(self, text: str) -> None:
        """A line for the person."""
        self.messages = [*self.messages, text][-MESSAGE_ROWS:]

    def note(self, event: events.Event) -> None:
        """Take in what happened."""
        match event:
            case events.GameStarted():
                self._begin(event)
            case events.TurnBegan():
                self._position = chess.Board(event.fen)
                self._move, self.doing = "", f"{colour_name(event.colour)} to move: {event.player}"
            case events.EngineThinking():
                self.thought = thinking_text(event.thinking, self._position)
            case events.MoveProposed():
                self._propose(event)
            case events.CheckpointReached():
                self._reach(event)
            case events.TransferDone():
                self._held, self._pieces = None, event.layout.board_part()
            case events.MoveCommitted() | events.MoveTakenBack():
                self._settle(event)
            case events.Paused() | events.Resumed():
                self._paused = sentence(event).rstrip(".").lower() if isinstance(event, events.Paused) else ""
            case _ if text := sentence(event):
                self.say(text)

    def _begin(self, event: events.GameStarted) -> None:
        self.title = f"Game {event.game}: {event.white} against {event.black}"
        if event.resumed:
            self.say(sentence(event))
        self._position = chess.Board(event.fen)
        self._pieces = event.layout.board_part()
        self.doing = "getting ready"
        self._read_score()

    def _propose(self, event: events.MoveProposed) -> None:
        self._move = f"{move_number(event.ply, event.colour)} {event.san}"
        self.doing = "by your hand" if event.by_hand else "on its way"
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
        """`ROWS` lines when ``width`` is at least `NARROW`."""
        title = Text(self.title, style="bold", no_wrap=True, overflow="ellipsis")
        board = board_picture(self._pieces, self._marked, flipped=self.flipped, look=self.look)
        side = width - WIDTH - _GAP
        if width < NARROW:
            return Group(title, board, self._status(), self._notices(width))
        grid = Table.grid(padding=(0, _GAP, 0, 0))
        if width < _WIDE:
            status = self._status()
            log = self._moves(HEIGHT - status.row_count - 1)
            grid.add_row(board, Group(log, Text(), status) if log.plain else status)
            grid.columns[1].width = side
        else:
            grid.add_row(board, self._status(), self._moves(HEIGHT))
            grid.columns[1].width = side - _LOG_WIDTH - _GAP
        return Group(title, grid, self._notices(width))

    def _moves(self, rows: int) -> Text:
        return Text("\n".join(self._log[-rows:]) if rows > 0 else "", no_wrap=True)

    def _status(self) -> Table:
        table = Table.grid(padding=(0, 1, 0, 0))
        table.add_column(style="dim", width=8)
        table.add_column(no_wrap=True, overflow="ellipsis")
        state = self.game.robot
        table.add_row("robot", self._robot(state))
        table.add_row("gripper", self._gripper(state))
        table.add_row("now", self._now())
        if self.thought:
            table.add_row("engine", self.thought)
        if any(self._captured):
            table.add_row("taken", self._taken())
        table.add_row("game", self._progress())
        return table

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
        text = Text(f"{self._move}: " if self._move else "", style="bold")
        if self._paused:
            return text.append(self._paused, style="bold yellow")
        text.append(self.doing, style="not bold")
        left = self.game.seconds_left
        if left is not None:
            text.append(f", {left:.1f} s left", style="not bold dim")
        return text

    def _taken(self) -> str:
        white, black = ("".join(piece_sign(piece, self.look) for piece in side) for side in self._captured)
        return "   ".join(
            f"{name}: {signs}" for name, signs in (("White's", white), ("Black's", black)) if signs
        )

    def _progress(self) -> str:
        board = self.game.board
        played, length = len(board.move_stack), self.game.length
        if length:
            full = "#-" if not self.look.glyphs else "█░"
            done = round(_BAR * min(played / length, 1.0))
            return f"{full[0] * done}{full[1] * (_BAR - done)} half-move {played} of {length}"
        return f"move {board.fullmove_number}, {colour_name(board.turn)} to move"

    def _notices(self, width: int) -> Text:
        lines = [line for text in self.messages for line in _wrapped(text, width)]
        return Text("\n".join(lines[-MESSAGE_ROWS:]), style="yellow", no_wrap=True)


def _wrapped(text: str, width: int) -> list[str]:
    return [line for part in text.splitlines() for line in textwrap.wrap(part, max(width - 1, 20)) or [""]]
