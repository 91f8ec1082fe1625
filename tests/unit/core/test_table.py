from itertools import pairwise
from math import pi

import chess
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from kempelen.core.errors import FitError
from kempelen.core.geometry import Transform
from kempelen.core.pieces import KINDS
from kempelen.core.places import Place
from kempelen.core.table import DEFAULT_TRAYS, Gripper, Table, Tray, WorkSpace, pieces_off_board, start_layout


@given(angle=st.floats(-pi, pi), x=st.floats(-300, 300), square=st.floats(20, 80))
def test_squares_are_a_grid_in_the_boards_frame(angle: float, x: float, square: float) -> None:
    table = Table(robot_from_board=Transform.about_z(angle, (x, 20.0, 5.0)), square=square)
    board_from_robot = table.robot_from_board.inverse()
    for name, (i, j) in {"a1": (0, 0), "h1": (7, 0), "a8": (0, 7), "e4": (4, 3)}.items():
        centre = board_from_robot @ table.centre(Place(name))
        np.testing.assert_allclose(centre, [(i + 0.5) * square, (j + 0.5) * square, 0.0], atol=1e-9)


def test_slots_run_along_the_boards_side_then_outwards() -> None:
    tray = Tray(name="left", origin=(-90.0, 25.0), rows=8, columns=2, pitch=50.0, height=-3.0)
    np.testing.assert_allclose(tray.centre(1), [-90.0, 25.0, -3.0])
    np.testing.assert_allclose(tray.centre(8), [-90.0, 375.0, -3.0])
    np.testing.assert_allclose(tray.centre(9), [-40.0, 25.0, -3.0])
    assert [slot.name for slot in tray.slots[:2]] == ["left1", "left2"]
    assert len(tray.slots) == 16


def test_all_places_are_there_once() -> None:
    table = Table()
    assert len(table.places) == len(set(table.places)) == 64 + 32
    assert table.slots == table.places[64:]


def test_an_unknown_place_is_told_with_the_trays_there_are() -> None:
    with pytest.raises(FitError, match=r"no place 'left99'. Trays: left, right"):
        Table().centre(Place("left99"))


def test_trays_of_the_same_name_are_refused() -> None:
    with pytest.raises(FitError, match="Two trays have the same name: left, left"):
        Table(trays=(DEFAULT_TRAYS[0], DEFAULT_TRAYS[0]))


def test_each_kind_is_gripped_at_its_own_height_and_let_go_a_little_higher() -> None:
    table = Table()
    for kind in KINDS:
        grip = table.grip_point(Place("e4"), kind)
        np.testing.assert_allclose(
            grip - table.centre(Place("e4")), [0, 0, table.pieces[kind].grip_height], atol=1e-9
        )
        rise = table.release_point(Place("e4"), kind) - grip
        np.testing.assert_allclose(rise, [0, 0, table.gripper.release_height], atol=1e-9)


def test_centres_cannot_be_changed_from_outside() -> None:
    with pytest.raises(ValueError, match="read-only"):
        Table().centre(Place("e4"))[0] = 1.0


def test_the_hand_parks_high_at_the_nearer_side() -> None:
    table = Table()
    left, right = table.park_xs
    assert left < right
    assert table.park_point(table.centre(Place("b5")))[0] == left
    assert table.park_point(table.centre(Place("g5")))[0] == right
    parked = table.park_point(np.array([300.0, 77.0, 40.0]))
    assert parked[1] == 77.0
    assert parked[2] == table.park_height
    assert table.space.excess(parked) == 0.0
    hanging = max(table.pieces[kind].grip_height for kind in KINDS)
    assert table.park_height - hanging > table.pieces.tallest


def test_a_work_space_as_narrow_as_the_board_parks_at_its_edge() -> None:
    table = Table(space=WorkSpace(lower=(160.0, 0.0, 0.0), upper=(540.0, 450.0, 120.0)))
    assert table.park_xs == (160.0,)
    assert table.park_height == 120.0


@given(x=st.floats(-100, 900), y=st.floats(-100, 900), z=st.floats(-100, 900))
def test_excess_is_the_way_back_into_the_box(x: float, y: float, z: float) -> None:
    space = WorkSpace()
    point = np.array([x, y, z])
    inside = np.clip(point, space.lower, space.upper)
    assert space.excess(point) == pytest.approx(float(np.abs(point - inside).max()))


def test_travel_and_offset_put_the_box_inside_the_machine() -> None:
    space = WorkSpace(lower=(-10.0, 0.0, 5.0), upper=(90.0, 50.0, 25.0), margin=5.0)
    assert space.travel == (110.0, 60.0, 30.0)
    low = np.add(space.robot_from_machine, np.negative(space.travel))
    np.testing.assert_allclose(low, np.array(space.lower) - 5.0)
    np.testing.assert_allclose(space.robot_from_machine, np.array(space.upper) + 5.0)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"lower": (0, 500, 0)}, "y: lower 500.0 mm must be below upper 450.0 mm"),
        ({"velocity": (300, 0, 300)}, "y: velocity and acceleration must be above 0"),
        ({"acceleration": (-1, 1, 1)}, "x: velocity and acceleration must be above 0"),
        ({"upper": (float("inf"), 1, 1)}, "finite"),
        ({"margin": 60}, "less than or equal to 50"),
    ],
)
def test_impossible_work_spaces_are_refused(change: dict[str, object], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        WorkSpace.model_validate(change)


def test_open_fingers_reach_from_the_pads_to_their_outside() -> None:
    assert Gripper(opening=30.0, finger_thickness=6.0).half_length_open == 21.0


def test_the_game_begins_with_a_spare_queen_of_each_colour_in_the_trays() -> None:
    layout = start_layout(Table(), chess.Board())
    assert len(layout) == 34
    assert layout[Place("left1")] == chess.Piece.from_symbol("Q")
    assert layout[Place("right16")] == chess.Piece.from_symbol("q")
    assert layout.board_part() == chess.Board().piece_map()


def test_captured_pieces_of_a_position_wait_in_the_trays() -> None:
    board = chess.Board("4k3/8/8/8/8/8/8/4K3 w - - 0 1")
    layout = start_layout(Table(), board)
    assert len(layout) == 34
    assert len({place for place in layout if place.tray}) == 32
    white = [place for place, piece in layout.items() if piece.color and place.tray]
    assert {place.tray for place in white} == {"left"}


@pytest.mark.parametrize(
    ("fen", "off_white"),
    [
        ("4k3/8/8/8/8/8/PPPPPPPP/RNBQKBNR w KQ - 0 1", "Q"),
        ("4k3/8/8/8/8/Q7/PPPPPPP1/RNBQKBNR w KQ - 0 1", "P"),
        ("4k3/8/8/8/8/QQ6/PPPPPP2/RNBQKBNR w KQ - 0 1", "PP"),
        ("4k3/8/8/8/8/RN6/PPPPPP2/RNBQKBNR w KQ - 0 1", "QPP"),
    ],
)
def test_promoted_pieces_are_not_missing_from_the_trays(fen: str, off_white: str) -> None:
    off = pieces_off_board(chess.Board(fen), chess.WHITE)
    assert "".join(piece.symbol() for piece in off) == off_white


def test_too_few_slots_for_a_position_are_told() -> None:
    single = Tray(name="one", origin=(-90.0, 25.0), rows=1, columns=1)
    with pytest.raises(FitError, match="2 pieces stand beside the board, the trays have 1 slots"):
        start_layout(Table(trays=(single,)), chess.Board())


def test_surfaces_lie_under_their_places() -> None:
    raised = (DEFAULT_TRAYS[0].model_copy(update={"height": 12.0}), DEFAULT_TRAYS[1])
    pose = Transform.about_z(0.4, (150.0, 25.0, 7.0))
    table = Table(robot_from_board=pose, trays=raised)
    assert [surface.name for surface in table.surfaces] == ["board", "left", "right"]
    for surface in table.surfaces:
        for place in table.places:
            if (place.tray or "board") == surface.name:
                x, y, z = map(float, table.centre(place))
                assert surface.height(x, y) == pytest.approx(z)
                along, across = surface.local(x, y)
                assert 0 < along < surface.size[0]
                assert 0 < across < surface.size[1]


def test_a_tilted_surface_rises_with_the_board() -> None:
    c, s = np.cos(0.02), np.sin(0.02)
    pose = Transform(np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]), np.array([150.0, 25.0, 0.0]))
    board = Table(robot_from_board=pose).surfaces[0]
    heights = [board.height(x, 100.0) for x in (150.0, 250.0, 350.0)]
    assert [b - a for a, b in pairwise(heights)] == pytest.approx([100 * s / c] * 2)
    np.testing.assert_allclose(Table(robot_from_board=pose).upwards, pose.rotation[:, 2])
