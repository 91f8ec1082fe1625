"""The station with the physics twin: games, e-stop and back, a calibration, the virtual hand."""

import asyncio
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from kempelen.app.cast import GameRequest
from kempelen.app.config import load_config
from kempelen.app.live_game import LiveGame
from kempelen.app.station import Station
from kempelen.app.station_types import GameOptions, Phase
from kempelen.core.errors import GameError, TwinError
from kempelen.core.places import Place
from kempelen.core.protocols import Follow, RobotPhase
from kempelen.game.clock import TimeControl
from kempelen.game.modes import Mode

pytestmark = pytest.mark.physics

PLAY = GameRequest(Mode.PLAY)


def station(data: Path) -> Station:
    settings = {"data.dir": str(data), "twin.speed": "max", "engine.level": "1", "engine.move_time": 0.05}
    return Station(load_config(None, settings))


async def until(table: Station, so: Callable[[], object]) -> None:
    """Looked at whenever something changes."""
    news = asyncio.Event()
    end = table.listen(lambda _: news.set())
    try:
        async with asyncio.timeout(60):
            while not so():
                news.clear()
                await news.wait()
    finally:
        end()


async def asked(table: Station) -> LiveGame:
    """Until the person is to move."""
    await until(table, lambda: table.playing and table.playing.cast.person.to_move)
    assert table.playing is not None
    return table.playing


def at(table: Station, square: str) -> tuple[float, float]:
    x, y, _ = table.require_session().table.centre(Place(square)).tolist()
    return x, y


async def pieces_near(table: Station, square: str) -> list[str]:
    """What truly stands on a square."""
    truth, (x, y) = await table.truth(), at(table, square)
    assert truth is not None
    return [p["kind"] for p in truth["pieces"] if abs(p["x"] - x) < 20 and abs(p["y"] - y) < 20]


async def test_stopped_in_mid_carry_mended_left_and_resumed(tmp_path: Path) -> None:
    async with station(tmp_path) as table:
        await table.begin(PLAY, GameOptions(clock=TimeControl(600, 2)))
        await asked(table)
        await table.move("e2e4", 0)
        await until(table, lambda: table.robot.phase is RobotPhase.MOVING)
        await table.stop()
        taken: list[str | None] = []
        while table.faults and len(taken) < 5:
            taken.append(table.faults[0].remedy)
            match taken[-1]:
                case "recover":
                    await table.recover()
                case "home":
                    await table.home()
                case _:
                    await table.resume_game()
        assert taken[-2:] == ["home", "resume_game"]
        game = await asked(table)
        assert game.board.ply() == 2
        assert await pieces_near(table, "e4") == ["P"]
        with pytest.raises(GameError, match="without a camera"):
            await table.hand_carry(at(table, "d2"), at(table, "d4"))
        await table.move("d4")
        await until(table, lambda: game.arbiter.moving)
        await table.leave_game()
        assert (table.phase, table.unfinished, await pieces_near(table, "e2")) == (Phase.READY, 1, ["P"])
        assert await table.resume_game() == 1
        await asked(table)
        assert table.clock is not None
        assert 600 < table.clock.white < 604
        assert (await pieces_near(table, "e2"), await pieces_near(table, "d4")) == ([], ["P"])


async def test_a_new_game_does_not_keep_people_waiting_for_the_twin_to_home(tmp_path: Path) -> None:
    async with station(tmp_path) as table:
        await table.set_speed(1)
        await table.begin(PLAY)
        assert table.robot.homed
        assert table.playing is not None


async def test_an_idle_twin_is_measured_and_moved_on_by_hand(tmp_path: Path) -> None:
    async with station(tmp_path) as table:
        await table.connect("gantry", "twin")
        await table.home()
        await table.calibration_begin()
        for corner, target in {"a1": (150.0, 25.0), "h1": (550.0, 25.0)}.items():
            await drive_to(table, *target, table.config.gripper.below_tool)
            await table.calibration_touch(corner)
        assert table.calibration.problem == ""
        assert dict(table.calibration.touched)["h1"] == pytest.approx((550, 25, 0), abs=0.05)
        await table.calibration_apply(50.0)
        await table.hand_carry(at(table, "e2"), at(table, "e5"))
        assert (await pieces_near(table, "e2"), await pieces_near(table, "e5")) == ([], ["P"])
        with pytest.raises(TwinError, match="no piece"):
            await table.hand_carry(at(table, "e4"), at(table, "e5"))
        with pytest.raises(GameError, match="off the table"):
            await table.hand_carry(at(table, "e5"), (9000.0, 0.0))
        await table.set_speed(50)
        assert table.speed == 50


async def drive_to(table: Station, x: float, y: float, z: float) -> None:
    """As if somebody had jogged there: across at the top, down, and where it is then is touched."""
    robot = table.require_session().robot
    here = robot.state.reported_position
    assert here is not None
    top = robot.space.upper[2]
    way = np.array([here, (here[0], here[1], top), (x, y, top), (x, y, z)])
    await robot.run([Follow(way, 5.0)])
