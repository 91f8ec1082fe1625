import tomllib
from datetime import UTC, datetime
from math import radians
from pathlib import Path

import chess
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

from kempelen.app import config as config_module
from kempelen.app.config import Config, TwinConfig, default_config_path, load_config
from kempelen.app.config_errors import key_lines
from kempelen.app.config_example import attribute_docs, example_toml
from kempelen.core.calibration import calibrate
from kempelen.core.errors import ConfigError
from kempelen.core.fit import check_fit
from kempelen.core.pieces import PRESETS
from kempelen.core.table import Table

CORNERS = {"a1": (100.0, 50.0, 1.0), "h1": (499.8, 53.1, 1.5), "h8": (497.0, 453.2, 1.0)}
WHEN = datetime(2026, 5, 1, 12, 30, tzinfo=UTC)


@pytest.fixture(autouse=True)
def _nobodys_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.delenv(config_module.DATA_DIR_VARIABLE, raising=False)
    monkeypatch.delenv(config_module.SENSOR_VARIABLE, raising=False)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "kempelen.toml"


def refused(file: Path, text: str, **overrides: object) -> str:
    file.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load_config(file, overrides)
    assert caught.value.hint
    assert caught.value.exit_code == 2
    return caught.value.message.replace(f"{file}", "FILE")


def models(model: BaseModel) -> list[type[BaseModel]]:
    found = [type(model)]
    for name in type(model).model_fields:
        value = getattr(model, name)
        for inner in value if isinstance(value, tuple) else (value,):
            if isinstance(inner, BaseModel):
                found += models(inner)
    return found


def test_no_file_is_needed_and_the_defaults_are_the_twins_table() -> None:
    config = load_config()
    assert config == Config()
    assert config.on_twin
    table = config.build_table()
    assert check_fit(table) == []
    assert table.square == Table().square
    np.testing.assert_allclose(table.robot_from_board.matrix, Table().robot_from_board.matrix)
    assert (table.trays, table.pieces, table.gripper, table.space) == (
        Table().trays,
        Table().pieces,
        Table().gripper,
        Table().space,
    )


def test_the_example_says_what_the_defaults_say(file: Path) -> None:
    file.write_text(example_toml())
    assert load_config(file) == Config()


def test_every_key_is_in_the_example_with_its_meaning() -> None:
    text = example_toml()
    content = tomllib.loads(text)
    assert set(content) == set(Config.model_fields)
    for model in models(Config()):
        docs = attribute_docs(model)
        if model is not Config:
            assert set(docs) == set(model.model_fields), model
        for name, sentence in docs.items():
            assert f"{name} =" in text or f"{name}]" in text, (model, name)
            assert len(sentence) > 8


def test_meanings_are_read_from_docstrings() -> None:
    class Told(BaseModel):
        """A summary.

        Attributes:
            one: Begins here
                and goes on.
            two: Short.

        Raises:
            three: No attribute.
        """

    assert attribute_docs(Told) == {"one": "Begins here and goes on.", "two": "Short."}


def test_the_default_file_is_read_when_it_is_there() -> None:
    default_config_path().parent.mkdir(parents=True)
    default_config_path().write_text('[robot]\nport = "/dev/ttyUSB7"\n')
    config = load_config()
    assert config.robot.port == "/dev/ttyUSB7"
    assert not config.on_twin


def test_models_are_frozen() -> None:
    with pytest.raises(ValidationError):
        setattr(Config().twin, "seed", 3)  # noqa: B010 - the type checker knows better already


def test_overrides_beat_the_environment_which_beats_the_file(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file.write_text('[data]\ndir = "/from/file"\n[engine]\nmove_time = 2\n')
    assert load_config(file).data_dir == Path("/from/file")
    monkeypatch.setenv("KEMPELEN_DATA_DIR", "/from/environment")
    assert load_config(file).data_dir == Path("/from/environment")
    overrides = {"data.dir": "/from/option", "engine.move_time": None, "robot.kind": "arm"}
    config = load_config(file, overrides)
    assert config.data_dir == Path("/from/option")
    assert config.engine.move_time == 2.0
    assert config.robot.kind == "arm"


def test_data_lives_in_the_systems_usual_place(tmp_path: Path) -> None:
    assert load_config().data_dir == tmp_path / "data" / "kempelen"


def test_the_twins_calibration_is_not_the_machines() -> None:
    twin = load_config().calibration_path
    machine = load_config(None, {"robot.port": "/dev/ttyUSB0"}).calibration_path
    assert twin.parent == machine.parent
    assert twin != machine


def test_the_board_is_where_it_is_configured_until_it_is_calibrated() -> None:
    overrides = {"table.board": [1.0, 2.0, 3.0], "table.turn_degrees": 90, "table.square": 40}
    config = load_config(None, overrides)
    configured = config.build_table()
    np.testing.assert_allclose(configured.robot_from_board.translation, [1, 2, 3])
    assert configured.robot_from_board.yaw == pytest.approx(radians(90))
    assert configured.square == 40.0
    found = calibrate(CORNERS, date=WHEN)
    calibrated = config.build_table(found)
    assert calibrated.robot_from_board is found.robot_from_board
    assert calibrated.square == found.square
    assert calibrated.trays == configured.trays


def test_a_piece_may_differ_from_the_preset(file: Path) -> None:
    file.write_text('[pieces]\npreset = "small"\n[pieces.king]\nheight = 70.5\n')
    pieces = load_config(file).pieces.piece_set()
    assert pieces.name == "small, changed"
    assert pieces[chess.KING].height == 70.5
    assert pieces[chess.KING].base_diameter == PRESETS["small"][chess.KING].base_diameter
    assert pieces[chess.QUEEN] == PRESETS["small"][chess.QUEEN]
    assert load_config(None, {"pieces.preset": "thesis"}).pieces.piece_set() == PRESETS["thesis"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[robot]\nknd = 1\n", "FILE:2: unknown key 'robot.knd'. Did you mean 'kind'?"),
        (
            "[bord]\nx = 1\n",
            (
                "FILE:1: unknown key 'bord'. Known here: robot, table, pieces, gripper, engine, planner, "
                "twin, play, camera, sensor, data, network."
            ),
        ),
        ("[table]\n\nsquare = 5\n", "FILE:3: 'table.square' is 5: allowed: a number from 15 to 120."),
        ("table.square = 500\n", "FILE:1: 'table.square' is 500: allowed: a number from 15 to 120."),
        ("table = { square = nan }\n", "FILE:1: 'table.square' is nan: allowed: a number from 15 to 120."),
        ("[twin]\nseed = 1.5\n", "FILE:2: 'twin.seed' is 1.5: allowed: a whole number from 0 to 2147483647."),
        ("[twin]\nspeed = 0\n", "FILE:2: 'twin.speed' is 0: allowed: a number above 0 to 1000 or 'max'."),
        (
            '[twin]\nspeed = "fast"\n',
            "FILE:2: 'twin.speed' is 'fast': allowed: a number above 0 to 1000 or 'max'.",
        ),
        ('[play]\n"side" = "red"\n', "FILE:2: 'play.side' is 'red': allowed: 'white', 'black'."),
        (
            "[robot.options]\na = [1]\n",
            "FILE:2: 'robot.options.a': allowed: a number, a text, true or false.",
        ),
        ("[gripper]\nopening = 1\n", "FILE:2: 'gripper.opening' is 1: allowed: a number above 5 to 120."),
        (
            "[table.space]\nlower = [0, 900, 0]\n",
            "FILE:1: 'table.space': work space y: lower 900.0 mm must be below upper 450.0 mm.",
        ),
        (
            (
                '[[table.trays]]\nname = "one"\norigin = [0, 0]\n'
                '[[table.trays]]\nname = "two"\norigin = [0, 0]\nrow = 3\n'
            ),
            "FILE:7: unknown key 'table.trays.1.row'. Did you mean 'rows'?",
        ),
        ('[[table.trays]]\nname = "one"\n', "FILE:1: 'table.trays.0.origin' is missing."),
        (
            "[pieces.pawn]\ngrip_height = 99\n",
            "FILE:1: 'pieces': pawn: grip_height 99.0 mm must be below the height 45.0 mm.",
        ),
        ("twin = 3\n", "FILE:1: 'twin' is 3: Input should be a valid dictionary or instance of TwinConfig."),
    ],
)
def test_what_is_wrong_is_told_with_line_range_and_near_keys(file: Path, text: str, said: str) -> None:
    assert refused(file, text) == said


def test_all_errors_are_told_at_once(file: Path) -> None:
    said = refused(
        file, "[twin]\nseed = -1\nsped = 1\n[table]\nsquare = 1\n", **{"engine.move_time": 0}
    ).splitlines()
    assert sorted(line.split(" ")[0] for line in said) == [
        "'engine.move_time'",
        "FILE:2:",
        "FILE:3:",
        "FILE:5:",
    ]


def test_an_option_is_not_blamed_on_the_file(file: Path) -> None:
    assert refused(file, "[planner]\nname = 'asynchronous'\n", **{"planner.name": "fast"}) == (
        "'planner.name' is 'fast': allowed: 'asynchronous', 'safe-height', 'supercover'."
    )
    assert refused(file, "twin = 3\n", **{"twin.speed": 2.0}).startswith("FILE:1: 'twin' is 3")


def test_a_file_that_is_no_toml_is_told_with_its_line(file: Path) -> None:
    assert "not TOML" in refused(file, "[robot\nport = 1")
    assert "at line 1" in refused(file, "[robot\nport = 1")
    assert "not TOML" in refused(file, "a = " + "[" * 10_000)


def test_a_file_that_is_no_text_is_told(file: Path) -> None:
    file.write_bytes(b"[robot]\n\xff")
    with pytest.raises(ConfigError, match="not UTF-8 text: byte 8 is 0xff"):
        load_config(file)


def test_a_missing_file_is_told_only_when_it_was_named(file: Path) -> None:
    with pytest.raises(ConfigError, match=r"no configuration file .*kempelen.toml.*kempelen config"):
        load_config(file)


def test_a_directory_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read: Is a directory"):
        load_config(tmp_path)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    content=st.recursive(
        st.integers() | st.floats() | st.booleans() | st.text(max_size=5),
        lambda inner: (
            st.dictionaries(
                st.sampled_from([*Config.model_fields, *TwinConfig.model_fields, "trays", "square", "x"]),
                inner,
            )
            | st.lists(inner, max_size=3)
        ),
        max_leaves=8,
    )
)
def test_any_content_is_a_configuration_or_a_configuration_error(content: object, file: Path) -> None:
    file.write_text("")
    overrides = dict.fromkeys(("twin", "table", "robot.options", "engine.move_time"), content)
    try:
        read = load_config(file, overrides)
    except ConfigError as error:
        assert str(error)  # noqa: PT017 - either outcome is right, no other is
    else:
        assert read.engine.move_time == content


def test_lines_of_keys() -> None:
    text = '# a = 1\nx = 1\n[a."b"]\n c.d = 2 # comment\n[[e]]\nf=1\n[[e]]\nf = 2\n[e.g]\nh = 1\n'
    assert key_lines(text) == {
        "x": 2,
        "a.b": 3,
        "a.b.c.d": 4,
        "e.0": 5,
        "e.0.f": 6,
        "e.1": 7,
        "e.1.f": 8,
        "e.g": 9,
        "e.g.h": 10,
    }


@pytest.mark.parametrize(
    ("settings", "eyes", "hands"),
    [
        ({}, True, "person"),
        ({"sensor.kind": "none"}, False, "robot"),
        ({"robot.port": "/dev/ttyUSB0"}, False, "robot"),
        ({"robot.port": "/dev/ttyUSB0", "camera.source": "uvc:0"}, True, "person"),
        ({"robot.port": "/dev/ttyUSB0", "camera.source": "uvc:0", "sensor.kind": "none"}, False, "robot"),
        ({"play.hands": "robot"}, True, "robot"),
        ({"sensor.kind": "none", "play.hands": "person"}, False, "person"),
    ],
)
def test_who_looks_and_who_carries(settings: dict[str, object], eyes: bool, hands: str) -> None:
    config = load_config(None, settings)
    assert (config.has_eyes, config.hands) == (eyes, hands)


def test_a_hand_that_is_looked_past_parks_farther_out() -> None:
    seen, unseen = (load_config(None, {"sensor.kind": kind}).build_table() for kind in ("camera", "none"))
    assert unseen.park_xs == (150.0, 550.0)
    assert seen.park_xs == (90.0, 610.0)


def test_the_reed_boards_port_may_stand_beside_its_kind() -> None:
    sensor = load_config(None, {"sensor.kind": "camera,reed:/dev/ttyUSB1"}).sensor
    assert (sensor.kind, sensor.port, sensor.reed) == ("camera,reed", "/dev/ttyUSB1", True)
    assert load_config(None, {"sensor.kind": "reed:socket://board:23"}).sensor.port == "socket://board:23"
    with pytest.raises(ConfigError, match=r"sensor.kind.*reed:PORT"):
        load_config(None, {"sensor.kind": "lidar"})


def test_the_environment_can_do_without_a_sensor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(config_module.SENSOR_VARIABLE, "none")
    assert not load_config().has_eyes
    assert load_config(None, {"sensor.kind": "camera"}).has_eyes
