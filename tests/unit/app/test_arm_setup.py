"""The arm in the configuration: its own table by default, what it reaches, its options, its files."""

from math import degrees
from pathlib import Path

import pytest

from kempelen.app.arm_reach import tilted_places, tilts_told
from kempelen.app.arm_setup import arm_setup, arm_spec, driver_options
from kempelen.app.config import (
    DATA_DIR_VARIABLE,
    SENSOR_VARIABLE,
    Config,
    RobotConfig,
    TableConfig,
    load_config,
)
from kempelen.app.config_change import changed, for_robot
from kempelen.app.config_example import example_toml
from kempelen.app.doctor import check_table
from kempelen.app.fitting import misfits, tilts
from kempelen.app.robot_defaults import require_same_robot
from kempelen.core.errors import ConfigError
from kempelen.kinematics import load_arm


def arm_config(**overrides: object) -> Config:
    named = {key.replace("__", "."): value for key, value in overrides.items()}
    return load_config(None, {"robot.kind": "arm", "data.dir": "/nowhere", **named})


def test_an_arm_has_a_table_of_its_own_on_which_all_fits() -> None:
    config = arm_config()
    assert (config.table.square, config.pieces.preset) == (35.0, "small")
    assert misfits(config, config.build_table()) == []
    assert Config().table.square == 50.0


def test_what_is_said_counts_for_an_arm_too() -> None:
    config = arm_config(table__square=34.0)
    assert (config.table.square, config.table.turn_degrees) == (34.0, 90.0)
    built = Config(robot=RobotConfig(kind="arm"), table=TableConfig(square=33.0))
    assert (built.table.square, built.table.turn_degrees) == (33.0, 90.0)
    assert Config.model_validate(built.model_dump()) == built


def test_the_example_for_an_arm_says_what_its_defaults_say(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for variable in (DATA_DIR_VARIABLE, SENSOR_VARIABLE):
        monkeypatch.delenv(variable, raising=False)
    file = tmp_path / "arm.toml"
    file.write_text(example_toml("arm"))
    assert load_config(file) == Config(robot=RobotConfig(kind="arm"))


def test_another_robot_has_its_table_and_the_first_one_keeps_its_own() -> None:
    gantry = load_config(None, {"data.dir": "/nowhere", "table.square": 51.0, "twin.seed": 7})
    arm = for_robot(gantry, "arm")
    assert (arm.robot.kind, arm.table.square, arm.twin.seed) == ("arm", 35.0, 7)
    again = changed(for_robot(arm, "gantry", gantry), {"twin.seed": 8})
    assert (again.robot.kind, again.table.square, again.twin.seed) == ("gantry", 51.0, 8)


def test_each_robot_has_files_of_its_own() -> None:
    assert arm_config().calibration_path.name == "calibration-arm-twin.json"
    assert Config().calibration_path.name == "calibration-twin.json"


def test_the_far_corners_are_gripped_with_a_tilt() -> None:
    tilted = tilted_places(load_arm("labvolt-5150"), arm_config().build_table())
    assert {place.name for place in tilted} == {"a1", "b1", "g1", "h1"}
    assert max(map(degrees, tilted.values())) == pytest.approx(5.9, abs=0.3)
    told = tilts_told(tilted, most=3)
    assert told.startswith("The arm tilts its gripper over a1 (5.9°), h1 (5.9°), b1 (1.0°) and 1 more:")
    assert tilts_told({}) == ""


def test_a_gantry_tilts_nowhere_and_the_doctor_tells_of_an_arm() -> None:
    assert tilts(Config(), Config().build_table()) == {}
    assert "over a1 (5.9°)" in check_table(arm_config(), None).found


@pytest.mark.parametrize(
    ("board", "said", "mend"),
    [
        ((435.0, -140.0, 66.0), "8 places, a1, b1", "Move the board 23 mm in -x"),
        ((300.0, -140.0, 66.0), "4 places, c8, d8", "Move the board 29 mm in +x"),
    ],
)
def test_what_is_out_of_reach_is_named_with_the_mend(
    board: tuple[float, float, float], said: str, mend: str
) -> None:
    config = arm_config(table__board=board)
    found = [one for one in misfits(config, config.build_table()) if "arm cannot" in one.what]
    assert said in found[0].what
    assert ".:" not in str(found[0])
    assert found[0].mend.startswith(mend)
    moved = arm_config(table__board=(board[0] + found[0].by * (-1 if "-x" in mend else 1), *board[1:]))
    assert not [one for one in misfits(moved, moved.build_table()) if "board" in one.where]


def test_a_board_that_is_too_large_is_told_how_small_it_has_to_be() -> None:
    config = arm_config(table__square=60.0, table__board=(585.0, -240.0, 66.0))
    found = [one for one in misfits(config, config.build_table()) if "arm cannot" in one.what]
    assert "Make the board 126 mm shorter (70 % of its size)" in found[0].mend


def test_options_of_an_arm() -> None:
    config = arm_config(robot__options={"arm": "scorbot-er-v-plus", "drift_budget": False, "baud": 9600})
    setup = arm_setup(config)
    assert setup is not None
    assert (setup.arm.name, setup.drift_budget) == ("scorbot-er-v-plus", False)
    assert driver_options(config) == {"arm": "scorbot-er-v-plus", "baud": 9600}
    assert arm_setup(Config()) is None
    assert arm_spec(Config()) is None


@pytest.mark.parametrize(
    ("options", "said"),
    [({"arm": "nope"}, "no arm called 'nope'"), ({"bridge": "usb"}, "Option 'bridge' of the arm is 'usb'")],
)
def test_wrong_options_are_refused(options: dict[str, str], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        arm_setup(arm_config(robot__options=options))


def test_a_game_goes_on_with_its_own_robot_alone() -> None:
    require_same_robot("", "gantry", 3)
    require_same_robot("arm", "arm", 3)
    with pytest.raises(ConfigError, match="began with a robot of kind 'arm'") as caught:
        require_same_robot("arm", "gantry", 3)
    assert "resume 3 --robot arm" in (caught.value.hint or "")
