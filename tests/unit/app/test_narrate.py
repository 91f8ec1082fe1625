"""Events in plain words."""

import chess
import pytest

from kempelen.app.narrate import sentence, thinking_text
from kempelen.core import events
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import Checkpoint, RobotState, Thinking

KNIGHT = Transfer(chess.Piece.from_symbol("N"), Place("g1"), Place("f3"))
LAYOUT = Layout({})


@pytest.mark.parametrize(
    ("event", "words"),
    [
        (
            events.GameStarted(3, "play", "Ada", "Fish", "", LAYOUT, plies=4, resumed=True),
            "Game 3 goes on after 4 half-moves: Ada against Fish (play).",
        ),
        (events.GameStarted(3, "watch", "A", "B", "", LAYOUT), "Game 3: A against B (watch)."),
        (events.MoveProposed(23, chess.WHITE, "Nf3", "g1f3", ()), "12. Nf3"),
        (events.MoveProposed(24, chess.BLACK, "Nf6", "", (), by_hand=True), "12... Nf6 by hand"),
        (events.CheckpointReached(KNIGHT, Checkpoint.GRIPPING), "fetching the knight from g1"),
        (events.CheckpointReached(KNIGHT, Checkpoint.CARRYING), "carrying the knight to f3"),
        (events.CheckpointReached(KNIGHT, Checkpoint.RELEASED), "the knight stands on f3"),
        (events.MoveTakenBack(1, "e4", "", LAYOUT), "Taken back: e4"),
        (events.Paused(), "Paused."),
        (events.Paused(in_transfer=True), "Paused in mid-transfer."),
        (events.Resumed(), "Going on."),
        (events.ModeSwapped("play", "A", "B"), "Mode play: A against B."),
        (events.RobotChanged(RobotState(message="Home it.")), "Robot: Home it."),
        (events.RobotChanged(RobotState()), ""),
        (events.OperatorAsked("Stand a queen on left3."), "Please: Stand a queen on left3."),
        (events.OperatorAnswered("It stands."), "Thank you: It stands."),
        (events.DrawOffered(chess.BLACK), "Black offers a draw."),
        (events.DrawDeclined(chess.WHITE), "White's draw offer is declined."),
        (events.GameOver("1-0", "checkmate"), "Game over: 1-0, checkmate."),
        (events.TransferStarted(KNIGHT, 1, 1), ""),
    ],
)
def test_sentences(event: events.Event, words: str) -> None:
    assert sentence(event) == words


def moves(*ucis: str) -> tuple[chess.Move, ...]:
    return tuple(map(chess.Move.from_uci, ucis))


@pytest.mark.parametrize(
    ("thinking", "words"),
    [
        (Thinking(depth=14, centipawns=35, line=moves("e2e4", "c7c5")), "depth 14, +0.35, e4 c5"),
        (Thinking(depth=3, centipawns=-120), "depth 3, -1.20"),
        (Thinking(mate=2), "mate in 2"),
        (Thinking(depth=9, mate=-4), "depth 9, being mated in 4"),
        (Thinking(depth=2, line=moves("e2e4", "e2e4")), "depth 2, e4"),
        (Thinking(line=moves("a1a8")), ""),
    ],
)
def test_thoughts_are_written_in_san_as_far_as_they_fit(thinking: Thinking, words: str) -> None:
    assert thinking_text(thinking, chess.Board()) == words
