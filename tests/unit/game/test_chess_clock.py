"""The chess clock as arithmetic."""

import chess
import pytest

from kempelen.core.errors import ConfigError
from kempelen.game.clock import ChessClock, ClockReading, TimeControl
from kempelen.game.outcomes import by_time, termination
from kempelen.game.records import Ended


class Hours:
    """A time that passes when it is told to."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def hours() -> Hours:
    return Hours()


def test_only_the_time_of_the_side_that_decides_runs(hours: Hours) -> None:
    clock = ChessClock(TimeControl(60, 2), hours)
    assert clock.read() == ClockReading(60, 60)
    clock.start(chess.WHITE)
    hours.now += 10
    assert clock.read() == ClockReading(50, 60, chess.WHITE)
    clock.moved(chess.WHITE)
    hours.now += 100  # the robot carries the piece
    assert clock.read() == ClockReading(52, 60)
    clock.start(chess.BLACK)
    hours.now += 5
    clock.stop()
    hours.now += 5
    assert clock.read() == ClockReading(52, 55)


def test_there_is_never_less_than_no_time_and_then_no_increment(hours: Hours) -> None:
    clock = ChessClock(TimeControl(5, 3), hours)
    clock.start(chess.BLACK)
    hours.now += 6
    assert clock.read().left(chess.BLACK) == 0
    clock.moved(chess.BLACK)
    assert clock.read() == ClockReading(5, 0)


def test_starting_the_other_side_stops_the_first(hours: Hours) -> None:
    clock = ChessClock(TimeControl(60), hours).set_to(30, 20)
    clock.start(chess.WHITE)
    hours.now += 1
    clock.start(chess.BLACK)
    hours.now += 2
    assert clock.read() == ClockReading(29, 18, chess.BLACK)


def test_a_time_control_reads_as_in_pgn() -> None:
    assert [str(TimeControl(300, 2)), str(TimeControl(90))] == ["300+2", "90"]


@pytest.mark.parametrize("wrong", [(0, 0), (-1, 0), (36001, 0), (60, -1), (60, 181), (float("nan"), 0)])
def test_a_time_control_out_of_range_is_refused(wrong: tuple[float, float]) -> None:
    with pytest.raises(ConfigError, match="out of range"):
        TimeControl(*wrong)


@pytest.mark.parametrize(
    ("fen", "loser", "result", "reason"),
    [
        (chess.STARTING_FEN, chess.WHITE, "0-1", "White forfeits on time"),
        (chess.STARTING_FEN, chess.BLACK, "1-0", "Black forfeits on time"),
        ("8/8/4k3/8/8/3K4/4Q3/8 w - - 0 1", chess.WHITE, "1/2-1/2", "Black cannot mate"),
        ("8/8/4k3/8/8/3K4/4Q3/8 b - - 0 1", chess.BLACK, "1-0", "Black forfeits on time"),
        ("8/8/4k3/3n4/8/3K4/4P3/8 w - - 0 1", chess.WHITE, "0-1", "White forfeits on time"),
    ],
)
def test_time_over_loses_unless_the_other_side_cannot_mate(
    fen: str, loser: bool, result: str, reason: str
) -> None:
    ended = by_time(chess.Board(fen), loser)
    assert ended.result == result
    assert reason in ended.reason
    assert termination(ended) == "time forfeit"


def test_other_ends_are_normal() -> None:
    assert termination(None) == "unterminated"
    assert termination(Ended(result="1-0", reason="checkmate")) == "normal"
