"""An arm in physics: its links where the kinematics says, its hand as gentle as the gantry's."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import chess
import mujoco
import numpy as np
import pytest

from kempelen.core.errors import ConfigError, TwinError
from kempelen.core.geometry import Array, Transform
from kempelen.core.places import Place
from kempelen.kinematics import forward
from kempelen.testing.arm_driver import ARM, TABLE, TICK, ArmDriver, arm_world
from kempelen.twin.flaws import ArmFlaws
from kempelen.twin.physics import World
from kempelen.twin.physics.arm import TOOL
from kempelen.twin.physics.margin import GraspTrial, grasp_margin
from kempelen.twin.physics.mechanism import true_arm

pytestmark = pytest.mark.physics

NEIGHBOURS = dict.fromkeys(("c3", "c4", "c5", "d3", "d5", "e3", "e4", "e5"), "q")
AROUND_TARGET = dict.fromkeys(("f5", "f6", "f7", "g5", "g7", "h5", "h6", "h7"), "k")


def random_joints(seed: int) -> Array:
    low, high = ARM.ranges.T
    return np.asarray(np.random.default_rng(seed).uniform(low, high))


def tool_of(world: World, joints: Array) -> Array:
    """(4, 4) robot_from_tool by MuJoCo, mm."""
    simulation = world._simulation
    simulation.joints = joints
    mujoco.mj_kinematics(simulation.model, simulation.data)
    site = simulation.data.site(TOOL)
    return Transform(site.xmat.reshape(3, 3), site.xpos * 1e3).matrix


def test_the_bodies_stand_where_the_kinematics_says() -> None:
    world = arm_world({})
    for seed in range(20):
        joints = random_joints(seed)
        assert np.abs(tool_of(world, joints) - forward(ARM, joints)).max() < 1e-6
        assert np.abs(np.array(world.tool_mm) - forward(ARM, joints)[:3, 3]).max() < 1e-9


def test_an_arm_that_is_built_and_stands_otherwise_is_simulated_so() -> None:
    flaws = ArmFlaws(
        base=(2.0, -1.0, 0.5), base_turn=(0.0, 0.0, 0.01), lengths=((0.0, 1.5),) + 4 * ((1.0, 0.0),)
    )
    world = arm_world({}, arm=true_arm(ARM, flaws))
    tool = tool_of(world, ARM.home)[:3, 3]
    # At home the arm lies in the plane y = 0: one mm more of a at link 2 is up, at link 3 outwards ...
    plain = forward(ARM, ARM.home)[:3, 3] + [1.0, 0.0, 1.5 + 1.0]
    # ... and at links 4 and 5, whose x axes point outwards and, turned by 180°, back, nothing in all.
    expected = Transform.about_z(0.01, (2.0, -1.0, 0.5)) @ plain
    assert np.abs(tool - expected).max() < 1e-6


@pytest.mark.parametrize("kind", list(chess.PIECE_TYPES), ids=chess.piece_name)
@pytest.mark.parametrize("tilts", [(0.0, 0.0), (0.25, 0.1)])
def test_each_kind_is_carried_between_neighbours_at_any_tilt(
    kind: chess.PieceType, tilts: tuple[float, float]
) -> None:
    world = arm_world({"d4": chess.piece_symbol(kind).upper(), **NEIGHBOURS, **AROUND_TARGET})
    driver = ArmDriver(world)
    before = {piece.piece_id: piece for piece in world.pieces()}
    carried = next(piece.piece_id for piece in world.pieces() if piece.white)
    assert driver.transfer(kind, "d4", "g6", tilts) == carried
    driver.settle()
    piece, (x, y, z) = world.piece(carried), TABLE.centre(Place("g6"))
    assert piece.upright
    assert piece.distance(float(x), float(y)) < 0.2
    assert piece.z == pytest.approx(float(z), abs=0.2)
    others = [other for other in world.pieces() if other.piece_id != carried]
    assert all(other.distance(before[other.piece_id].x, before[other.piece_id].y) < 0.01 for other in others)


def test_rigid_pads_lean_a_piece_over_where_hanging_ones_do_not() -> None:
    errors = []
    for plumb in (True, False):
        table = replace(TABLE, gripper=TABLE.gripper.model_copy(update={"plumb": plumb}))
        world = arm_world({"d4": "Q"})
        world = World(replace(world.scene, table=table))
        driver = ArmDriver(world)
        driver.transfer(chess.QUEEN, "d4", "d5", (0.25, 0.25))
        driver.settle()
        x, y, _ = TABLE.centre(Place("d5"))
        errors.append(world.nearest(float(x), float(y)).distance(float(x), float(y)))
    assert errors[0] < 0.2
    assert errors[1] > 2.0


def recorded(integrate: Callable[..., None], steps: list[float]) -> Callable[..., None]:
    def record(dt: float, *args: Any, **named: Any) -> None:
        steps.append(dt)
        integrate(dt, *args, **named)

    return record


def test_where_nothing_can_be_touched_the_arm_glides(monkeypatch: pytest.MonkeyPatch) -> None:
    world = arm_world({"d4": "K", "h8": "P"})
    driver = ArmDriver(world)
    driver.wait(0.5, closed=False)
    steps: list[float] = []
    simulation = world._simulation
    monkeypatch.setattr(simulation, "integrate", recorded(simulation.integrate, steps))
    driver.swing(ARM.home + np.array([0.8, 0.0, 0.0, 0.0, 0.0]), closed=False)
    assert not steps
    driver.go(TABLE.grip_point(Place("d4"), chess.KING), 0.0, 200.0, closed=False)
    assert steps


def test_a_link_that_strikes_a_piece_knocks_it_over() -> None:
    world = arm_world({"e1": "K"})
    x, y, z = TABLE.centre(Place("e1")).tolist()
    driver = ArmDriver(world)
    driver.go(np.array([x - 45.0, y, z + 40.0]), 0.0, 200.0, closed=True)
    driver.line(np.array([x + 5.0, y, z + 40.0]), 0.0, closed=True)
    assert not world.nearest(x, y).upright


def test_coming_down_on_a_head_costs_the_arm_its_steps() -> None:
    world = arm_world({"d4": "Q"}, scatter=0.0)
    driver = ArmDriver(world)
    grip = TABLE.grip_point(Place("d4"), chess.QUEEN)
    beside = grip + 8.5 * np.array([-grip[1], grip[0], 0.0]) / np.hypot(grip[0], grip[1])
    driver.go(beside + np.array([0.0, 0.0, 40.0]), 0.0, 180.0, closed=False)
    assert not world.take_lost().any()
    behind = np.zeros(ARM.n)
    for k in range(1, 41):
        told = driver.joints(beside + np.array([0.0, 0.0, 40.0 - k]), 0.0)
        world.step(TICK, (told + behind).tolist(), gripper_closed=False)
        behind = behind + world.take_lost()
    assert world.tool_mm[2] > grip[2] + 15.0
    assert np.allclose(np.array(world.joints), told + behind, atol=1e-6)
    assert not world.take_lost().any()


def test_a_jump_of_the_joints_is_refused() -> None:
    world = arm_world({})
    with pytest.raises(TwinError, match=r"rad within 0\.008 s; the limit is 20 rad/s"):
        world.step(TICK, (ARM.home + 1.0).tolist(), gripper_closed=False)


def test_a_restored_arm_stands_as_it_was() -> None:
    world = arm_world({"d4": "K"})
    driver = ArmDriver(world)
    driver.transfer(chess.KING, "d4", "e5", (0.2, 0.0))
    again = arm_world({"d4": "K"})
    again.restore(world.snapshot())
    assert again.joints == world.joints
    assert again.pieces() == world.pieces()


def test_a_grasp_forgives_what_the_opening_leaves_beside_the_head() -> None:
    trial = GraspTrial(TABLE, ARM, chess.KNIGHT, Place("d4"))
    free = (TABLE.gripper.opening - TABLE.pieces[chess.KNIGHT].head_diameter) / 2
    assert trial.taken(0.0, 0.0, free - 0.2)
    assert not trial.taken(0.0, 0.0, free + 1.0)
    assert trial.taken(0.0, 1.5, 0.0)
    assert not trial.taken(0.0, 4.0, 0.0)  # gripped by the blades' edges, and not drawn to the middle


def test_the_margin_is_the_last_error_that_is_forgiven(monkeypatch: pytest.MonkeyPatch) -> None:
    limits = {"across": 3.1, "inwards": 0.0, "outwards": 6.2}

    def taken(_trial: GraspTrial, _tilt: float, radial: float, tangential: float) -> bool:
        way = "across" if tangential else "inwards" if radial < 0 else "outwards"
        return max(abs(radial), tangential) <= limits[way]

    monkeypatch.setattr(GraspTrial, "taken", taken)
    margin = grasp_margin(TABLE, ARM, chess.KNIGHT)
    assert (margin.across, margin.inwards, margin.outwards) == (3.0, 0.0, 6.0)
    assert margin.least == 0.0


def test_flaws_of_another_arm_are_refused() -> None:
    with pytest.raises(ConfigError, match="has 5 joints, flaws.lengths has 2 entries"):
        true_arm(ARM, ArmFlaws(lengths=((0.0, 0.0), (0.0, 0.0))))
