"""A person's moves, read off a board that nobody filmed."""

import asyncio

import chess
import numpy as np
import pytest

from kempelen.app.board_reader import CameraReader
from kempelen.core import events
from kempelen.core.senses import Observation
from kempelen.game.players import Propose, TakenBack
from kempelen.sensing.moves.parameters import MoveParameters
from kempelen.testing.eyes import ScriptedSensor
from kempelen.testing.observations import Sensor, with_changes


class Room:
    """A sensor, a reader, and what was told."""

    def __init__(self) -> None:
        self.sensor = Sensor(rate=30.0)
        self.shown = ScriptedSensor()
        self.told: list[events.Event] = []
        self.reader = CameraReader(lambda: self.shown, self.told.append)

    def stand(self, board: chess.Board, seconds: float = 2.0) -> None:
        self.reader.stands(board)
        for seen in self.sensor.watch(board, seconds):
            self.reader.glance(seen)

    async def read(self, board: chess.Board, *parts: list[Observation]) -> object:
        self.shown.show(*(seen for part in parts for seen in part))
        return await asyncio.wait_for(self.reader.read(board), 20)


@pytest.fixture
def room() -> Room:
    return Room()


def after(*moves: str) -> chess.Board:
    board = chess.Board()
    for san in moves:
        board.push_san(san)
    return board


async def test_a_move_is_named(room: Room) -> None:
    room.stand(chess.Board())
    hand, moved = list(room.sensor.hand()), list(room.sensor.watch(after("Nf3"), 3))
    assert await room.read(chess.Board(), hand, moved) == Propose(chess.Move.from_uci("g1f3"), made=True)
    assert room.told == []
    assert room.reader.looks == 60


async def test_moves_taken_back_are_told_as_such(room: Room) -> None:
    game = after("e4", "e5")
    room.stand(game)
    hand, before = list(room.sensor.hand()), list(room.sensor.watch(chess.Board(), 5))
    assert await room.read(game, hand, before) == TakenBack(2)


async def test_a_wrong_position_is_advised_upon_until_it_is_right(room: Room) -> None:
    room.stand(chess.Board())
    wrong = with_changes(chess.Board(), {"e2": "empty", "a5": "white"})
    parts = [
        list(room.sensor.hand()), list(room.sensor.watch(wrong, 5)),
        list(room.sensor.hand()), list(room.sensor.watch(after("d4"), 5)),
    ]  # fmt: skip
    assert await room.read(chess.Board(), *parts) == Propose(chess.Move.from_uci("d2d4"), made=True)
    first, last = room.told[0], room.told[-1]
    assert isinstance(first, events.BoardDiffers)
    assert "e2" in first.advice
    assert last == events.BoardDiffers("")
    assert not room.reader.stuck.is_set()


async def test_a_question_names_its_candidates(room: Room) -> None:
    """The square that would tell e3 from e4 is not to be made out."""
    room.stand(chess.Board())
    room.sensor.vague = frozenset({"e3", "e4"})
    room.shown.show(*room.sensor.hand(), *room.sensor.watch(after("e4"), 5))
    reading = asyncio.ensure_future(room.reader.read(chess.Board()))
    await asyncio.wait_for(room.reader.stuck.wait(), 20)
    asked = room.told[0]
    assert isinstance(asked, events.SensorUnsure)
    assert {"e2e3", "e2e4"} <= set(asked.candidates)
    assert chess.Move.from_uci("e2e4") in room.reader.candidates
    reading.cancel()
    await asyncio.gather(reading, return_exceptions=True)
    assert room.reader.candidates == ()


async def test_switched_off_it_reads_nothing(room: Room) -> None:
    room.stand(chess.Board())
    room.reader.switch(on=False)
    room.shown.show(*room.sensor.hand(), *room.sensor.watch(after("e4"), 5))
    reading = asyncio.ensure_future(room.reader.read(chess.Board()))
    for _ in range(300):
        await asyncio.sleep(0)
    assert not reading.done()
    assert room.reader.stuck.is_set()
    reading.cancel()
    await asyncio.gather(reading, return_exceptions=True)


async def test_while_the_robot_moves_nothing_is_learned(room: Room) -> None:
    room.stand(chess.Board())
    known = room.reader.look
    assert known is not None
    room.reader.moves()
    for seen in room.sensor.watch(after("e4"), 3):
        room.reader.glance(seen)
    assert room.reader.look is not None
    assert np.array_equal(room.reader.look, known)


async def test_until_a_turn_has_looks_of_its_own_the_others_are_learned_from(room: Room) -> None:
    """A turn reads frames taken after it began; the first comes a moment later."""
    board = chess.Board()
    room.reader.stands(board)
    reading = asyncio.ensure_future(room.reader.read(board))
    for seen in room.sensor.watch(board, 0.5):
        await asyncio.sleep(0)
        room.reader.glance(seen)
    assert room.reader.look is not None
    known = room.reader.look.copy()
    assert known[chess.E2].max() > 1 - MoveParameters().misread / 4
    room.shown.show(seen)
    for _ in range(20):
        await asyncio.sleep(0)
        room.reader.glance(room.sensor.see(board))
    assert np.array_equal(room.reader.look, known)
    room.shown.show(*room.sensor.hand(), *room.sensor.watch(after("Nf3"), 3))
    assert await asyncio.wait_for(reading, 20) == Propose(chess.Move.from_uci("g1f3"), made=True)
