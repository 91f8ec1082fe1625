"""Where the hand is said to be clear, MuJoCo finds no contact."""

import chess
import mujoco
import numpy as np
import pytest

from kempelen.core.geometry import Array
from kempelen.core.places import Place
from kempelen.testing.world_driver import SCENE, TABLE, WorldDriver
from kempelen.twin.physics import World

pytestmark = pytest.mark.physics


def touches(world: World, tool: Array) -> bool:
    simulation = world._simulation
    simulation.joints = tool
    mujoco.mj_forward(simulation.model, simulation.data)
    hand = int(simulation.model.body("slide_x").id)
    owners = simulation.model.geom_bodyid[simulation.data.contact.geom]
    return bool((owners >= hand).any())


@pytest.mark.parametrize("opened", [True, False])
def test_a_clear_hand_touches_nothing(opened: bool) -> None:
    world = World(SCENE)
    world.place("wP1", 300.0, 230.0)
    world.knock_over("wP1")
    WorldDriver(world).settle(closed=not opened, at_most=10.0)
    world._look_around()
    rng = np.random.default_rng(1)
    clear = touching = 0
    for _ in range(600):
        near = world.pieces()[rng.integers(len(SCENE.pieces))]
        tool = np.array([near.x, near.y, near.z]) + rng.uniform((-45, -45, 5), (45, 45, 110))
        slack = world._clearance.slack(tool, opened=opened)
        touch = touches(world, tool)
        assert slack <= 0 or not touch
        clear += slack > 0
        touching += touch
    assert clear > 100
    assert touching > 100


def test_gliding_and_integrating_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    glider, integrator = World(SCENE), World(SCENE)
    before = glider.pieces()
    monkeypatch.setattr(integrator, "_clear", lambda _length: False)
    for world in (glider, integrator):
        driver = WorldDriver(world)
        driver.go(np.array([300.0, 150.0, 40.0]), 120.0, closed=False)
        driver.go(TABLE.grip_point(Place("g1"), chess.KNIGHT), 120.0, closed=False)
        driver.wait(0.2, closed=False)
    assert glider.tool_mm == pytest.approx(integrator.tool_mm, abs=1e-3)
    assert glider.time == pytest.approx(integrator.time)
    assert glider.pieces() == integrator.pieces() == before
