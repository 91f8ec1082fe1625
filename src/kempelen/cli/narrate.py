"""Events in plain words: one sentence each, for pipes, logs and screen readers."""

from collections.abc import Callable
from typing import Any

import chess

from kempelen.core import events
from kempelen.core.pieces import kind_name, piece_name
from kempelen.core.protocols import Checkpoint, Thinking
from kempelen.core.table import Table


def _colour(colour: chess.Color) -> str:
    return "White" if colour else "Black"


def move_number(ply: int, colour: chess.Color) -> str:
    """``12.`` or ``12...`` for a half-move counted from 1."""
    return f"{(ply + 1) // 2}{'.' if colour else '...'}"


def thinking_text(thinking: Thinking) -> str:
    """``depth 14, +0.35, Nf3 Nc6``-like; moves in UCI."""
    if thinking.mate is not None:
        score = f"mate in {thinking.mate}" if thinking.mate > 0 else f"being mated in {-thinking.mate}"
    else:
        score = "" if thinking.centipawns is None else f"{thinking.centipawns / 100:+.2f}"
    line = " ".join(move.uci() for move in thinking.line[:4])
    return ", ".join(part for part in (f"depth {thinking.depth}", score, line) if part)


def _started(event: events.GameStarted) -> str:
    verb = (
        f"Game {event.game} goes on after {event.plies} half-moves" if event.resumed else f"Game {event.game}"
    )
    return f"{verb}: {event.white} against {event.black} ({event.mode})."


def _proposed(event: events.MoveProposed) -> str:
    hand = " by hand" if event.by_hand else ""
    return f"{move_number(event.ply, event.colour)} {event.san}{hand}"


def _checkpoint(event: events.CheckpointReached) -> str:
    name = piece_name(event.transfer.piece)
    match event.checkpoint:
        case Checkpoint.GRIPPING:
            return f"  fetching the {name} from {event.transfer.source}"
        case Checkpoint.CARRYING:
            return f"  carrying the {kind_name(event.transfer.piece.piece_type)} to {event.transfer.target}"
        case _:
            return f"  the {name} stands on {event.transfer.target}"


def _robot(event: events.RobotChanged) -> str:
    return f"  robot: {event.state.message}" if event.state.message else ""


_SENTENCES: dict[type, Callable[[Any], str]] = {
    events.GameStarted: _started,
    events.MoveProposed: _proposed,
    events.CheckpointReached: _checkpoint,
    events.MoveTakenBack: lambda e: f"Taken back: {e.san}",
    events.Paused: lambda e: "Paused" + (" in mid-transfer." if e.in_transfer else "."),
    events.Resumed: lambda _: "Going on.",
    events.ModeSwapped: lambda e: f"Mode {e.mode}: {e.white} against {e.black}.",
    events.RobotChanged: _robot,
    events.OperatorAsked: lambda e: f"Please: {e.text}",
    events.OperatorAnswered: lambda e: f"Thank you: {e.text}",
    events.DrawOffered: lambda e: f"{_colour(e.colour)} offers a draw.",
    events.DrawDeclined: lambda e: f"{_colour(e.colour)}'s draw offer is declined.",
    events.GameOver: lambda e: f"Game over: {e.result}, {e.reason}.",
}


def sentence(event: events.Event) -> str:
    """One line for an event; empty when there is nothing to say."""
    tell = _SENTENCES.get(type(event))
    return tell(event) if tell else ""


def place_words(table: Table) -> str:
    """The table in one line."""
    trays = ", ".join(f"{tray.name} ({len(tray.slots)} slots)" for tray in table.trays)
    return f"squares of {table.square:.1f} mm, {table.pieces.name} pieces, trays {trays}"
