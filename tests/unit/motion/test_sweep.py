"""The independent check: every kind of contact is found, against dense sampling with shapes spelled out."""

import random
from math import cos, hypot, pi, sin

import chess
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from tests.unit.motion.motion_tables import WIDE, distance_to_box, placed, samples

from kempelen.core.geometry import Array, Transform
from kempelen.core.pieces import PieceShape
from kempelen.core.places import Place
from kempelen.core.table import Gripper, Table, Tray
from kempelen.motion.plan import plan_approach, plan_leave
from kempelen.motion.scene import Clearances, Scene
from kempelen.motion.sweep import Contact, _to_box, slack, sweep

TABLE = Table()
KING, PAWN = TABLE.pieces.king, TABLE.pieces.pawn


def over(place: str, z: float) -> tuple[float, float, float]:
    x, y, _ = TABLE.centre(Place(place))
    return float(x), float(y), z


def path(*points: tuple[float, float, float]) -> Array:
    return np.array(points, dtype=np.float64)


def found(contacts: list[Contact]) -> set[tuple[str, str]]:
    return {(contact.part, contact.what) for contact in contacts}


# --- each kind of contact --------------------------------------------------------------------------------


def test_the_carried_base_over_a_pawn() -> None:
    scene = Scene(TABLE, placed(d4="p"))
    z = PAWN.height + KING.grip_height
    touching = sweep(path(over("a4", z - 4), over("h4", z - 4)), scene, KING)
    assert found(touching) == {("the carried piece", "the black pawn on d4")}
    assert touching[0].depth == pytest.approx(4 + slack(scene))
    assert sweep(path(over("a4", z + 1), over("h4", z + 1)), scene, KING) == []


def test_the_carried_base_beside_a_piece() -> None:
    """It is the width at that height that counts, and that the piece may stand 3 mm off centre."""
    scene = Scene(TABLE, placed(d4="k"))
    room = KING.base_diameter + Clearances().off_centre + slack(scene)
    x, y, _ = over("d4", 0)
    for gap, wanted in ((0.01, set()), (-0.01, {("the carried piece", "the black king on d4")})):
        line = path((x - room - gap, y - 90, 52.0), (x - room - gap, y + 90, 52.0))
        assert found(sweep(line, scene, KING)) == wanted


def test_a_finger_on_a_neighbour() -> None:
    scene = Scene(TABLE, placed(d4="k"))
    x, y, _ = over("d4", 0)
    beside = TABLE.gripper.half_length_open + KING.base_diameter / 2 + Clearances().off_centre + slack(scene)
    for gap, wanted in ((0.01, set()), (-0.01, {("a finger", "the black king on d4")})):
        assert (
            found(sweep(path((x - beside - gap, y, 150), (x - beside - gap, y, 30)), scene, None)) == wanted
        )


def test_a_finger_coming_down_on_the_head() -> None:
    scene = Scene(TABLE, placed(d4="k"))
    x, y, grip = over("d4", KING.grip_height)
    assert sweep(path((x, y, 150), (x, y, grip)), scene, None) == []
    aside = 1.5
    assert ("a finger", "the black king on d4") in found(
        sweep(path((x + aside, y, 150), (x + aside, y, grip)), scene, None)
    )


def test_fingers_going_too_deep_reach_the_foot() -> None:
    scene = Scene(TABLE, placed(d4="k"))
    x, y, grip = over("d4", KING.grip_height)
    assert found(sweep(path((x, y, 150), (x, y, grip - 5)), scene, None)) == {
        ("a finger", "the black king on d4")
    }


def test_moving_aside_before_the_head_is_cleared() -> None:
    scene = Scene(TABLE, placed(d4="k"))
    x, y, grip = over("d4", KING.grip_height)
    early = path((x, y, grip), (x, y, grip + 40), (x + 60, y, grip + 40), (x + 60, y, 150))
    assert ("a finger", "the black king on d4") in found(sweep(early, scene, None))


def test_the_palm_on_a_tall_piece() -> None:
    short = TABLE.gripper.model_copy(update={"finger_length": 45.0})
    table = Table(gripper=short)
    scene = Scene(table, placed(d4="p", e4="k"))
    x, y, grip = over("d4", PAWN.grip_height)
    assert found(sweep(path((x, y, 150), (x, y, grip)), scene, None)) == {
        ("the palm", "the black king on e4")
    }


def test_the_head_of_the_carried_piece_is_not_forgotten() -> None:
    """A wide-headed piece held low: its head reaches a tall neighbour where base and fingers do not."""
    mushroom = PieceShape(height=60, base_diameter=20, head_diameter=46, grip_height=10, grip_diameter=10)
    scene = Scene(TABLE, placed(d4="k"))
    x, y, _ = over("d4", 0)
    side = 23 + KING.head_diameter / 2 + Clearances().off_centre - 1
    contacts = sweep(path((x - side, y - 60, 50), (x - side, y + 60, 50)), scene, mushroom)
    assert found(contacts) == {("the carried piece", "the black king on d4")}


def test_scraping_over_the_board() -> None:
    scene = Scene(TABLE, placed())
    (x, y, grip), (u, v, _) = over("d4", KING.grip_height), over("f6", 0)
    up, down = (x, y, grip + 3), (u, v, grip + 3)
    assert sweep(path((x, y, grip), up, down, (u, v, grip)), scene, KING) == []
    for bad in (
        path((x, y, grip), (u, v, grip)),
        path((x, y, grip), (x + 2, y, grip), up, down, (u, v, grip)),
        path((x, y, grip), up, (u, v, grip + 0.1), (u, v, grip)) - np.array([0, 0, 0.2]),
    ):
        assert ("the carried piece", "the board") in found(sweep(bad, scene, KING))


def test_the_edge_of_a_higher_tray() -> None:
    tray = Tray(name="left", origin=(-90.0, 25.0), height=20.0)
    scene = Scene(Table(trays=(tray,)), placed())
    (x, y, grip) = over("a4", KING.grip_height)
    out = path((x, y, grip), (x, y, grip + 15), (x - 100, y, grip + 15), (x - 100, y, grip + 40))
    assert found(sweep(out, scene, KING)) == {("the carried piece", "the left")}
    assert sweep(out + np.array([0, 0, 6.0]), scene, KING) == []


def test_leaving_the_work_space() -> None:
    scene = Scene(TABLE, placed())
    (contact,) = sweep(path((100, 100, 150), (100, 100, 203.5)), scene, None)
    assert (contact.part, contact.what, contact.depth) == ("the tool point", "the work space's end", 3.5)
    assert str(contact) == (
        "the tool point would touch the work space's end by 3.5 mm at (100.0, 100.0, 203.5) mm"
    )


def test_the_deepest_comes_first_and_each_pair_once() -> None:
    scene = Scene(TABLE, placed(c4="p", d4="k", e4="p"))
    contacts = sweep(path(over("a4", 80), over("h4", 80)), scene, KING)
    assert next(c for c in contacts if c.part == "the carried piece").what == "the black king on d4"
    assert len(found(contacts)) == len(contacts)
    assert [c.depth for c in contacts] == sorted((c.depth for c in contacts), reverse=True)


# --- what is not a contact -------------------------------------------------------------------------------


@pytest.mark.parametrize("vertices", [path((100, 100, 100)), path((100, 100, 100), (100, 100, 100))])
def test_standing_still_in_the_open_touches_nothing(vertices: Array) -> None:
    assert sweep(vertices, Scene(TABLE, placed(d4="k")), None) == []
    assert sweep(vertices, Scene(TABLE, placed()), None) == []


def test_on_a_leaning_board_the_base_must_be_clear_with_its_lower_rim() -> None:
    lean = 0.02
    tilt = np.array([[cos(lean), 0, sin(lean)], [0, 1, 0], [-sin(lean), 0, cos(lean)]])
    scene = Scene(Table(robot_from_board=Transform(tilt, np.array([150.0, 25, 30])), space=WIDE), placed())
    (x, y, z), (u, v, w) = scene.table.centre(Place("b4")), scene.table.centre(Place("g4"))
    rim = KING.base_diameter / 2 * np.tan(lean)
    for gap, wanted in ((0.02, set()), (-0.02, {("the carried piece", "the board")})):
        lift = KING.grip_height + slack(scene) + rim + gap
        line = path((x, y, z + 60), (x, y, z + lift), (u, v, w + lift), (u, v, w + 60))
        assert found(sweep(line[:, :], scene, KING)) == wanted


@given(st.integers(0, 2**32 - 1))
def test_the_distance_of_a_segment_from_a_box(seed: int) -> None:
    rng = random.Random(seed)
    box = (rng.uniform(-20, 0), rng.uniform(1, 20), rng.uniform(-9, 0), rng.uniform(1, 9))
    p, q = ((rng.uniform(-40, 40), rng.uniform(-40, 40)) for _ in range(2))
    steps = np.linspace(0, 1, 2001)
    dense = min(
        distance_to_box(p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), box) for t in steps.tolist()
    )
    assert _to_box(p, q, box) == pytest.approx(dense, abs=0.06)


def test_a_leaning_table_is_served_too() -> None:
    lean = Transform(
        np.array([[cos(0.02), 0, sin(0.02)], [0, 1, 0], [-sin(0.02), 0, cos(0.02)]]),
        np.array([-200.0, -200, 20]),
    )
    table = Table(robot_from_board=lean, space=WIDE)
    scene = Scene(table, placed(d4="K", e4="p"))
    plan = plan_approach(scene, (0.0, -300.0, 200.0), Place("d4"))
    assert plan_leave(scene, plan.vertices[-1], (0.0, -300.0, 200.0)).seconds == pytest.approx(
        plan.seconds, rel=1e-3
    )


# --- against dense sampling ------------------------------------------------------------------------------


def touches(vertices: Array, scene: Scene, held: PieceShape | None) -> float:
    """Deepest lateral overlap with any piece, by brute force: every 0.5 mm, shapes as plain as can be."""
    table, gripper = scene.table, scene.table.gripper
    off, spread = scene.clearances.off_centre, slack(scene)
    inner = gripper.opening / 2 if held is None else held.grip_diameter / 2
    outer, half = inner + gripper.finger_thickness, gripper.finger_width / 2
    c, s = cos(gripper.closing_axis), sin(gripper.closing_axis)
    deepest = 0.0
    for x, y, z in samples(vertices):
        for place, piece in scene.standing.items():
            px, py, pz = table.centre(place)
            shape = table.pieces[piece.piece_type]
            hx, hy = c * (px - x) + s * (py - y), c * (py - y) - s * (px - x)
            fingers = min(
                distance_to_box(hx, hy, (inner, outer, -half, half)),
                distance_to_box(hx, hy, (-outer, -inner, -half, half)),
            )
            parts = [(z - gripper.below_tool, z + gripper.finger_length, fingers)]
            parts.append((z + gripper.finger_length, np.inf, hypot(hx, hy) - gripper.palm_radius))
            if held is not None:
                low = z - held.grip_height
                parts.append((low, z, hypot(hx, hy) - held.base_diameter / 2))
                head = max(held.head_diameter, held.grip_diameter) / 2
                parts.append((z, low + held.height, hypot(hx, hy) - head))
            waist = pz + shape.grip_height
            cylinders = [(pz, waist, shape.base_diameter / 2)]
            cylinders.append((waist, pz + shape.height, max(shape.head_diameter, shape.grip_diameter) / 2))
            for bottom, top, gap in parts:
                for low, high, radius in cylinders:
                    if bottom < high + spread and top > low - spread:
                        deepest = max(deepest, radius + off + spread - gap)
    return deepest


@settings(max_examples=90)
@given(st.integers(0, 2**32 - 1))
def test_it_agrees_with_dense_sampling(seed: int) -> None:
    rng = random.Random(seed)
    gripper = Gripper(closing_axis=rng.uniform(-pi, pi), finger_length=rng.choice([40.0, 95.0]))
    table = Table(gripper=gripper, robot_from_board=Transform.about_z(rng.uniform(-pi, pi)), space=WIDE)
    squares = rng.sample(chess.SQUARE_NAMES, 12)
    scene = Scene(table, placed(**{square: rng.choice("KQRBNP") for square in squares}))
    start, end = (table.centre(Place(rng.choice(chess.SQUARE_NAMES))) for _ in range(2))
    points = [
        start
        + (end - start) * share
        + np.array([rng.uniform(-9, 9), rng.uniform(-9, 9), rng.uniform(20, 150)])
        for share in (0.0, 0.4, 1.0)
    ]
    assume(scene.gripped_at(tuple(points[0])) is None)
    held = table.pieces[rng.randrange(1, 7)] if rng.random() < 0.6 else None
    vertices = np.array(points)
    pieces = [c for c in sweep(vertices, scene, held) if c.what[-2:] in chess.SQUARE_NAMES]
    deepest = touches(vertices, scene, held)
    if deepest > 0.3:
        assert pieces, f"sampling finds {deepest:.2f} mm"
    if pieces and pieces[0].depth > 0.6:
        assert deepest > 0.0, str(pieces[0])
