"""The drawn sets that the classifier learns from: whole meshes, right labels, the same again for a seed."""

from collections import Counter

import chess
import numpy as np
import pytest

from kempelen.bench.real_data import sighting_of
from kempelen.bench.sets.pictures import draw, random_board
from kempelen.bench.sets.samples import differing
from kempelen.bench.sets.shapes import KINDS, parts, random_style
from kempelen.sensing.kinds.classifier import PieceClassifier, labels_of
from kempelen.sensing.sighting import OUTER_CORNERS
from kempelen.twin.physics.opengl import opengl_library

SEED = 1_000_000
"""Not trained on."""


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(5))
def test_meshes_are_closed_and_stand_on_the_board(kind: str, seed: int) -> None:
    style = random_style(np.random.default_rng(seed))
    shapes = parts(style, kind)
    for part in shapes:
        assert np.isfinite(part.vertices).all()
        assert part.faces.max() < len(part.vertices)
    turned = shapes[0]
    edges = Counter(
        tuple(sorted(edge)) for face in turned.faces for edge in zip(face, np.roll(face, 1), strict=True)
    )
    single = [edge for edge, count in edges.items() if count != 2]
    rims = {round(float(turned.vertices[list(edge), 2].mean()), 6) for edge in single}
    assert len(rims) <= 2  # only the two ends of the axis, whose radius is next to nothing
    low, high = (
        f(part.vertices[:, 2].min() if f is min else part.vertices[:, 2].max() for part in shapes)
        for f in (min, max)
    )
    assert low == pytest.approx(0.0, abs=1e-9)
    assert high == pytest.approx(style.king * style.heights[kind], rel=0.12)
    assert max(np.abs(part.vertices[:, :2]).max() for part in shapes) < 0.5  # it fits its square


def test_kings_are_tallest_and_bishops_over_rooks_and_pawns() -> None:
    for seed in range(20):
        style = random_style(np.random.default_rng(seed))
        tall = {kind: max(part.vertices[:, 2].max() for part in parts(style, kind)) for kind in KINDS}
        assert max(tall, key=lambda kind: tall[kind]) == "K"
        assert tall["B"] > max(tall["R"], tall["P"])


def test_random_positions_show_all_kinds_of_both_colours() -> None:
    rng = np.random.default_rng(2)
    seen = Counter(piece.symbol() for _ in range(40) for piece in random_board(rng).piece_map().values())
    assert set(seen) == set("PNBRQKpnbrqk")


def test_positions_that_differ_on_few_squares_are_of_one_game() -> None:
    before, after = chess.Board(), chess.Board()
    after.push_san("e4")
    assert differing(before, after) == 2


def test_a_sighting_of_labelled_corners_starts_at_a8() -> None:
    corners = np.array([[10.0, 20.0], [210.0, 20.0], [210.0, 220.0], [10.0, 220.0]])
    sighting = sighting_of(corners)
    assert sighting.pixels(OUTER_CORNERS) == pytest.approx(corners[[3, 2, 1, 0]], abs=1e-3)


@pytest.mark.skipif(opengl_library() is None, reason="OpenGL does not work here")
def test_pictures_are_the_same_again_and_are_read_as_what_they_show() -> None:
    board = chess.Board()
    drawn, again = (draw(np.random.default_rng(SEED), board) for _ in range(2))
    assert (drawn.picture == again.picture).all()
    read = PieceClassifier().read(drawn.picture, drawn.sighting).argmax(axis=1)
    assert (read == labels_of(board)).mean() > 0.8
