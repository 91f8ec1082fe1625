import numpy as np
import pytest

from kempelen.core.senses import BLACK, EMPTY, WHITE
from kempelen.sensing.depth.reader import DepthReader, DepthReading
from kempelen.testing.depth_scene import SQUARE, DepthScene, Post, men, start_men

START = np.array([WHITE] * 16 + [EMPTY] * 32 + [BLACK] * 16)


def over(reading: DepthReading) -> np.ndarray:
    """(64,) nats for a piece."""
    return reading.log_likelihood[:, WHITE] - reading.log_likelihood[:, EMPTY]


def taught(tilt: float, *, dark_step: float = 0.0, offset: float = 0.0) -> tuple[DepthReader, DepthScene]:
    scene = DepthScene(tilt=tilt, posts=start_men())
    reader = DepthReader()
    reader.learn(
        [scene.frame(noise=1.5, seed=k, dark_step=dark_step, offset=offset) for k in range(2)],
        scene.sighting,
        START,
    )
    return reader, scene


@pytest.mark.parametrize(("tilt", "dark_step"), [(0.0, 0.0), (20.0, 12.0), (45.0, 6.0)])
def test_every_square_of_a_game_is_read(tilt: float, dark_step: float) -> None:
    reader, _ = taught(tilt, dark_step=dark_step, offset=9.0)
    heights = {0: 55.0, 4: 95.0, 12: 45.0, 20: 60.0, 27: 45.0, 35: 45.0, 42: 85.0, 58: 70.0, 60: 95.0}
    scene = DepthScene(tilt=tilt, posts=men(heights, black=frozenset({42, 58, 60})))
    reading = reader.read(scene.frame(noise=1.5, seed=9, dark_step=dark_step, offset=9.0))
    occupied = np.isin(np.arange(64), list(heights))
    assert ((over(reading) > 0) == occupied).all()
    in_sight = occupied & (np.arange(64) != 12)  # the pawn on e2 stands behind the king
    assert over(reading)[in_sight].min() > 4
    assert over(reading)[~occupied].max() < -4
    assert (reading.log_likelihood[:, WHITE] == reading.log_likelihood[:, BLACK]).all()
    for square, height in heights.items():
        assert reading.heights[square] == pytest.approx(height, abs=7)
    assert np.nanmax(np.abs(reading.offsets)) < 6
    assert np.isnan(reading.offsets[~occupied]).all()


def test_a_board_never_seen_empty_is_read_at_once() -> None:
    scene = DepthScene(posts=start_men())
    reading = DepthReader().read(scene.frame(noise=2.0, dark_step=5.0), scene.sighting)
    assert ((over(reading) > 0) == (START != EMPTY)).all()


def test_an_empty_board_has_no_pieces() -> None:
    scene = DepthScene()
    reading = DepthReader().read(scene.frame(noise=4.0, dark_step=8.0), scene.sighting)
    assert (over(reading) < 0).all()


def test_offsets_tell_how_far_a_piece_stands_off() -> None:
    reader, _ = taught(20.0)
    scene = DepthScene(posts=[Post(4.5 * SQUARE + 9, 3.5 * SQUARE - 7, 60.0)])
    reading = reader.read(scene.frame(noise=1.5, seed=4))
    assert reading.offsets[28] == pytest.approx([9, -7], abs=4)


def test_a_lying_piece_is_low() -> None:
    reader, _ = taught(20.0)
    scene = DepthScene(posts=[Post(4.5 * SQUARE, 3.5 * SQUARE, 26.0, radius=20.0)])
    reading = reader.read(scene.frame(noise=1.5, seed=4))
    assert over(reading)[28] > 4
    assert reading.heights[28] < 30


def test_holes_say_piece_only_where_pieces_are_known_to_vanish() -> None:
    glossy = [Post((file + 0.5) * SQUARE, 7.5 * SQUARE, 60.0) for file in range(8)]
    white = [post for post in start_men() if post.y < 4 * SQUARE]
    shown = DepthScene(posts=white)
    position = np.where(np.arange(64) < 56, START, EMPTY)
    position[48:56] = EMPTY
    plain, warned = DepthReader(), DepthReader()
    plain.learn([shown.frame(noise=1.5)], shown.sighting, position)
    position[56:] = BLACK
    warned.learn([shown.frame(noise=1.5, holes=glossy)], shown.sighting, position)
    new = [Post(3.5 * SQUARE, 4.5 * SQUARE, 60.0)]
    frame = shown.frame(noise=1.5, seed=7, holes=new)
    assert warned.parameters["depth.vanish"] > 0.08 > plain.parameters["depth.vanish"]
    assert over(warned.read(frame))[35] > 1
    assert abs(over(plain.read(frame))[35]) < 3  # who knows


def test_lasting_blotches_are_learned_and_those_of_another_board_forgotten() -> None:
    scene = DepthScene()
    reader = DepthReader()
    # a blotch as high as a low piece is part of this camera's picture of the empty board
    blotch = Post(3.5 * SQUARE, 4.5 * SQUARE, 8.0, radius=18.0)
    blotched = DepthScene(posts=[blotch])
    empty = np.zeros(64, dtype=int)
    before = over(reader.read(blotched.frame(noise=1.0), scene.sighting))[35]
    reader.learn([blotched.frame(noise=1.0, seed=k) for k in range(4)], scene.sighting, empty)
    after = reader.read(blotched.frame(noise=1.0, seed=9))
    assert over(after)[35] < min(before, 0) - 1
    flat = reader.read(scene.frame(noise=1.0, seed=10))
    assert (over(flat) < -3).all()
    assert reader.reference.trust < 0.3


def test_what_is_overridden_stays() -> None:
    reader, scene = taught(20.0)
    reader.parameters.override("depth.empty_floor", 9.0)
    reader.parameters.override("depth.piece_height", 60.0)
    unsure = over(reader.read(scene.frame(noise=1.5, seed=5)))
    assert reader.parameters["depth.piece_height"] == 60.0
    reader.parameters.override("depth.empty_floor", None)
    reader.parameters.override("depth.piece_height", None)
    assert over(reader.read(scene.frame(noise=1.5, seed=5)))[:16].min() > unsure[:16].min()


def test_reading_before_a_board_was_placed_is_a_mistake() -> None:
    with pytest.raises(ValueError, match="placed"):
        DepthReader().read(DepthScene().frame())
