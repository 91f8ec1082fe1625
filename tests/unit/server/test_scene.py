"""The 3D view's data: geometry, looks at a twin and at a journal, and what is news to whom."""

import asyncio
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import chess
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.errors import TwinError
from kempelen.core.geometry import Transform
from kempelen.core.places import Layout, Place
from kempelen.core.protocols import GripperState, RobotPhase, RobotState
from kempelen.core.table import Table, start_layout
from kempelen.server.scene import quaternion, scene_geometry
from kempelen.server.scene_feed import ABSENT_S, MOVING_S, RESTING_S, SceneFeed, scene_news, whole_scene
from kempelen.server.scene_source import JournalScene, Sample, TwinScene
from kempelen.server.topics import PieceView, SceneView


def turn(w: float, x: float, y: float, z: float) -> np.ndarray:
    """(3, 3) rotation of a unit quaternion."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_a_rotation_and_its_quaternion_are_the_same(parts: tuple[float, float, float, float]) -> None:
    w, x, y, z = np.array(parts) / np.linalg.norm(parts)
    rotation = turn(w, x, y, z)
    assert np.allclose(turn(*quaternion(Transform(rotation, np.zeros(3)))), rotation, atol=1e-9)


def test_the_geometry_is_that_of_the_table() -> None:
    table = Table(robot_from_board=Transform.about_z(0.1, (140.0, 30.0, 1.0)))
    geometry = scene_geometry(table, robot_kind="gantry", live=True)
    assert geometry.board.origin == (140.0, 30.0, 1.0)
    assert geometry.board.quaternion == pytest.approx((np.cos(0.05), 0, 0, np.sin(0.05)))
    assert set(geometry.shapes) == set("KQRBNP")
    assert geometry.shapes["K"].height == table.pieces.king.height
    left = geometry.trays[0]
    assert [slot.name for slot in left.slots][:2] == ["left1", "left2"]
    assert left.slots[3].at == pytest.approx(table.centre(Place("left4")), abs=0.01)


def look(*pieces: PieceView, tool: float = 0.0, resting: bool = True, table: str = "one") -> Sample:
    return Sample(tool=(tool, 0.0, 0.0), closed=True, hand=None, pieces=pieces, resting=resting, table=table)


def pawn(number: int, x: float) -> PieceView:
    return PieceView(id=number, letter="P", at=(x, 0.0, 0.0))


def test_news_are_the_pieces_that_moved() -> None:
    news = scene_news(look(pawn(0, 1), pawn(1, 2)), look(pawn(0, 1), pawn(1, 3), pawn(2, 9)))
    assert news is not None
    assert not news.whole
    assert news.pieces == (pawn(1, 3), pawn(2, 9))


def test_a_piece_that_is_gone_makes_all_of_it_news() -> None:
    news = scene_news(look(pawn(0, 1), pawn(1, 2)), look(pawn(1, 2)))
    assert news == whole_scene(look(pawn(1, 2)))
    assert news is not None
    assert news.whole


class Looks:
    """A table that is seen as told, and what was published of it."""

    def __init__(self, *samples: Sample | TwinError | None) -> None:
        self.samples = list(samples)
        self.table: object | None = self
        self.wanted = True
        self.published: list[tuple[SceneView | None, SceneView | None]] = []
        self.made = 0
        self.feed = SceneFeed(
            self._source, lambda: self.table, lambda: self.wanted, lambda *views: self.published.append(views)
        )

    def _source(self) -> "Looks":
        self.made += 1
        return self

    async def sample(self) -> Sample | None:
        sample = self.samples.pop(0) if len(self.samples) > 1 else self.samples[0]
        if isinstance(sample, TwinError):
            raise sample
        return sample


async def test_nobody_looks_when_nobody_wants_to_see() -> None:
    looks = Looks(look(pawn(0, 1)))
    looks.wanted = False
    assert await looks.feed.step() == ABSENT_S
    assert not looks.made
    assert not looks.published


async def test_a_look_is_published_once_and_whole_at_first() -> None:
    looks = Looks(look(pawn(0, 1)), look(pawn(0, 1)), look(pawn(0, 2), resting=False))
    assert [await looks.feed.step() for _ in range(3)] == [RESTING_S, RESTING_S, MOVING_S]
    (first, first_whole), (second, second_whole) = looks.published
    assert first == first_whole == whole_scene(look(pawn(0, 1)))
    assert second is not None
    assert second.pieces == (pawn(0, 2),)
    assert not second.whole
    assert second_whole == whole_scene(look(pawn(0, 2)))


async def test_deltas_put_together_are_the_whole_scene() -> None:
    rng = np.random.default_rng(3)
    samples = [look(*(pawn(i, float(rng.integers(4))) for i in range(8))) for _ in range(30)]
    looks, page = Looks(*samples), dict[int, PieceView]()
    for _ in samples:
        await looks.feed.step()
    for news, whole in looks.published:
        assert news is not None
        assert whole is not None
        page = ({} if news.whole else page) | {piece.id: piece for piece in news.pieces}
        assert tuple(page[key] for key in sorted(page)) == whole.pieces


async def test_another_table_is_whole_again_and_an_absent_one_is_none() -> None:
    looks = Looks(look(pawn(0, 1)))
    await looks.feed.step()
    looks.table = None
    assert await looks.feed.step() == ABSENT_S
    looks.table = object()
    await looks.feed.step()
    assert looks.made == 2
    assert [view and view.whole for view, _ in looks.published] == [True, None, True]


async def test_a_twin_that_ends_is_an_empty_scene_until_it_is_back() -> None:
    looks = Looks(look(pawn(0, 1)), TwinError("gone", hint=""), look(pawn(0, 1)))
    assert [await looks.feed.step() for _ in range(3)] == [RESTING_S, ABSENT_S, RESTING_S]
    assert [view and view.whole for view, _ in looks.published] == [True, None, True]


async def test_being_woken_ends_the_wait() -> None:
    looks = Looks(look(pawn(0, 1)), look(pawn(0, 5)))
    looks.wanted = False
    task = asyncio.create_task(looks.feed.run())
    await asyncio.sleep(0)
    looks.wanted = True
    looks.feed.wake()
    async with asyncio.timeout(ABSENT_S / 2):
        while not looks.published:  # noqa: ASYNC110 - a list that the feed fills
            await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task


async def test_a_twins_truth_as_a_look() -> None:
    truth: Mapping[str, Any] = {
        "pieces": [
            {"id": "bN1", "kind": "N", "white": False, "x": 1.04, "y": 2.0, "z": 0, "q": [1, 0, 0, 0.00001]}
        ],
        "tool": [1, 2, 3.333],
        "closed": False,
        "hand": [4, 5, 6],
        "resting": False,
    }

    async def ask() -> Mapping[str, Any] | None:
        return truth

    sample = await TwinScene(ask, Table).sample()
    assert sample is not None
    assert sample.pieces == (PieceView(id=0, letter="n", at=(1.0, 2.0, 0.0)),)
    assert (sample.tool, sample.closed, sample.hand, sample.resting) == ((1, 2, 3.3), False, (4, 5, 6), False)


# --- a real table -------------------------------------------------------------------------------------------


class Fake:
    """The little of a game's state that is looked at."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.pending: Any = None


class Carrying:
    """A move in hand."""

    def __init__(self, source: str) -> None:
        self.at_hand = type("T", (), {"source": Place(source)})()
        self.carrying = True


async def test_on_a_machine_the_held_piece_hangs_at_the_tool_and_numbers_stay() -> None:
    table = Table()
    state = Fake(start_layout(table, chess.Board()))
    robot = RobotState(
        phase=RobotPhase.MOVING, reported_position=(300.0, 200.0, 150.0), gripper=GripperState.CLOSED
    )
    scene = JournalScene(lambda: state, lambda: table, lambda: robot)  # type: ignore[arg-type,return-value]

    async def at(x: float, y: float) -> PieceView:
        pieces = (await scene.sample()).pieces
        return next(piece for piece in pieces if np.hypot(piece.at[0] - x, piece.at[1] - y) < 1)

    e2, e4 = table.centre(Place("e2")), table.centre(Place("e4"))
    before = await at(e2[0], e2[1])
    assert not (await scene.sample()).resting
    state.pending = Carrying("e2")
    held = await at(300.0, 200.0)
    assert held.id == before.id
    assert held.at[2] == pytest.approx(150.0 - table.pieces.pawn.grip_height)
    state.pending = None
    state.layout = state.layout.without(Place("e2")).having(Place("e4"), chess.Piece.from_symbol("P"))
    assert (await at(e4[0], e4[1])).id == before.id
    assert len({piece.id for piece in (await scene.sample()).pieces}) == len(state.layout)
    robot = replace(robot, phase=RobotPhase.IDLE, gripper=GripperState.OPEN)
    assert (await scene.sample()).resting


async def test_a_machine_that_is_not_homed_has_no_tool_and_no_game_no_pieces() -> None:
    scene = JournalScene(lambda: None, Table, RobotState)
    sample = await scene.sample()
    assert sample.tool is None
    assert sample.pieces == ()
