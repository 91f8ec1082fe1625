"""The whole arm's swept test: what it finds, between samples too, and what it lets pass."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from tests.unit.motion.arm_cases import ARM, TABLE, scene
from tests.unit.motion.motion_tables import placed

from kempelen.core.geometry import Array
from kempelen.core.places import Layout, Place
from kempelen.kinematics import forward, frames
from kempelen.motion.arm.body import capsules, hand, prisms
from kempelen.motion.arm.grasp import pose_over
from kempelen.motion.arm.guidance import Pose, posture, straight
from kempelen.motion.arm.obstacles import gaps, obstacles
from kempelen.motion.arm.plan import ARM_CLEARANCES
from kempelen.motion.arm.sweep import Held, sweep_arm
from kempelen.motion.scene import Scene

KING_E4 = placed(e4="K")
E4 = TABLE.centre(Place("e4"))
PIECES = TABLE.pieces


def over(dx: float, dy: float, height: float, tilt: float = 0.0, roll: float = 0.0) -> Array:
    """Joints with the tool point beside e4's centre, ``height`` above the board."""
    return posture(ARM, pose_over(E4 + np.array([dx, dy, height]), tilt, roll), "test")


def touched(joints: list[Array], layout: Layout = KING_E4, held: Held | None = None) -> set[tuple[str, str]]:
    found = sweep_arm(ARM, scene(layout), np.stack(joints), held)
    return {(contact.part, contact.what) for contact in found}


def test_a_thin_meeting_between_two_far_samples_is_found() -> None:
    """Both ends are 60 mm from the king; between them a finger goes through it."""
    ends = [over(0, -60, 40), over(0, 60, 40)]
    assert ("a finger", "the white king on e4") in touched(ends)
    assert not touched([ends[0], ends[0]])
    assert not touched([ends[1], ends[1]])
    assert not touched(ends, placed(h1="K"))


def test_how_deep_it_would_go_is_told() -> None:
    king = PIECES.king
    above = over(0, 15, king.height + 3.0)  # a finger over the head; tips 5 mm below the tool point
    contact = sweep_arm(ARM, scene(KING_E4), np.stack((over(0, 15, king.height + 20), above)), None)[0]
    assert contact.depth == pytest.approx(2.0 + 0.32, abs=0.2)
    assert contact.at[2] == pytest.approx(66 + king.height + 3, abs=0.5)


@pytest.mark.parametrize(("height", "hit"), [(96, True), (102, False)])
def test_a_carried_piece_hangs_below(height: float, hit: bool) -> None:
    ends = [over(0, -45, height), over(0, 45, height)]
    held = Held(PIECES.king)
    assert (("the carried piece", "the white king on e4") in touched(ends, held=held)) is hit


def test_rigid_pads_lean_a_piece_that_leaves_its_tilt_and_hanging_ones_do_not() -> None:
    """Upright it passes beside the neighbour, leaning it does not."""
    beside = np.stack([over(-32.5, 0, 40, tilt=0.3), over(-32.5, 0, 41, tilt=0.3)])

    def hits(*, plumb: bool, gripped_at: float) -> bool:
        gripper = TABLE.gripper.model_copy(update={"plumb": plumb})
        standing = Scene(replace(TABLE, gripper=gripper), KING_E4, ARM_CLEARANCES)
        found = sweep_arm(ARM, standing, beside, Held(PIECES.king, gripped_at))
        return "the carried piece" in {contact.part for contact in found}

    assert not hits(plumb=False, gripped_at=0.3)
    assert hits(plumb=False, gripped_at=0.0)
    assert not hits(plumb=True, gripped_at=0.0)


def test_the_piece_between_the_fingers_is_let_pass_straight_up_and_nowhere_else() -> None:
    grip = TABLE.grip_point(Place("e4"), 6)
    start = pose_over(grip)
    lift = straight(ARM, start, Pose(start.azimuth, start.radius, grip[2] + 60), "lift")
    assert not sweep_arm(ARM, scene(KING_E4), lift, None)
    aside = Pose(start.azimuth + 0.05, start.radius, grip[2])
    move = straight(ARM, start, aside, "aside")
    assert [str(contact) for contact in sweep_arm(ARM, scene(KING_E4), move, None)]


def test_the_board_and_the_table_are_seen() -> None:
    empty = Layout({})
    low = [over(0, 0, 40), over(0, 0, 4.0)]
    assert touched(low, empty) == {("a finger", "the board")}
    held = Held(PIECES.king)
    assert not touched([over(0, 0, 33), over(0, 0, 50), over(0, 30, 50), over(0, 30, 33)], empty, held)
    slide = [over(0, 0, 33.1), over(0, 30, 33.1)]
    assert ("the carried piece", "the board") in touched(slide, empty, held)
    beyond = ARM.home + np.radians([0, -110, 0, 20, 0])
    assert ("the arm", "the table") in touched([ARM.home, beyond], empty)


def test_the_arm_itself_is_seen() -> None:
    folded = np.radians([0, 140, -147, 5, 0])
    through = np.radians([0, 149, -147, 180, 0])
    assert ("the arm", "itself") in touched([folded, through], Layout({}))


def test_the_forearm_against_a_piece() -> None:
    """Stretched out low, the arm's own links come down on the king."""
    high, low = (posture(ARM, Pose(0.067, 380, height, 1.4), "test") for height in (170, 115))
    assert ("the arm", "the white king on e4") in touched([high, low])
    assert not touched([high, high])


@settings(max_examples=20, deadline=None)
@given(
    st.floats(-40, 40), st.floats(-40, 40), st.floats(20, 90), st.floats(-0.3, 0.5),
    st.floats(-40, 40), st.floats(-40, 40), st.floats(20, 90), st.booleans(),
)  # fmt: skip
def test_whatever_dense_sampling_finds_the_sweep_finds(
    x0: float, y0: float, z0: float, tilt: float, x1: float, y1: float, z1: float, carrying: bool
) -> None:
    """The oracle: points on the hand's surface, at 120 postures, against the king's two cylinders."""
    assume(min(abs(x0) + abs(y0), abs(x1) + abs(y1)) > 1)  # not around the king, to grip it
    joints = np.stack((over(x0, y0, z0, tilt), over(x1, y1, z1, tilt)))
    held = Held(PIECES.pawn, tilt) if carrying else None
    contacts = sweep_arm(ARM, scene(KING_E4), joints, held)
    if inside(joints, held):
        assert contacts


def inside(joints: Array, held: Held | None) -> bool:
    """Whether a point of the fingers, taken from their definition, is ever within the king."""
    gripper, king = TABLE.gripper, PIECES.king
    inner = gripper.opening / 2 if held is None else held.shape.grip_diameter / 2
    box = np.array([
        (x, side * y, z)
        for x in np.linspace(-gripper.finger_width / 2, gripper.finger_width / 2, 5)
        for y in np.linspace(inner, inner + gripper.finger_thickness, 4)
        for z in np.linspace(-gripper.finger_length, gripper.below_tool, 16)
        for side in (-1, 1)
    ])  # fmt: skip
    way = joints[0] + np.linspace(0, 1, 120)[:, None] * (joints[1] - joints[0])
    pose = forward(ARM, way)
    points = np.einsum("sij,pj->spi", pose[:, :3, :3], box) + pose[:, None, :3, 3] - E4
    off, up = np.hypot(points[..., 0], points[..., 1]), points[..., 2]
    base = (off < king.base_diameter / 2) & (up > 0) & (up < king.grip_height)
    head = (off < king.head_diameter / 2) & (up > 0) & (up < king.height)
    return bool((base | head).any())


@settings(max_examples=40, deadline=None)
@given(st.floats(-0.5, 0.6), st.floats(-1.5, 1.5), st.floats(-60, 60), st.floats(-60, 60), st.floats(10, 100))
def test_distances_are_never_greater_than_the_true_ones(
    tilt: float, roll: float, x: float, y: float, height: float
) -> None:
    """The oracle: dense points of the open hand against the cylinders' own distance."""
    joints = over(x, y, height, tilt, roll)[None]
    shape = hand(ARM, TABLE.gripper, None)
    pose = forward(ARM, joints)
    parts = prisms(shape, pose)
    found = obstacles(scene(KING_E4), parts, open_hand=False)
    _, part, cylinder, gap = gaps(parts, found, np.array([60.0]))
    rng = np.random.default_rng(1)
    share = rng.random((400, 3))
    for index in (0, 1):
        local = np.stack([
            (2 * share[:, 0] - 1) * shape.half[index],
            shape.across[index, 0] + share[:, 1] * np.ptp(shape.across[index]),
            shape.along[index, 0] + share[:, 2] * np.ptp(shape.along[index]),
        ], axis=1)  # fmt: skip
        points = local @ pose[0, :3, :3].T + pose[0, :3, 3]
        for c in range(2):
            aside = np.linalg.norm(points[:, :2] - found.centre[c], axis=1) - found.radius[c]
            beside = np.maximum(found.bottom[c] - points[:, 2], points[:, 2] - found.top[c])
            true = float(np.hypot(np.maximum(aside, 0), np.maximum(beside, 0)).min())
            told = gap[(part == index) & (cylinder == c)]
            assert true > 60 or (len(told) and told.min() <= true + 1e-9)


def test_links_are_where_the_arm_is() -> None:
    found = capsules(ARM, frames(ARM, ARM.home)[None])
    assert found.start[0, 2] == pytest.approx([0, 0, 255], abs=1e-9)  # the upper arm from the shoulder ...
    assert found.end[0, 3] == pytest.approx(
        found.start[0, 4], abs=1e-9
    )  # ... to the wrist, where the hand begins
