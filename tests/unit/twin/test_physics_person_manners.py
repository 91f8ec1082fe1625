"""How the virtual person may go about a move: sliding, hesitating, laying down, holding a hand up."""

import numpy as np
import pytest

from kempelen.core.errors import TwinError
from kempelen.core.geometry import Array
from kempelen.testing.world_driver import SCENE, TICK, WorldDriver, at
from kempelen.twin.physics import World
from kempelen.twin.physics.person import manner

pytestmark = pytest.mark.physics


def watch(driver: WorldDriver, piece: str) -> tuple[Array, Array]:
    """Places of the piece and of the finger tips, tick by tick, until the hand is back."""
    places, tips = [], []
    while driver.world.person.busy:
        driver.wait(TICK, closed=True)
        truth = driver.world.piece(piece)
        places.append((truth.x, truth.y, truth.z))
        tips.append(driver.world.person.hand)
    return np.array(places), np.array(tips)


def test_a_piece_that_is_slid_stays_on_the_board(driver: WorldDriver) -> None:
    pawn = driver.world.nearest(*at("e2")[:2]).piece_id
    driver.world.person.carry(at("e2")[:2], at("e4"), slide=True)
    places, _ = watch(driver, pawn)
    assert places[:, 2].max() < 2.0
    assert driver.world.piece(pawn).distance(*at("e4")[:2]) < 3.5


def test_a_hesitating_hand_stops_over_other_squares(driver: WorldDriver) -> None:
    pawn = driver.world.nearest(*at("e2")[:2]).piece_id
    driver.world.person.carry(at("e2")[:2], at("e3"), via=(at("e4")[:2],), pause=0.4, exact=True)
    places, _ = watch(driver, pawn)
    for square in ("e4", "e3"):
        near = np.linalg.norm(places[:, :2] - at(square)[:2], axis=1) < 1.0
        high = places[:, 2] > 50
        assert (near & high).sum() * TICK >= 0.4
    assert driver.world.piece(pawn).distance(*at("e3")[:2]) < 0.5


def test_a_piece_may_be_laid_down(driver: WorldDriver) -> None:
    pawn = driver.world.nearest(*at("e2")[:2]).piece_id
    driver.world.person.carry(at("e2")[:2], at("e4"), lying=True)
    watch(driver, pawn)
    driver.settle(closed=True, at_most=5.0)
    assert driver.world.piece(pawn).tilt_rad > 1.2


def test_a_hand_is_held_over_the_board_and_touches_nothing(driver: WorldDriver) -> None:
    before = driver.world.pieces()
    done = driver.world.person.hover((*at("d5")[:2], 30.0), 1.0)
    _, tips = watch(driver, "wP1")
    assert done()
    over = np.linalg.norm(tips - [*at("d5")[:2], 30.0], axis=1) < 1.0
    assert over.sum() * TICK == pytest.approx(1.0, abs=0.15)
    assert driver.world.pieces() == before
    assert np.linalg.norm(tips[-1][:2] - at("d5")[:2]) > 400


def test_the_hand_is_at_the_piece_it_carries_and_no_faster_than_a_hand(driver: WorldDriver) -> None:
    knight = driver.world.nearest(*at("g1")[:2]).piece_id
    driver.world.person.carry(at("g1")[:2], at("f3"))
    places, tips = watch(driver, knight)
    carried = places[:, 2] > 5
    assert np.abs((tips - places)[carried][:, :2]).max() < 12
    assert (np.linalg.norm(np.diff(tips, axis=0), axis=1) / TICK).max() < 3000
    assert np.array_equal(driver.world.person.hand, tips[-1])


def test_paces_differ_and_are_seeded() -> None:
    def seconds(seed: int) -> float:
        driver = WorldDriver(World(SCENE, seed=seed))
        driver.world.person.carry(at("e2")[:2], at("e4"))
        while driver.world.person.busy:
            driver.wait(TICK, closed=True)
        return driver.world.time

    assert seconds(1) == seconds(1)
    assert len({seconds(seed) for seed in (1, 2, 3)}) == 3


def test_odd_wishes_are_refused(driver: WorldDriver) -> None:
    with pytest.raises(TwinError, match="does not stop for -1"):
        driver.world.person.carry(at("e2")[:2], at("e4"), pause=-1.0)
    with pytest.raises(TwinError, match="cannot hold a hand"):
        driver.world.person.hover((float("nan"), 0.0, 0.0), 1.0)
    assert not driver.world.person.busy


def test_a_request_s_words_become_a_manner() -> None:
    assert manner({"from": [0, 0]}) == {}
    told = manner({"slide": True, "lying": False, "via": [[1, 2]], "pause": 1})
    assert told == {"slide": True, "via": ((1.0, 2.0),), "pause": 1.0}
