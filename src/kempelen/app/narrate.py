"""Events in plain words: one sentence each, for pictures, pipes, logs and screen readers."""

from collections.abc import Callable
from typing import Any

import chess

from kempelen.core import events
from kempelen.core.pieces import kind_name
from kempelen.core.protocols import Checkpoint, Thinking
from kempelen.core.senses import Sight

_LINE = 5  # moves of the principal variation that are shown


def colour_name(colour: chess.Color) -> str:
    """White or Black."""
    return "White" if colour else "Black"


def move_number(event: events.MoveProposed) -> str:
    """``12.`` or ``12...``, as on the score sheet; counted from half-moves where it is not known."""
    return f"{event.number or (event.ply + 1) // 2}{'.' if event.colour else '...'}"


def thinking_text(thinking: Thinking, board: chess.Board) -> str:
    """``depth 14, +0.35, Nf3 Nc6``-like; the score is that of the side to move.

    Args:
        thinking: Of the side to move on ``board``.
        board: For writing the moves in SAN; a line that does not fit it is left out.
    """
    if thinking.mate is not None:
        score = f"mate in {thinking.mate}" if thinking.mate > 0 else f"being mated in {-thinking.mate}"
    else:
        score = "" if thinking.centipawns is None else f"{thinking.centipawns / 100:+.2f}"
    depth = f"depth {thinking.depth}" if thinking.depth else ""
    adapted = "" if thinking.adapted is None else f"adapting to you: about Elo {thinking.adapted}"
    return ", ".join(part for part in (depth, score, _san_line(thinking, board), adapted) if part)


def _san_line(thinking: Thinking, board: chess.Board) -> str:
    board, line = board.copy(stack=False), []
    for move in thinking.line[:_LINE]:
        if move not in board.legal_moves:
            break
        line.append(board.san(move))
        board.push(move)
    return " ".join(line)


def _started(event: events.GameStarted) -> str:
    begun = f"Game {event.game}"
    if event.resumed:
        begun += f" goes on after {event.plies} half-moves"
    return f"{begun}: {event.white} against {event.black} ({event.mode})."


def _proposed(event: events.MoveProposed) -> str:
    hand = " by hand" if event.by_hand else ""
    back = "Taking back " if event.takeback else ""
    return f"{back}{move_number(event)} {event.san}{hand}"


def _checkpoint(event: events.CheckpointReached) -> str:
    name = kind_name(event.transfer.piece.piece_type)
    match event.checkpoint:
        case Checkpoint.GRIPPING:
            return f"fetching the {name} from {event.transfer.source}"
        case Checkpoint.CARRYING:
            return f"carrying the {name} to {event.transfer.target}"
        case _:
            return f"the {name} stands on {event.transfer.target}"


def _sight(event: events.SensorChanged) -> str:
    if event.sight is Sight.CLEAR:
        return event.message or "The board is in sight."
    return f"The board is not in sight ({event.sight.value}). {event.message}".strip()


_SENTENCES: dict[type, Callable[[Any], str]] = {
    events.GameStarted: _started,
    events.MoveProposed: _proposed,
    events.SettingUp: lambda e: f"Setting up the position: {len(e.transfers)} pieces to move.",
    events.PositionSetUp: lambda _: "The position is set up.",
    events.CheckpointReached: _checkpoint,
    events.MoveTakenBack: lambda e: f"Taken back: {e.san}",
    events.Paused: lambda e: "Paused" + (" in mid-transfer." if e.in_transfer else "."),
    events.Resumed: lambda _: "Going on.",
    events.ModeSwapped: lambda e: f"Mode {e.mode}: {e.white} against {e.black}.",
    events.RobotChanged: lambda e: f"Robot: {e.state.message}" if e.state.message else "",
    events.OperatorAsked: lambda e: f"Please: {e.text}",
    events.OperatorAnswered: lambda e: f"Thank you: {e.text}",
    events.SensorChanged: _sight,
    events.HandOverBoard: lambda e: "A hand is over the board." if e.over else "",
    events.SensorUnsure: lambda e: f"{e.question} Type the move." if e.question else "",
    events.BoardDiffers: lambda e: e.advice,
    events.DrawOffered: lambda e: f"{colour_name(e.colour)} offers a draw.",
    events.DrawDeclined: lambda e: f"{colour_name(e.colour)}'s draw offer is declined.",
    events.GameOver: lambda e: f"Game over: {e.result}, {e.reason}.",
}


def sentence(event: events.Event) -> str:
    """One line for an event; empty when there is nothing to say."""
    tell = _SENTENCES.get(type(event))
    return tell(event) if tell else ""
