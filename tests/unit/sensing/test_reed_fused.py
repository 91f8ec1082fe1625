"""Sensors put together; one that fails is left out by name."""

import asyncio
from collections.abc import AsyncIterator

import chess
import numpy as np
import pytest

from kempelen.core.geometry import Array
from kempelen.core.senses import Observation, Sight, states_of
from kempelen.sensing import fused
from kempelen.sensing.fused import FusedSensor, sum_of
from kempelen.testing.eyes import ScriptedSensor


def sure(board: chess.BaseBoard, by: float = 0.98) -> Array:
    rest = (1 - by) / 2
    return np.log(np.where(np.eye(3)[states_of(board)] > 0, by, rest))


def seen(board: chess.BaseBoard, time: float = 0.0) -> Observation:
    return Observation(sure(board), time)


def blind(message: str = "unplugged") -> Observation:
    return Observation.blind(0.0, Sight.STALE, message)


class Rig:
    """Two sensors and a clock that ticks with each look."""

    def __init__(self) -> None:
        self.reed, self.camera = ScriptedSensor(), ScriptedSensor()
        self.told: list[str] = []
        self.now = 0.0
        both = {"reed": self.reed, "camera": self.camera}
        self.sensor = FusedSensor(both, self.told.append, lambda: self.now)
        self.looks: AsyncIterator[Observation] = self.sensor.observe()

    async def look(self, count: int = 1, step: float = 0.0) -> Observation:
        for _ in range(count):
            self.now += step
            async with asyncio.timeout(5):
                out = await anext(self.looks)
        return out


@pytest.fixture
async def rig() -> AsyncIterator[Rig]:
    made = Rig()
    yield made
    await made.looks.aclose()  # type: ignore[attr-defined]


def test_two_that_agree_are_surer_than_one_and_no_one_outvotes_all() -> None:
    board = chess.Board()
    one, both = seen(board), Observation(sum_of([seen(board), seen(board)]), 0.0)
    assert (both.occupancy.max(axis=1) > one.occupancy.max(axis=1)).all()
    mad = Observation(np.where(np.eye(3)[states_of(chess.BaseBoard(None))] > 0, 0.0, -1e9), 0.0)
    three = Observation(sum_of([mad, *[seen(board)] * 5]), 0.0)
    assert three.occupancy.argmax(axis=1).tolist() == states_of(board).tolist()


async def test_they_are_put_together_and_a_hand_in_one_view_is_a_hand(rig: Rig) -> None:
    board = chess.Board()
    rig.reed.show(seen(board))
    rig.camera.show(seen(board))
    assert (await rig.look(5)).valid
    rig.reed.show(Observation.blind(0.0, Sight.HAND, "A hand is moving pieces."))
    together = await rig.look(5)
    assert together.hand
    assert together.message == "A hand is moving pieces."


async def test_one_that_is_gone_is_left_out_and_comes_back(rig: Rig) -> None:
    board = chess.Board()
    rig.reed.show(seen(board))
    rig.camera.show(seen(board))
    await rig.look(3)
    rig.reed.show(blind("The cable is out."))
    assert not (await rig.look(4, 0.1)).valid
    assert (await rig.look(30, 0.1)).valid
    assert rig.sensor.left_out == {"reed": "The cable is out."}
    assert rig.told == ["The reed is left out: The cable is out. The board is read without it."]
    rig.reed.show(seen(board))
    await rig.look(30, 0.1)
    assert rig.sensor.left_out == {}
    assert rig.told[1:] == ["The reed counts again."]


async def test_one_that_reads_something_else_than_what_stands_is_left_out(rig: Rig) -> None:
    board, other = chess.Board(), chess.Board("8/8/8/8/8/8/8/K6k w - - 0 1")
    rig.reed.show(seen(other))
    rig.camera.show(seen(board))
    await rig.look(5)
    rig.sensor.stands(board)
    assert rig.told == []
    rig.sensor.stands(board)
    assert list(rig.sensor.left_out.values()) == ["it reads 31 squares otherwise than they are"]
    assert (await rig.look(3)).occupancy[chess.E2].argmax() == 1
    rig.reed.show(seen(board))
    await rig.look(5)
    rig.sensor.stands(board)
    assert rig.told[1:] == ["The reed counts again."]


async def test_when_all_fail_nobody_is_left_out_and_the_reason_is_told(rig: Rig) -> None:
    rig.reed.show(blind("The cable is out."))
    rig.camera.show(blind("The lens is covered."))
    said = await rig.look(40, fused.PATIENCE_S / 10)
    assert not said.valid
    assert rig.sensor.left_out == {}
    assert said.message in {"The cable is out.", "The lens is covered."}
