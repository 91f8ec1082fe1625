"""Windows of frames, and what a square's past says of its present."""

import chess
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.geometry import Array
from kempelen.core.senses import BLACK, EMPTY, WHITE, Observation, states_of
from kempelen.sensing.moves.evidence import Standing, Window, bounded, frames_worth, normalised
from kempelen.sensing.moves.hypotheses import Happened, Hypotheses
from kempelen.sensing.moves.parameters import MoveParameters
from kempelen.testing.move_scenes import board_of

PARAMETERS = MoveParameters()


def saying(look: int, sure: float = 50.0) -> Array:
    """(64, 3) log-likelihoods of a board whose squares all look alike."""
    out = np.zeros((64, 3))
    out[:, look] = sure
    return normalised(out)


@given(st.integers(1, 200), st.floats(0.05, 1.0))
def test_frames_are_worth_less_than_their_number_and_more_than_one(frames: int, correlation: float) -> None:
    assert 1.0 - 1e-12 <= frames_worth(frames, correlation) <= min(frames, 1 / correlation) + 1e-12


def test_no_glitch_weighs_more_than_its_rate() -> None:
    ratio = bounded(saying(WHITE, 1e6), 1e-3)[0]
    assert ratio[WHITE] - ratio[EMPTY] == pytest.approx(np.log(3 / 1e-3), abs=1e-3)


def test_one_wild_frame_does_not_turn_a_window() -> None:
    window = Window(5, glitch=1e-3, correlation=0.25)
    for look in (EMPTY, EMPTY, WHITE, EMPTY, EMPTY):
        window.add(Observation(saying(look, 8.0 if look == EMPTY else 1e9), 0.0))
    assert window.full
    assert (window.log_likelihood.argmax(axis=1) == EMPTY).all()


def test_a_new_change_weighs_as_much_as_turned_squares_are_rare() -> None:
    standing = Standing(states_of(board_of("")), PARAMETERS)
    empty = saying(EMPTY)
    for _ in range(100):
        standing.learn(np.where(np.eye(3)[standing.states] > 0, 0.0, -50.0), 0.2)
    ratio = standing.ratios(empty)[chess.E2, EMPTY]
    assert np.log(0.1 / PARAMETERS.turned) < ratio < np.log(3 / PARAMETERS.turned)


def test_a_square_that_always_looked_so_says_nothing_new() -> None:
    standing = Standing(states_of(board_of("")), PARAMETERS)
    for _ in range(30):
        standing.learn(saying(WHITE), 0.2)
    assert standing.misread[chess.E4] > 0.99
    assert standing.misread[chess.E2] < PARAMETERS.misread
    assert abs(standing.ratios(saying(WHITE))[chess.E4, WHITE]) < np.log(2)


def test_a_touched_square_is_judged_anew() -> None:
    board = board_of("")
    standing = Standing(states_of(board), PARAMETERS)
    for _ in range(30):
        standing.learn(saying(BLACK), 0.2)
    board.push_san("e4")
    standing.confirm(states_of(board))
    assert standing.misread[chess.E4] == pytest.approx(PARAMETERS.misread)
    assert standing.misread[chess.D4] > 0.99


def test_a_sensor_without_colours_misreads_nothing() -> None:
    standing = Standing(states_of(board_of("")), PARAMETERS)
    blind = np.where(np.eye(3)[standing.states] > 0, 0.0, -50.0)
    blind[:, 1:] = blind[:, 1:].max(axis=1, keepdims=True)
    for _ in range(30):
        standing.learn(normalised(blind), 0.2)
    assert standing.misread.max() < PARAMETERS.misread


@pytest.mark.parametrize("position", ["", "e4 e5 Nf3 Nc6 Bc4 Bc5", "e4 a6 e5 d5", "e4 d5 exd5"])
def test_states_without_playing_are_those_of_playing(position: str) -> None:
    board = board_of(position)
    hypotheses = Hypotheses(board)
    for hypothesis in hypotheses.all:
        for line in hypothesis.lines:
            if hypothesis.happened in {Happened.MOVE, Happened.TWO}:
                after = board.copy()
                for move in line:
                    after.push(move)
                assert (hypotheses.after(hypothesis) == states_of(after)).all()


def test_every_legal_move_is_a_hypothesis_once() -> None:
    board = board_of("e4 e5 Nf3 Nc6 Bc4 Bc5")
    found = [line for h in Hypotheses(board).all if h.happened is Happened.MOVE for line in h.lines]
    assert sorted(m.uci() for (m,) in found) == sorted(m.uci() for m in board.legal_moves)


def test_thresholds_follow_from_the_budget() -> None:
    strict, loose = MoveParameters(budget=1e-6), MoveParameters(budget=1e-2)
    assert strict.threshold == pytest.approx(13.8155, abs=1e-4)
    assert strict.threshold > loose.threshold
    assert strict.frames > loose.frames
