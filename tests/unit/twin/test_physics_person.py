"""The virtual person's hand."""

import math

import pytest

from kempelen.core.errors import TwinError
from kempelen.core.places import Place
from kempelen.testing.world_driver import SCENE, TABLE, TICK, WorldDriver, at
from kempelen.twin.physics import Scene, World

pytestmark = pytest.mark.physics


def test_a_piece_is_carried_with_a_human_s_precision(driver: WorldDriver) -> None:
    before = driver.world.pieces()
    pawn = driver.world.nearest(*at("e7")[:2]).piece_id
    done = driver.world.person.carry(at("e7")[:2], at("e5"))
    assert driver.world.person.busy
    assert not done()
    driver.settle(closed=True, at_most=5.0)
    assert done()
    after = driver.world.piece(pawn)
    assert 0.01 < after.distance(*at("e5")[:2]) <= 2.2
    assert after.upright
    for was, now in zip(before, driver.world.pieces(), strict=True):
        assert now.piece_id == pawn or now == was


def test_errands_queue(driver: WorldDriver) -> None:
    victim = driver.world.nearest(*at("d7")[:2]).piece_id
    queen = driver.world.nearest(*at("d1")[:2]).piece_id
    first = driver.world.person.carry(at("d7")[:2], at("left9"))
    second = driver.world.ask_person(queen, at("d7")[:2])
    while not first():
        driver.wait(TICK, closed=True)
    assert not second()
    driver.settle(closed=True, at_most=6.0)
    assert second()
    assert driver.world.piece(victim).distance(*at("left9")[:2]) < 2.5
    assert driver.world.piece(queen).distance(*at("d7")[:2]) < 2.5


def test_the_robot_may_carry_meanwhile(driver: WorldDriver) -> None:
    knight = driver.world.nearest(*at("b1")[:2]).piece_id
    done = driver.world.person.carry(at("g8")[:2], at("f6"))
    driver.transfer("N", Place("b1"), Place("c3"))
    driver.settle(closed=False, at_most=5.0)
    assert done()
    assert driver.world.piece(knight).distance(*at("c3")[:2]) < 0.2


def test_a_fallen_piece_is_stood_up(driver: WorldDriver) -> None:
    driver.world.place("wP1", *at("e4")[:2])
    driver.world.knock_over("wP1")
    driver.settle(closed=True, at_most=10.0)
    assert not driver.world.piece("wP1").upright
    driver.world.ask_person("wP1", at("a4")[:2])
    driver.settle(closed=True, at_most=5.0)
    assert driver.world.piece("wP1").upright
    assert driver.world.piece("wP1").distance(*at("a4")[:2]) < 2.5


def test_a_new_piece_is_brought(driver: WorldDriver) -> None:
    driver.fetch("P", Place("e2"))
    before = {p.piece_id: p for p in driver.world.pieces()}
    held = driver.world.held()
    done = driver.world.person.supply("Q", white=True, target=at("e4"))
    driver.settle(closed=True, at_most=8.0)
    assert done()
    brought = driver.world.nearest(*at("e4")[:2])
    assert (brought.kind, brought.white, brought.upright) == ("Q", True, True)
    assert len(driver.world.pieces()) == 35
    assert driver.world.held() == held
    for piece_id, was in before.items():
        assert piece_id == held or driver.world.piece(piece_id) == was
    driver.deliver("P", Place("e3"))
    assert driver.world.nearest(*at("e3")[:2]).distance(*at("e3")[:2]) < 0.2


def test_a_snapshot_in_mid_errand_goes_on_exactly(driver: WorldDriver) -> None:
    driver.world.person.supply("N", white=False, target=at("e4"))
    driver.world.person.carry(at("a2")[:2], at("a4"))
    driver.wait(0.9, closed=True)
    other = World(SCENE, seed=77)
    other.restore(driver.world.snapshot())
    for _ in range(1000):
        driver.wait(TICK, closed=True)
        other.step(TICK, other.tool_mm, gripper_closed=True)
    assert not other.person.busy
    assert other.pieces() == driver.world.pieces()
    assert other.snapshot() == driver.world.snapshot()


def test_a_person_finds_only_what_is_there(driver: WorldDriver) -> None:
    with pytest.raises(TwinError, match="finds no piece within 25 mm"):
        driver.world.person.carry(at("e4")[:2], at("e5"))
    with pytest.raises(TwinError, match="cannot put"):
        driver.world.person.carry(at("e2")[:2], (math.nan, 0.0, 0.0))
    with pytest.raises(TwinError, match="finds no piece"):
        World(Scene(TABLE, ())).person.carry(at("e2")[:2], at("e4"))
    assert not driver.world.person.busy
