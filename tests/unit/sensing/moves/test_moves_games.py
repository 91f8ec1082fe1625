"""Whole games through noise, and what must never happen."""

import chess
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kempelen.sensing.moves.verdicts import Moved, Unsure
from kempelen.testing.move_scenes import Scene, board_of
from kempelen.testing.observations import Sensor

OPERA = (
    "e4 e5 Nf3 d6 d4 Bg4 dxe5 Bxf3 Qxf3 dxe5 Bc4 Nf6 Qb3 Qe7 Nc3 c6 Bg5 b5 Nxb5 cxb5 Bxb5+ Nbd7 O-O-O Rd8 "
    "Rxd7 Rxd7 Rd1 Qe6 Bxd7+ Nxd7 Qb8+ Nxb8 Rd8#"
)
EN_PASSANT = "e4 e6 e5 d5 exd6 cxd6 d4 Nf6 Nf3 Be7 Bd3 O-O O-O Nc6 Re1 b5 Bxb5 Bb7 a4 a6 Bd3 Nb4"
NAMED = 0.995


def played(game: str, sensor: Sensor) -> tuple[int, list[str], list[str]]:
    """How many moves were named, which were not, and which were named wrongly."""
    scene, named, missed, wrong = Scene(sensor=sensor), 0, [], []
    for san in game.split():
        scene.hand(0.2)
        seen = len(scene.accepted)
        scene.after(san, seconds=0.7)
        if len(scene.accepted) == seen:
            scene.after(san, seconds=2.5)  # a rook's move that could be castling takes its time
        move = scene.board.parse_san(san)
        answers = {tuple(v.moves) for v in scene.accepted[seen:]}
        named += answers == {(move,)}
        missed += [san] if not answers else []
        wrong += [san] if answers - {(move,)} else []
        scene.confirm(san)
        scene.stands(seconds=0.2)
    return named, missed, wrong


@pytest.mark.parametrize(
    "sensor",
    [
        Sensor(seed=1, rate=15),
        Sensor(seed=2, separation=6, glitches=0.01, rate=15),
        Sensor(seed=3, separation=7, shared=0.6, rate=15),
    ],
    ids=["good", "glitches", "shared noise"],
)
def test_whole_games_are_named(sensor: Sensor) -> None:
    results = [played(game, sensor) for game in (OPERA, EN_PASSANT)]
    total = len((OPERA + " " + EN_PASSANT).split())
    assert [r[2] for r in results] == [[], []]
    assert sum(r[0] for r in results) >= NAMED * total, [r[1] for r in results]


@pytest.mark.parametrize(
    "sensor",
    [
        Sensor(seed=4, separation=3.5, rate=15),
        Sensor(seed=5, separation=4, shared=0.8, glitches=0.02, rate=15),
        Sensor(seed=6, stuck={"e4": "white", "d5": "empty", "d7": "black"}, rate=15),
    ],
    ids=["poor", "worse", "misread squares"],
)
def test_poor_sensors_ask_more_and_are_never_wrong(sensor: Sensor) -> None:
    named, missed, wrong = played(OPERA, sensor)
    assert wrong == []
    assert named + len(missed) == len(OPERA.split())
    assert named > 0


@st.composite
def positions(draw: st.DrawFn) -> chess.Board:
    """Positions after random legal moves, biased by nothing."""
    board = chess.Board()
    for choice in draw(st.lists(st.integers(0, 10_000), min_size=0, max_size=40)):
        legal = list(board.legal_moves)
        if not legal:
            break
        board.push(legal[choice % len(legal)])
    return board


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(positions(), st.integers(0, 10_000))
def test_every_legal_move_is_named_from_clean_observations(board: chess.Board, choice: int) -> None:
    legal = list(board.legal_moves)
    if not legal:
        return
    move = legal[choice % len(legal)]
    scene = Scene(board.fen(), Sensor(separation=12, rate=15))
    verdict = scene.hand(0.2).after(board.san(move), seconds=3)
    if move.promotion:
        assert isinstance(verdict, Unsure)
        assert (move,) in verdict.candidates
    else:
        assert isinstance(verdict, Moved)
        assert verdict.moves == (move,)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.sampled_from(["", "e4 e5 Nf3", OPERA[:60]]))
def test_what_is_accepted_is_legal_and_looks_like_the_table(seed: int, changed: int, position: str) -> None:
    """Squares changed at random: whatever is accepted must lead to exactly what stands there."""
    random = np.random.default_rng(seed)
    scene = Scene(position, Sensor(seed=seed, rate=15))
    names = random.choice(chess.SQUARE_NAMES, changed, replace=False)
    looks = random.choice(["empty", "white", "black"], changed)
    changes = dict(zip(map(str, names), map(str, looks), strict=True))
    scene.hand(0.2).stands(changes, seconds=3.5)
    for verdict in scene.accepted:
        board = scene.board.copy()
        for _ in range(getattr(verdict, "plies", 0)):
            board.pop()
        for move in verdict.moves:
            assert move in board.legal_moves
            board.push(move)
        seen = {s: board.color_at(chess.parse_square(s)) for s in changes}
        wanted = {"empty": None, "white": True, "black": False}
        assert seen == {s: wanted[look] for s, look in changes.items()}


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from(chess.SQUARE_NAMES), st.sampled_from(["empty", "white", "black"]), st.integers(0, 99))
def test_a_misread_square_never_leads_to_a_wrong_accept(square: str, look: str, seed: int) -> None:
    scene = Scene("e4 e5 Nf3 Nc6 Bb5", Sensor(seed=seed, stuck={square: look}, rate=15))
    scene.hand(0.2).stands(seconds=2)
    assert not scene.accepted
    scene.hand(0.2).after("a6", seconds=2)
    assert {v.moves for v in scene.accepted} <= {(chess.Move.from_uci("a7a6"),)}


def test_the_doubt_left_is_within_the_budget() -> None:
    scene = Scene("e4 e5").hand()
    scene.after("Nf3")
    margins = [v.margin for v in scene.accepted]
    assert margins
    assert min(margins) >= scene.reader.parameters.threshold
    assert np.exp(-np.array(margins)).max() <= scene.reader.parameters.budget


def test_scenes_start_where_they_say() -> None:
    assert board_of("e4").fen().startswith("rnbqkbnr/pppppppp/8/8/4P3")
