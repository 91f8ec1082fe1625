"""Measuring the board again at a station, with a gantry in memory: while nobody plays, and in mid-game."""

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio

from kempelen.app.calibration_file import load_calibration
from kempelen.app.cast import GameRequest
from kempelen.core.errors import BusyError, CalibrationError, GameError, NotHomedError
from kempelen.core.protocols import GripperState
from kempelen.game.modes import Mode
from kempelen.testing.stations import MemoryStation

PLAY = GameRequest(Mode.PLAY)


@pytest_asyncio.fixture
async def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[MemoryStation]:
    async with MemoryStation(tmp_path, monkeypatch) as table:
        yield table


async def corners(
    table: MemoryStation, monkeypatch: pytest.MonkeyPatch, points: dict[str, tuple[float, float]]
) -> None:
    """The fingertips at these places of the table, one after the other."""
    for corner, (x, y) in points.items():
        monkeypatch.setattr("kempelen.app.calibrating.fingertips", lambda *_, x=x, y=y: (x, y, 0.5))
        await table.station.calibration_touch(corner)


async def test_the_board_is_measured_again_in_mid_game(
    table: MemoryStation, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = table.station
    await station.begin(PLAY)
    await table.asked()
    await station.move("e4")
    await table.until(lambda: table.live.arbiter.moving)
    await station.calibration_begin()
    assert table.live.arbiter.paused
    assert (table.live.arbiter.state.pending, station.robot.gripper) == (None, GripperState.CLOSED)
    with pytest.raises(GameError, match="being measured"):
        await station.resume()
    with pytest.raises(GameError, match="already"):
        await station.calibration_begin()
    with pytest.raises(CalibrationError, match="no corner"):
        await station.calibration_touch("e4")
    await station.jog("anna", (0, 0, -1), 50)
    with pytest.raises(BusyError, match="not at rest"):
        await station.calibration_touch("a1")
    await station.jog_stop("anna")
    await corners(table, monkeypatch, {"a1": (152.0, 26.0)})
    assert station.calibration.problem.startswith("1 corner(s) touched")
    with pytest.raises(CalibrationError):
        await station.calibration_apply()
    await corners(table, monkeypatch, {"h1": (552.0, 26.0), "h8": (552.0, 426.5)})
    state = station.calibration
    assert (state.active, state.problem, state.fits) == (True, "", ())
    assert state.square == pytest.approx(50, abs=0.1)
    assert dict(state.residuals).keys() == {"a1", "h1", "h8"}
    await station.calibration_apply(50.0)
    assert (station.calibration.active, table.live.arbiter.paused) == (False, False)
    kept = load_calibration(station.config.calibration_path)
    assert kept is not None
    assert kept.robot_from_board.translation[0] == pytest.approx(152, abs=0.5)
    used = table.live.session.hand.table.robot_from_board
    assert used.matrix == pytest.approx(kept.robot_from_board.matrix)
    await table.asked()
    assert table.live.board.ply() == 2


async def test_a_calibration_can_be_given_up_and_ends_with_the_table(
    table: MemoryStation, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = table.station
    await station.connect("gantry", "memory")
    with pytest.raises(NotHomedError):
        await station.calibration_begin()
    await station.home()
    await station.calibration_begin()
    with pytest.raises(GameError, match="no camera"):
        await station.calibration_by_camera()
    await corners(table, monkeypatch, {"a1": (150.0, 25.0), "h1": (150.0, 425.0), "h8": (550.0, 425.0)})
    assert "misnamed" in station.calibration.problem or "swapped" in station.calibration.problem
    await station.calibration_cancel()
    assert not station.calibration.active
    await station.calibration_begin()
    await station.disconnect()
    assert not station.calibration.active
    assert load_calibration(station.config.calibration_path) is None


async def test_a_calibration_of_the_idle_table_is_kept(
    table: MemoryStation, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = table.station
    await station.connect("gantry", "memory")
    await station.home()
    await station.calibration_begin()
    await corners(table, monkeypatch, {"a1": (151.0, 25.0), "h1": (551.0, 25.0)})
    await station.calibration_apply()
    assert station.session is not None
    assert station.session.hand.table.robot_from_board.translation[0] == pytest.approx(151)
    assert load_calibration(station.config.calibration_path) is not None
