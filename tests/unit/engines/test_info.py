import chess
import pytest

from kempelen.core.protocols import Thinking
from kempelen.engines.info import Thought, parse_info, parse_policy


def moves(*names: str) -> tuple[chess.Move, ...]:
    return tuple(chess.Move.from_uci(name) for name in names)


def test_a_full_line() -> None:
    line = "info depth 12 seldepth 17 multipv 2 score cp -31 nodes 4711 nps 1000 time 5 pv e2e4 e7e5 g1f3"
    thinking = Thinking(depth=12, centipawns=-31, line=moves("e2e4", "e7e5", "g1f3"), nodes=4711)
    assert parse_info(line, chess.Board()) == Thought(2, thinking)


def test_a_mate_hides_centipawns() -> None:
    thought = parse_info("info depth 9 score mate -3 pv e2e4", chess.Board())
    assert thought == Thought(1, Thinking(depth=9, mate=-3, line=moves("e2e4")))


@pytest.mark.parametrize(
    "line",
    [
        "info depth 5 currmove e2e4 currmovenumber 1",
        "info string score cp 5 pv e2e4",
        "info depth 5 score cp pv e2e4",
        "info depth",
        "info",
        "info score cp",
    ],
)
def test_what_tells_no_score_is_no_thought(line: str) -> None:
    assert parse_info(line, chess.Board()) is None


def test_a_variation_ends_before_its_first_illegal_move() -> None:
    thought = parse_info("info depth x score cp 1 upperbound pv e2e4 e7e5 e1e8 g1f3", chess.Board())
    assert thought == Thought(1, Thinking(centipawns=1, line=moves("e2e4", "e7e5")))
    assert parse_info("info score cp 1 pv hello", chess.Board()) == Thought(1, Thinking(centipawns=1))


def test_lc0_tells_its_policy() -> None:
    line = "info string e7e5  (322 ) N:       0 (+ 0) (P: 42.30%) (WL:  -.-----) (D: -.---) (Q: -0.04624)"
    board = chess.Board()
    board.push_uci("e2e4")
    assert parse_policy(line, board) == (chess.Move.from_uci("e7e5"), 42.30 / 100)
    assert parse_policy(line, chess.Board()) is None  # illegal here: a line of another search
    assert parse_policy("info string node  (  20) N: 1 (P:  0.00%)", board) is None


def test_lc0_castles_onto_the_rook() -> None:
    board = chess.Board("4k3/8/8/8/8/8/8/4K2R w K - 0 1")
    policy = parse_policy("info string e1h1  (103 ) N: 0 (+ 0) (P: 7.5%)", board)
    assert policy == (chess.Move.from_uci("e1g1"), 7.5 / 100)
