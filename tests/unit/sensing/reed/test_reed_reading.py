"""What the order of lifts and placings tells, and what the switches' faults are called."""

import chess
import pytest

from kempelen.core.reed import Change, Finding, Snapshot
from kempelen.core.senses import BLACK, EMPTY, WHITE, Sight
from kempelen.sensing.moves.reader import MoveReader
from kempelen.sensing.moves.verdicts import Moved, TakenBack, Unsure, Verdict, Wrong
from kempelen.sensing.reed.parameters import REED_PARAMETERS
from kempelen.sensing.reed.reading import HELD_MS, QUIET_MS, Reading

TWO_VICTIMS = "3rk3/8/8/3p3p/8/8/8/3QK2R w K - 0 1"
PASSING = "4k3/8/8/3pP3/8/8/8/4K3 w - d6 0 1"
PROMOTING = "4k3/P7/8/8/8/8/8/4K3 w - - 0 1"


class Table:
    """A reading that is fed by hand."""

    def __init__(self, fen: str = chess.STARTING_FEN, *moves: str) -> None:
        self.board = chess.Board(fen)
        for move in moves:
            self.board.push_uci(move)
        self.reading = Reading(self.board)
        self.reader = MoveReader(self.board, REED_PARAMETERS)
        self.number, self.now, self.closed = 0, 0, self.board.occupied
        self.doubtful = 0
        self.look()

    def look(self) -> Verdict:
        self.reading.take(Snapshot(self.number, self.now, self.closed, self.doubtful))
        return self.reader.update(self.reading.observation())

    def wait(self, ms: int = 4000) -> Verdict:
        """Until something is to be said, at most so long."""
        verdict = self.look()
        for _ in range(ms // 100):
            self.now += 100
            verdict = self.look()
            if isinstance(verdict, Moved | TakenBack | Unsure | Wrong):
                return verdict
        return verdict

    def rest(self, ms: int) -> None:
        """Whatever is said meanwhile."""
        for _ in range(ms // 100):
            self.now += 100
            self.look()

    def do(self, deeds: str, pause: int = 300) -> None:
        """``-e2 +e4``: lifted, set down."""
        for deed in deeds.split():
            self.now += pause
            self.number += 1
            square = chess.parse_square(deed[1:])
            self.closed ^= 1 << square
            self.reading.take(Change(self.number, self.now, square, placed=deed[0] == "+"))
            self.look()

    def confirm(self, move: str) -> None:
        self.board.push_uci(move)
        self.reading.stands(self.board)
        self.reader.confirm(self.board)


@pytest.mark.parametrize(
    ("fen", "deeds", "move"),
    [
        (chess.STARTING_FEN, "-e2 +e4", "e2e4"),
        (chess.STARTING_FEN, "-e2 +e3 -e3 +e4", "e2e4"),  # a slide
        (chess.STARTING_FEN, "-e2 +e2 -d2 +d4", "d2d4"),  # touched, and another one moved
        (chess.STARTING_FEN, "-g8 +g8 -g1 +f3 -f3 +f3", "g1f3"),  # straightened
        (TWO_VICTIMS, "-d5 -d1 +d5", "d1d5"),  # the victim first
        (TWO_VICTIMS, "-d1 -d5 +d5", "d1d5"),  # the queen first
        (TWO_VICTIMS, "-d1 -h5 +h5", "d1h5"),  # leaves the same squares occupied as the one before
        (TWO_VICTIMS, "-d5 +d5 -d1 -h5 +h5", "d1h5"),
        (TWO_VICTIMS, "-e1 +g1 -h1 +f1", "e1g1"),
        (TWO_VICTIMS, "-h1 +f1 -e1 +g1", "e1g1"),
        (TWO_VICTIMS, "-e1 -h1 +f1 +g1", "e1g1"),
        (TWO_VICTIMS, "-h1 -e1 +g1 +f1", "e1g1"),
        (PASSING, "-e5 +d6 -d5", "e5d6"),
        (PASSING, "-d5 -e5 +d6", "e5d6"),
        (PASSING, "-e5 -d5 +d6", "e5d6"),
    ],
)
def test_moves_are_named(fen: str, deeds: str, move: str) -> None:
    table = Table(fen)
    table.do(deeds)
    verdict = table.wait()
    assert isinstance(verdict, Moved)
    assert verdict.moves == (chess.Move.from_uci(move),)


def test_nothing_is_read_while_a_hand_is_at_work_or_holds_a_piece() -> None:
    table = Table()
    table.do("-e2")
    table.now += QUIET_MS + 100
    table.look()
    seen = table.reading.observation()
    assert (seen.sight, seen.message) == (Sight.HAND, "The white pawn from e2 is in the hand.")
    verdict = table.wait(HELD_MS + 3000)
    assert isinstance(verdict, Unsure)
    assert verdict.question == "Where does the white pawn from e2 go?"


def test_what_no_order_can_tell_is_asked() -> None:
    """The queen in the hand, one victim touched, the other one too: which of them has been put back?"""
    table = Table(TWO_VICTIMS)
    table.do("-d1 -d5 +d5 -h5 +h5")
    verdict = table.wait()
    assert isinstance(verdict, Unsure)
    assert verdict.question == "Is the white queen on d5 or h5?"


def test_a_promotion_is_asked_for() -> None:
    table = Table(PROMOTING)
    table.do("-a7 +a8 -a8 +a8")
    verdict = table.wait()
    assert isinstance(verdict, Unsure)
    assert "What does the white pawn become on a8" in verdict.question


@pytest.mark.parametrize(
    ("deeds", "advice"),
    [
        ("-g1 +e4", "the knight cannot go from g1 to e4"),
        ("-e7 +e5", "but it is White's turn"),
        ("+e5", "Take the white piece off e5."),
        ("-e2 +e4 -e7 +e5", "After e4: Put the black pawn from e5 back on e7."),
    ],
)
def test_what_is_impossible_is_told_and_put_right(deeds: str, advice: str) -> None:
    table = Table()
    table.do(deeds)
    verdict = table.wait()
    assert isinstance(verdict, Wrong)
    assert advice in verdict.advice
    back = " ".join(f"{'+' if deed[0] == '-' else '-'}{deed[1:]}" for deed in reversed(deeds.split()))
    table.do(back)
    table.do("-d2 +d4")
    right = table.wait()
    assert isinstance(right, Moved)
    assert right.moves == (chess.Move.from_uci("d2d4"),)


def test_moves_taken_back() -> None:
    table = Table(chess.STARTING_FEN, "e2e4", "e7e5")
    table.do("-e5 +e7 -e4 +e2")
    verdict = table.wait()
    assert isinstance(verdict, TakenBack)
    assert verdict.plies == 2


def test_lost_lines_are_made_up_for_by_the_next_snapshot() -> None:
    table = Table()
    table.closed ^= 1 << chess.E2 | 1 << chess.E4
    table.number += 2
    verdict = table.wait()
    assert isinstance(verdict, Moved)
    assert verdict.moves == (chess.Move.from_uci("e2e4"),)
    assert table.reading.lost == 1


def test_a_stuck_switch_is_asked_once_named_and_left_out() -> None:
    table = Table()
    table.do("+e4")  # e2 does not open
    verdict = table.wait()
    assert isinstance(verdict, Unsure)
    assert verdict.question == "Is the white pawn on e2 or e4?"
    table.confirm("e2e4")
    table.rest(3000)
    (fault,) = table.reading.faults.named
    assert (fault.kind, fault.squares) == ("stuck closed", 1 << chess.E2)
    assert "The switch of e2 is stuck closed" in fault.sentence
    table.do("-e7 +e5")
    assert isinstance(table.wait(), Moved)


def test_a_piece_that_is_not_felt_is_named_and_its_magnet_when_the_switch_works() -> None:
    table = Table()
    table.do("-e2")
    table.confirm("e2e4")
    table.rest(4000)
    table.do("+e4")
    kinds = [fault.kind for fault in table.reading.faults.named]
    assert kinds == ["not felt", "weak magnet"]
    assert "the magnet of the white pawn" in table.reading.faults.named[1].sentence


def test_a_piece_lifted_as_soon_as_a_move_counts_is_no_fault() -> None:
    table = Table()
    table.do("-e2 +e4")
    table.wait()
    table.do("-e7", pause=10)
    table.confirm("e2e4")
    table.wait(HELD_MS - 1000)
    table.do("+e5")
    assert isinstance(table.wait(), Moved)
    assert table.reading.faults.named == []


def test_what_the_board_finds_is_said_in_words_once() -> None:
    table = Table()
    for number in (1, 2):
        table.reading.take(Finding(number, 10, "sneak", 1 << chess.B2 | 1 << chess.C2))
    table.reading.take(Finding(3, 20, "chatter", 1 << chess.H8))
    first, second = (fault.sentence for fault in table.reading.faults.named)
    assert first.startswith("A diode is missing at one of b2 or c2")
    assert second.startswith("The switch of h8 does not come to rest.")


def test_a_square_that_may_be_feigned_says_nothing() -> None:
    table = Table()
    table.doubtful = 1 << chess.E2
    table.closed |= 1 << chess.E4
    table.now += QUIET_MS
    table.look()
    table.now += QUIET_MS
    table.look()
    told = table.reading.observation().log_likelihood
    assert told[chess.D2].argmax() == WHITE
    assert told[chess.D7].argmax() == BLACK
    assert told[chess.D4].argmax() == EMPTY
    spread = told[chess.E2, [EMPTY, WHITE]]
    assert abs(float(spread[0] - spread[1])) < 1.2
