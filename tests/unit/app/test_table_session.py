"""A table that is up: twin or machine, robot, hand; and what stands in the way."""

from pathlib import Path
from typing import Any

import chess
import pytest

from kempelen.app.config import Config, load_config
from kempelen.app.table_session import TableSession, calibrated_table, digest, make_robot, robot_kinds
from kempelen.core.errors import ConfigError, FitError, LinkError, TwinError
from kempelen.core.protocols import RobotPhase
from kempelen.core.table import Table, start_layout


def config_of(folder: Path, **options: Any) -> Config:
    settings = {"data.dir": str(folder), "twin.speed": "max"}
    return load_config(None, settings | {key.replace("__", "."): value for key, value in options.items()})


def session_of(config: Config, folder: Path) -> TableSession:
    table = Table()
    layout = start_layout(table, chess.Board())
    return TableSession(config, table, layout, state=folder / "twin" / "table.json", resume=False)


def test_drivers_are_found_by_their_kind(tmp_path: Path) -> None:
    assert "gantry" in robot_kinds()
    with pytest.raises(ConfigError, match="no driver for a robot of kind 'crane'"):
        make_robot(config_of(tmp_path, robot__kind="crane"), "/dev/null", Table())


def test_the_digest_changes_with_what_matters(tmp_path: Path) -> None:
    usual = digest(calibrated_table(config_of(tmp_path)))
    assert usual == digest(calibrated_table(config_of(tmp_path, engine__level="3")))
    assert usual != digest(calibrated_table(config_of(tmp_path, table__turn_degrees=0.5)))
    assert usual != digest(calibrated_table(config_of(tmp_path, table__square=49.0)))


def test_a_table_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FitError):
        calibrated_table(config_of(tmp_path, table__board=(900.0, 25.0, 0.0)))


@pytest.mark.physics
async def test_a_twin_of_our_own_comes_and_goes(tmp_path: Path) -> None:
    async with session_of(config_of(tmp_path), tmp_path) as session:
        assert session.twin is not None
        assert session.control is session.twin.control
        assert session.hand.control is session.control
        await session.robot.home()
        assert session.robot.state.phase is RobotPhase.IDLE
        assert session.hand.seconds_left() is None
    assert (tmp_path / "twin" / "table.json").is_file()


@pytest.mark.physics
async def test_a_robot_that_does_not_fit_takes_its_twin_down_with_it(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no driver"):
        await session_of(config_of(tmp_path, robot__kind="crane"), tmp_path).__aenter__()


async def test_a_port_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match="does not exist"):
        await session_of(config_of(tmp_path, robot__port="/dev/ttyNONE7"), tmp_path).__aenter__()


async def test_control_sockets(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="Name its port too"):
        await session_of(config_of(tmp_path, twin__control="/none"), tmp_path).__aenter__()
    absent = config_of(tmp_path, twin__control=str(tmp_path / "none"), robot__port="/dev/null")
    with pytest.raises(TwinError, match="No twin answers"):
        await session_of(absent, tmp_path).__aenter__()
