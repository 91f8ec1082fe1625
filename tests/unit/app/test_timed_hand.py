"""Transfers timed on the robot's own clock."""

from typing import Any, cast

import chess
import pytest

from kempelen.app.timed_hand import TimedHand
from kempelen.core.places import Place, Transfer
from kempelen.core.protocols import Checkpoint
from kempelen.core.table import Table, start_layout
from kempelen.robots.hand import CartesianHand
from kempelen.testing.rigs import MemoryRig
from kempelen.twin.client import TwinControl

TABLE = Table()
START = start_layout(TABLE, chess.Board())
KNIGHT = Transfer(chess.Piece(chess.KNIGHT, chess.WHITE), Place("g1"), Place("f3"))


class Twin:
    """Its robot has worked for so many seconds."""

    def __init__(self, *busy: float) -> None:
        self.busy = iter(busy)

    async def ask(self, op: str) -> dict[str, Any]:
        assert op == "stats"
        return {"busy_s": next(self.busy)}


async def test_on_a_twin_its_clock_counts() -> None:
    reached: list[Checkpoint] = []

    async def checkpoint(at: Checkpoint) -> None:
        reached.append(at)

    async with MemoryRig() as rig, rig.robot() as robot:
        hand = TimedHand(CartesianHand(robot, TABLE))
        await hand.prepare()
        hand.control = cast("TwinControl", Twin(100.0, 101.5, 104.0))
        report = await hand.carry(KNIGHT, START, checkpoint)
    assert (report.seconds, report.carry) == (4.0, 2.5)
    assert report.bound > 0
    assert reached == [Checkpoint.GRIPPING, Checkpoint.CARRYING, Checkpoint.RELEASED]


async def test_on_a_machine_it_is_the_hands_own() -> None:
    ticks = iter(range(1000))
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = TimedHand(CartesianHand(robot, TABLE, clock=lambda: float(next(ticks))))
        await hand.prepare()

        async def checkpoint(_at: Checkpoint) -> None:
            return None

        report = await hand.carry(KNIGHT, START, checkpoint)
    assert report.seconds > report.carry >= 1.0
    assert report.seconds == pytest.approx(round(report.seconds))
