import chess
import pytest

from kempelen.core.protocols import Thinking
from kempelen.engines.voting import Effort, Vote, elected, score_of, tally, thinking_of


def test_the_weight_is_score_over_the_least_times_depth() -> None:
    votes = [Vote("e2e4", 30.0, 10), Vote("d2d4", 10.0, 12), Vote("e2e4", 20.0, 9)]
    assert tally(votes) == {"e2e4": (20 + 14) * 10 + (10 + 14) * 9, "d2d4": 14 * 12}
    assert elected(votes, chess.Board()) == votes[0]


def test_the_many_outvote_the_one_that_is_a_little_surer() -> None:
    votes = [Vote("d2d4", 24.0, 10), *[Vote("e2e4", 20.0, 10)] * 3]
    chosen = elected(votes, chess.Board())
    assert chosen is not None
    assert chosen.move == "e2e4"


def test_a_mate_that_one_has_seen_wins() -> None:
    votes = [Vote("d2d4", score_of(Thinking(mate=2)), 9), *[Vote("e2e4", 300.0, 12)] * 3]
    chosen = elected(votes, chess.Board())
    assert chosen is not None
    assert (chosen.move, thinking_of(chosen).mate) == ("d2d4", 2)


def test_illegal_and_damaged_votes_do_not_count() -> None:
    assert elected([Vote("e2e5", 900.0, 30), Vote("hello", 900.0, 30)], chess.Board()) is None
    assert elected([], chess.Board()) is None
    votes = [Vote("e2e5", 900.0, 30), Vote("a2a3", -5.0, 3)]
    assert elected(votes, chess.Board()) == votes[1]


def test_equal_weights_do_not_depend_on_who_was_first() -> None:
    votes = [Vote("e2e4", 0.0, 5), Vote("d2d4", 0.0, 5)]
    assert elected(votes, chess.Board()) == elected(votes[::-1], chess.Board())


@pytest.mark.parametrize(
    "thinking", [Thinking(centipawns=35), Thinking(mate=3), Thinking(mate=-3), Thinking(centipawns=-900)]
)
def test_votes_keep_the_thought(thinking: Thinking) -> None:
    back = thinking_of(Vote("e2e4", score_of(thinking), 7, ("e2e4", "e7e5")))
    assert (back.centipawns, back.mate, back.depth) == (thinking.centipawns, thinking.mate, 7)
    assert [move.uci() for move in back.line] == ["e2e4", "e7e5"]


def test_an_effort_is_split_without_remainder_or_waste() -> None:
    assert sum(part.nodes or 0 for part in Effort(nodes=1000).split()) == 1000
    assert sum(part.seconds or 0.0 for part in Effort(seconds=2.0).split()) == pytest.approx(2.0)
    assert Effort(nodes=1).part(0.1).nodes == 1
