from dataclasses import replace
from functools import lru_cache

import chess
import numpy as np
import pytest

from kempelen.core.camera import Frame
from kempelen.core.errors import ConfigError
from kempelen.core.senses import BLACK, EMPTY, WHITE, Observation, Sight, states_of
from kempelen.sensing.draw import Ground, Layer, annotate, layered
from kempelen.sensing.tracker import Tracker, TrackerSettings, Use
from kempelen.testing.depth_scene import SKIN, SQUARE, DepthScene, Post, start_men

START = states_of(chess.Board())


@lru_cache(maxsize=24)
def shot(
    posts: tuple[Post, ...], seed: int = 0, shift: tuple[float, float] = (0.0, 0.0), turn: float = 0.0
) -> Frame:
    return DepthScene(posts=posts, shift=shift, turn=turn).frame(
        noise=1.5, seed=seed, offset=9.0, dark_step=4.0
    )


MEN = tuple(start_men())
ARM = tuple(
    Post(4.5 * SQUARE, y * SQUARE, 150.0, radius=22.0, colour=SKIN, bottom=110.0)
    for y in np.arange(-2, 3, 0.3)
)


def after(uci: str) -> tuple[Post, ...]:
    """The start position with one man moved."""
    move = chess.Move.from_uci(uci)
    places = [chess.square(int(post.x // SQUARE), int(post.y // SQUARE)) for post in MEN]
    x, y = (
        (chess.square_file(move.to_square) + 0.5) * SQUARE,
        (chess.square_rank(move.to_square) + 0.5) * SQUARE,
    )
    return tuple(
        replace(post, x=x, y=y) if place == move.from_square else post
        for post, place in zip(MEN, places, strict=True)
    )


class Watched:
    """A tracker and its camera's clock."""

    def __init__(self, use: Use = Use.DEPTH, position: chess.Board | None = None, **overrides: float) -> None:
        self.tracker = Tracker(TrackerSettings(use=use, overrides=overrides))
        self.tracker.expect(position)
        self.frames = 0

    def see(self, frame: Frame, *, gap: float = 1 / 30) -> Observation:
        self.frames += 1
        self._time = getattr(self, "_time", 0.0) + gap
        return self.tracker.update(replace(frame, sequence=self.frames, time=self._time))

    def settled(self, posts: tuple[Post, ...] = MEN, most: int = 12) -> Observation:
        for k in range(most):
            seen = self.see(shot(posts, k % 2))
            if seen.valid:
                return seen
        raise AssertionError(f"{seen.sight}: {seen.message}")


@pytest.fixture(scope="module")
def depth() -> Watched:
    watched = Watched(position=chess.Board())
    watched.settled()
    return watched


def occupied(seen: Observation) -> np.ndarray:
    return seen.log_likelihood[:, WHITE] > seen.log_likelihood[:, EMPTY]


def test_it_starts_by_learning_and_then_reads() -> None:
    watched = Watched(position=chess.Board())
    first = watched.see(shot(MEN))
    assert first.sight is Sight.STARTING
    assert first.message
    seen = watched.settled()
    assert (occupied(seen) == (START != EMPTY)).all()
    assert seen.heights is not None
    assert seen.heights[chess.E1] == pytest.approx(95, abs=8)
    assert seen.offsets is not None
    assert np.nanmax(np.abs(seen.offsets)) < 8


def test_both_senses_tell_the_colours() -> None:
    watched = Watched(Use.BOTH, chess.Board())
    seen = watched.settled()
    assert (seen.log_likelihood.argmax(axis=1) == START).all()
    moved = watched.settled(after("e2e4"))
    wanted = START.copy()
    wanted[[chess.E2, chess.E4]] = EMPTY, WHITE
    assert (moved.log_likelihood.argmax(axis=1) == wanted).all()


def test_a_hand_gates_reading(depth: Watched) -> None:
    depth.settled()
    seen = depth.see(shot((*MEN, *ARM)))
    assert seen.hand
    assert (seen.log_likelihood == 0).all()
    moved = depth.settled(after("g1f3"))
    assert occupied(moved)[chess.F3]
    assert not occupied(moved)[chess.G1]
    depth.settled()


def test_a_bumped_board_is_found_and_read_again() -> None:
    watched = Watched(position=chess.Board())
    watched.settled()
    for k in range(20):
        seen = watched.see(shot(MEN, k % 2, (22.0, -13.0), 7.0))
    assert seen.valid
    assert (occupied(seen) == (START != EMPTY)).all()


@pytest.mark.parametrize("sight", [Sight.DARK, Sight.COVERED, Sight.MISMATCHED])
def test_it_recovers_by_itself(sight: Sight) -> None:
    watched = Watched(Use.BOTH, chess.Board())
    watched.settled()
    good = shot(MEN)
    assert good.colour is not None
    assert good.depth is not None
    bad = {
        Sight.DARK: replace(good, colour=(good.colour // 40).astype(np.uint8)),
        Sight.COVERED: replace(good, depth=np.zeros_like(good.depth)),
        Sight.MISMATCHED: replace(good, depth_time=99.0),
    }[sight]
    for _ in range(3):
        seen = watched.see(bad)
        assert seen.sight is sight
        assert seen.message
        assert (seen.log_likelihood == 0).all()
    assert (watched.settled().log_likelihood.argmax(axis=1) == START).all()


def test_without_a_board_it_says_so() -> None:
    watched = Watched()
    good = shot(MEN)
    assert good.colour is not None
    rng = np.random.default_rng(0)
    table = np.clip(
        np.linspace(60, 150, good.colour.size).reshape(good.colour.shape)
        + rng.normal(0, 2, good.colour.shape),
        0,
        255,
    )
    seen = watched.see(replace(good, colour=table.astype(np.uint8)))
    assert seen.sight is Sight.NO_BOARD
    assert seen.message


def test_a_wrong_set_up_is_read_as_it_is_not_as_it_was_told() -> None:
    watched = Watched(position=chess.Board())
    seen = watched.settled(after("e2e4"))
    assert occupied(seen)[chess.E4]
    assert not occupied(seen)[chess.E2]


def test_depth_reads_a_position_that_nobody_told() -> None:
    seen = Watched().settled(after("b1c3"))
    assert occupied(seen)[chess.C3]
    assert not occupied(seen)[chess.B1]


def test_colour_alone_waits_for_a_known_position() -> None:
    watched = Watched(Use.COLOUR)
    for k in range(7):
        seen = watched.see(shot(MEN, k % 2))
    assert seen.sight is Sight.STARTING
    assert "position" in seen.message
    watched.tracker.expect(START)
    assert (watched.settled().log_likelihood.argmax(axis=1) == START).all()


def test_view_and_picture_show_what_was_read(depth: Watched) -> None:
    seen = depth.settled()
    view = depth.tracker.view()
    assert view is not None
    assert view.observation is seen
    assert view.sighting is not None
    assert view.heights is not None
    assert view.hand is not None
    assert view.heights.shape == view.hand.shape
    assert {"health", "depth", "hand", "squares"} <= set(view.stages)
    assert any(row["name"] == "depth.noise" and row["source"] != "prior" for row in view.parameters)
    picture = annotate(view, 480)
    assert picture.dtype == np.uint8
    plain = annotate(replace(view, observation=Observation.blind(0.0, Sight.HAND, "Waiting: ü")), 480)
    assert picture.shape == plain.shape
    assert (picture != plain).any()


def test_a_picture_of_nothing_is_drawn_too() -> None:
    watched = Watched()
    watched.see(replace(shot(MEN), colour=None))
    view = watched.tracker.view()
    assert view is not None
    assert annotate(view, 320).ndim == 3


def test_each_layer_adds_to_the_bare_picture(depth: Watched) -> None:
    depth.settled()
    view = depth.tracker.view()
    assert view is not None
    assert view.hand is not None
    hand = np.zeros_like(view.hand)
    hand[:20, :20] = True
    view = replace(view, hand=hand)
    bare = layered(view, Ground.COLOUR, [], 480)
    assert bare is not None
    assert bare.shape[1] == 480
    for layer in Layer:
        drawn = layered(view, Ground.COLOUR, [layer], 480)
        assert drawn is not None
        assert (drawn != bare).any(), layer
    for ground in (Ground.DEPTH, Ground.ABOVE):
        assert layered(view, ground, [], 480) is not None
    blind = replace(view, frame=replace(view.frame, colour=None, depth=None), heights=None)
    assert [layered(blind, ground, list(Layer)) for ground in Ground] == [None, None, None]


def test_a_silent_camera_is_told() -> None:
    seen = Tracker.stale(7.0, 3.2)
    assert seen.sight is Sight.STALE
    assert "3.2 s" in seen.message


def test_overrides_are_checked() -> None:
    with pytest.raises(ConfigError, match="no parameter 'depth.nois'"):
        Tracker(TrackerSettings(overrides={"depth.nois": 1.0}))


def test_an_occupancy_is_as_good_as_a_board() -> None:
    assert set(START.tolist()) == {EMPTY, WHITE, BLACK}
    watched = Watched()
    watched.tracker.expect(START)
    assert (occupied(watched.settled()) == (START != EMPTY)).all()
    with pytest.raises(ValueError, match="64 numbers"):
        watched.tracker.expect([0, 1])
