"""The world apart from carrying: scenes, rest, falls, snapshots, bad input."""

import itertools
import json
import math
from collections.abc import Sequence
from dataclasses import replace

import chess
import numpy as np
import pytest

from kempelen.core.errors import FitError, TwinError
from kempelen.core.places import Place
from kempelen.core.table import start_layout
from kempelen.testing.world_driver import SCENE, TABLE, TICK, WorldDriver
from kempelen.twin.physics import Scene, StandingPiece, World

pytestmark = pytest.mark.physics


def test_pieces_start_off_centre_turned_and_repeatably() -> None:
    layout = start_layout(TABLE, chess.Board())
    assert len(SCENE.pieces) == 34
    assert Scene.from_layout(TABLE, layout, seed=3) == SCENE
    assert Scene.from_layout(TABLE, layout, seed=4) != SCENE
    offsets = [min(math.dist(TABLE.centre(q)[:2], (p.x, p.y)) for q in TABLE.places) for p in SCENE.pieces]
    assert 2.0 < max(offsets) <= 3.0
    assert len({p.turn for p in SCENE.pieces}) == 34


def test_everything_stands_where_the_scene_says(driver: WorldDriver) -> None:
    assert driver.world.time == 0.0
    for piece, truth in zip(SCENE.pieces, driver.world.pieces(), strict=True):
        assert (truth.piece_id, truth.kind, truth.white) == (piece.piece_id, piece.kind, piece.white)
        assert truth.distance(piece.x, piece.y) < 0.01
        assert truth.upright


def test_sleeping_pieces_do_not_creep(driver: WorldDriver) -> None:
    before = driver.world.pieces()
    driver.wait(2.0, closed=True)
    driver.go(np.array([300.0, 200.0, 150.0]), 200.0, closed=True)
    driver.wait(2.0, closed=False)
    assert driver.world.settled()
    assert driver.world.pieces() == before


def test_time_goes_on_in_every_state(driver: WorldDriver) -> None:
    driver.wait(1.0, closed=False)
    driver.wait(1.0, closed=True)
    assert driver.world.time == pytest.approx(2.0)


def test_the_gripper_is_not_settled_while_its_fingers_move(driver: WorldDriver) -> None:
    driver.settle(closed=True)
    driver.wait(TICK, closed=False)
    assert not driver.world.settled()
    driver.wait(0.3, closed=False)
    assert driver.world.settled()


def test_a_knocked_over_piece_is_seen(driver: WorldDriver) -> None:
    x, y, _ = TABLE.centre(Place("e4"))
    driver.world.place("wP1", float(x), float(y))
    driver.settle(closed=True)
    assert driver.world.piece("wP1").upright
    driver.world.knock_over("wP1", turn=1.0)
    driver.settle(closed=True, at_most=10.0)
    lying = driver.world.piece("wP1")
    assert not lying.upright
    assert math.degrees(lying.tilt_rad) > 60.0
    assert -1.0 < lying.z < 25.0


def test_a_finger_pushes_what_stands_in_its_way(driver: WorldDriver) -> None:
    rook = min(driver.world.pieces(), key=lambda p: p.distance(*TABLE.centre(Place("h1"))[:2]))
    driver.go(np.array([rook.x, rook.y - 60.0, 45.0]), 150.0, closed=True)
    driver.go(np.array([rook.x, rook.y, 45.0]), 45.0, closed=True)
    driver.wait(1.0, closed=True)
    after = driver.world.piece(rook.piece_id)
    assert after.distance(rook.x, rook.y) > 5.0


def test_a_piece_pushed_over_the_edge_falls_to_the_table(driver: WorldDriver) -> None:
    driver.world.place("bP1", 350.0, -20.0)
    driver.settle(closed=True)
    assert driver.world.piece("bP1").z == pytest.approx(-20.0, abs=0.2)


def test_a_removed_piece_is_far_away_and_at_rest(driver: WorldDriver) -> None:
    driver.world.remove("wP1")
    driver.world.remove("wP2")
    driver.settle(closed=True)
    gone = driver.world.piece("wP1")
    assert gone.x < -500.0
    assert gone.distance(driver.world.piece("wP2").x, driver.world.piece("wP2").y) > 40.0


@pytest.mark.parametrize("moment", [0.05, 0.6, 0.9, 1.05, 1.6, 2.0])
def test_a_restored_world_goes_on_exactly(driver: WorldDriver, moment: float) -> None:
    script = _transfer_set_points(driver)
    cut = int(moment / TICK)
    for target, closed in script[:cut]:
        driver.world.step(TICK, target, closed)
    other = World(SCENE, seed=99)
    other.restore(driver.world.snapshot())
    assert other.snapshot() == driver.world.snapshot()
    for target, closed in script[cut:]:
        driver.world.step(TICK, target, closed)
        other.step(TICK, target, closed)
    assert other.tool_mm == driver.world.tool_mm
    assert other.pieces() == driver.world.pieces()
    assert other.snapshot() == driver.world.snapshot()


def _transfer_set_points(driver: WorldDriver) -> list[tuple[tuple[float, float, float], bool]]:
    """What a transfer tells the world, recorded on a copy; the driver gets a fresh world at the start."""
    told: list[tuple[tuple[float, float, float], bool]] = []

    class Recorder(World):
        def step(self, dt: float, target: Sequence[float], gripper_closed: bool) -> None:
            x, y, z = target
            told.append(((x, y, z), gripper_closed))
            super().step(dt, target, gripper_closed)

    x, y, z = TABLE.grip_point(Place("e2"), chess.PAWN)
    start = (float(x), float(y), float(z + 100.0))
    WorldDriver(Recorder(SCENE, joints=start)).transfer("P", Place("e2"), Place("e4"))
    driver.world = World(SCENE, seed=5, joints=start)
    return told


def test_the_same_seed_gives_the_same_world() -> None:
    worlds = [World(SCENE, seed=1), World(SCENE, seed=1)]
    for world in worlds:
        WorldDriver(world).transfer("N", Place("g1"), Place("f3"))
    assert worlds[0].snapshot() == worlds[1].snapshot()


def test_damaged_snapshots_are_named(driver: WorldDriver) -> None:
    snapshot = driver.world.snapshot()
    state = json.loads(snapshot)
    for damaged in (
        b"",
        b"\xff\x00",
        b"[]",
        snapshot[:-20],
        json.dumps({**state, "version": 99}).encode(),
        json.dumps({**state, "numbers": "AAAA"}).encode(),
        json.dumps({**state, "asleep": [1, 2]}).encode(),
        json.dumps({**state, "pieces": [{"piece_id": "x"}]}).encode(),
    ):
        with pytest.raises(TwinError):
            driver.world.restore(damaged)
    driver.world.restore(snapshot)


def test_impossible_targets_are_refused(driver: WorldDriver) -> None:
    with pytest.raises(TwinError, match="5000 mm/s"):
        driver.world.step(TICK, (700.0, 400.0, 100.0), gripper_closed=True)
    with pytest.raises(TwinError):
        driver.world.step(TICK, (math.nan, 0.0, 200.0), gripper_closed=True)


def test_unknown_pieces_are_named(driver: WorldDriver) -> None:
    with pytest.raises(TwinError, match="no piece 'wX1'.*wK1"):
        driver.world.piece("wX1")


def test_a_world_that_breaks_says_so(driver: WorldDriver) -> None:
    simulation = driver.world._simulation
    simulation.put(0, np.array([300.0, 200.0, 50.0]), simulation.attitude(0), np.array([0.0, 0.0, 1e16]))
    with pytest.raises(TwinError, match="physics broke down"):
        driver.wait(0.1, closed=True)
    World(SCENE).step(TICK, (0.0, 0.0, 200.0), gripper_closed=True)


@pytest.mark.parametrize(
    ("piece", "words"),
    [
        (replace(SCENE.pieces[0], piece_id="x", kind="X"), "kind 'X'"),
        (replace(SCENE.pieces[0], piece_id="x", x=math.inf), "not finite"),
        (SCENE.pieces[0], "Two pieces are called"),
    ],
)
def test_bad_scenes_are_refused(piece: StandingPiece, words: str) -> None:
    with pytest.raises(FitError, match=words):
        SCENE.with_pieces([piece])


def test_a_table_without_pieces_is_a_table() -> None:
    driver = WorldDriver(World(Scene(TABLE, ())))
    driver.go(np.array([100.0, 100.0, 30.0]), 50.0, closed=False)
    driver.settle(closed=True)
    assert driver.world.pieces() == []
    assert driver.world.held() is None


def test_surfaces_under_a_point() -> None:
    for place in itertools.islice(TABLE.places, 0, None, 7):
        x, y, z = map(float, TABLE.centre(place))
        assert SCENE.surface(x, y) == pytest.approx(z)
    assert SCENE.surface(-300.0, -300.0) == -20.0
