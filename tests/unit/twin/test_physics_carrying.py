"""The robot's hand in physics: friction holds, notches centre, neighbours stay."""

import math

import chess
import mujoco
import numpy as np
import pytest

from kempelen.core.errors import FitError
from kempelen.core.geometry import Array, Transform
from kempelen.core.pieces import PRESETS
from kempelen.core.places import Place
from kempelen.core.table import Gripper, Table, Tray, start_layout
from kempelen.testing.world_driver import TICK, WorldDriver
from kempelen.twin.physics import Scene, World
from kempelen.twin.physics.gripper import Jaw
from kempelen.twin.physics.model import build_model

pytestmark = pytest.mark.physics

TABLE = Table()
START = start_layout(TABLE, chess.Board())


def make_driver(table: Table = TABLE, seed: int = 7) -> WorldDriver:
    return WorldDriver(World(Scene.from_layout(table, start_layout(table, chess.Board()), seed=seed)))


def above(place: str, height: float) -> Array:
    x, y, z = TABLE.centre(Place(place))
    return np.array([x, y, z + height])


def standing(world: World, place: Place) -> str:
    x, y, _ = world.scene.table.centre(place)
    return world.nearest(float(x), float(y)).piece_id


def off_centre(world: World, piece_id: str, place: Place) -> float:
    x, y, _ = world.scene.table.centre(place)
    return world.piece(piece_id).distance(float(x), float(y))


@pytest.mark.parametrize(
    ("kind", "source", "target"),
    [
        ("K", "e1", "e4"),
        ("Q", "left1", "d5"),
        ("R", "h8", "right3"),
        ("B", "c1", "h6"),
        ("N", "b8", "c6"),
        ("P", "d2", "d4"),
    ],
)
def test_each_kind_is_carried_upright_to_its_place(kind: str, source: str, target: str) -> None:
    driver = make_driver()
    world = driver.world
    piece_id = standing(world, Place(source))
    assert piece_id[1] == kind
    before = {p.piece_id: p for p in world.pieces()}
    driver.fetch(kind, Place(source))
    assert world.held() == piece_id
    driver.deliver(kind, Place(target))
    driver.settle(closed=False)
    assert world.held() is None
    assert off_centre(world, piece_id, Place(target)) < 0.2
    assert world.piece(piece_id).upright
    assert world.piece(piece_id).z == pytest.approx(0.0, abs=0.2)
    for other in world.pieces():
        if other.piece_id != piece_id:
            assert other.distance(before[other.piece_id].x, before[other.piece_id].y) < 1e-6
            assert other.upright


@pytest.mark.parametrize("angle", [i * math.tau / 8 for i in range(8)])
def test_the_notches_centre_a_piece_from_every_side(angle: float) -> None:
    driver = make_driver()
    source = TABLE.centre(Place("e2"))
    pawn = standing(driver.world, Place("e2"))
    driver.world.place(pawn, source[0] + 3.0 * math.cos(angle), source[1] + 3.0 * math.sin(angle))
    driver.settle(closed=False)
    driver.transfer("P", Place("e2"), Place("e4"))
    assert off_centre(driver.world, pawn, Place("e4")) < 0.2


@pytest.mark.parametrize("name", ["thesis", "small"])
def test_other_sets_are_carried_too(name: str) -> None:
    driver = make_driver(Table(pieces=PRESETS[name]))
    for kind, source, target in (("K", "e1", "e5"), ("P", "a2", "a3"), ("Q", "d8", "right4")):
        piece_id = standing(driver.world, Place(source))
        driver.transfer(kind, Place(source), Place(target))
        assert off_centre(driver.world, piece_id, Place(target)) < 0.3


def test_a_turned_table_with_trays_of_other_heights_and_another_closing_axis() -> None:
    table = Table(
        robot_from_board=Transform.about_z(0.2, (200.0, 25.0, 3.0)),
        trays=(
            Tray(name="left", origin=(-90.0, 25.0), height=-15.0),
            Tray(name="right", origin=(440.0, 25.0), height=12.0),
        ),
        gripper=Gripper(closing_axis=0.2),
    )
    driver = make_driver(table)
    for kind, source, target in (("Q", "left1", "d4"), ("N", "g1", "right1"), ("P", "c2", "left5")):
        piece_id = standing(driver.world, Place(source))
        driver.transfer(kind, Place(source), Place(target))
        driver.settle(closed=False)
        assert off_centre(driver.world, piece_id, Place(target)) < 0.2
        assert driver.world.piece(piece_id).upright
        height = float(table.centre(Place(target))[2])
        assert driver.world.piece(piece_id).z == pytest.approx(height, abs=0.2)


def test_an_open_gripper_carries_nothing() -> None:
    driver = make_driver()
    driver.go(TABLE.grip_point(Place("e2"), chess.PAWN), 120.0, closed=False)
    driver.go(TABLE.grip_point(Place("e4"), chess.PAWN), 120.0, closed=False)
    assert standing(driver.world, Place("e2")).startswith("wP")
    assert driver.world.held() is None


def test_a_paused_hand_does_not_lose_its_piece() -> None:
    driver = make_driver()
    pawn = standing(driver.world, Place("e2"))
    driver.fetch("P", Place("e2"))
    driver.go(above("e4", 130.0), 130.0, closed=True)
    driver.wait(1.0, closed=True)
    assert driver.world.settled()
    height = driver.world.piece(pawn).z
    driver.wait(600.0, closed=True)
    assert driver.world.held() == pawn
    assert driver.world.piece(pawn).z == pytest.approx(height, abs=1e-6)
    driver.deliver("P", Place("e4"))
    assert off_centre(driver.world, pawn, Place("e4")) < 0.2


def test_opening_in_the_air_drops_the_piece() -> None:
    driver = make_driver()
    king = standing(driver.world, Place("e1"))
    driver.fetch("K", Place("e1"))
    driver.go(above("e4", 150.0), 150.0, closed=True)
    driver.wait(0.5, closed=False)
    assert driver.world.piece(king).z < 40.0


def test_the_tool_follows_its_set_points() -> None:
    driver = make_driver()
    driver.fetch("P", Place("e2"))
    x, y, z = driver.world.tool_mm
    for k in range(1, 60):
        target = (x, y - 0.048 * k * k / 2, z + 0.096 * k * k / 2)
        driver.world.step(TICK, target, gripper_closed=True)
        assert driver.world.tool_mm == pytest.approx(target, abs=0.01)


def test_robot_and_pieces_share_no_constraint_but_contact() -> None:
    model = build_model(Scene.from_layout(TABLE, START))
    joints = {model.joint(name).id for name in ("left", "right")}
    assert model.neq == 1
    assert model.eq_type[0] == mujoco.mjtEq.mjEQ_JOINT
    assert {model.eq_obj1id[0], model.eq_obj2id[0]} == joints
    assert model.ntendon == 0
    assert model.nexclude == 0
    pieces = {p.piece_id for p in Scene.from_layout(TABLE, START).pieces}
    assert all(model.body(name).parentid[0] == 0 for name in pieces)


def test_fingers_too_thin_for_their_notch_are_refused() -> None:
    with pytest.raises(FitError, match=r"4\.0 mm thick.* needs"):
        Jaw.of(Gripper(opening=31.0, finger_thickness=4.0))
