"""`kempelen see`: parameters, terminal pictures, and photos that show no board."""

import io
import json
from pathlib import Path

import chess
import cv2
import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from kempelen.cli.halfblocks import UPPER_HALF, terminal_picture
from kempelen.cli.main import app
from kempelen.cli.see_run import numbers
from kempelen.cli.telling import assignment, told
from kempelen.core.errors import BoardNotFoundError, CameraError, ConfigError, KempelenError
from kempelen.core.senses import Observation, Sight
from kempelen.testing.observations import Sensor


def test_what_is_seen_in_one_line() -> None:
    assert told(Sensor().see(chess.Board())).startswith(
        "In sight: 16 white, 16 black, 32 empty. Least certain: "
    )
    blind = Observation.blind(0.0, Sight.DARK, "Switch the light on.")
    assert told(blind) == "Not to be seen (dark). Switch the light on."


def test_parameters_are_set_and_given_back() -> None:
    assert assignment("hand.above=140") == ("hand.above", 140.0)
    assert assignment("hand.above = ") == ("hand.above", None)
    assert numbers(["a=1", "b=-2.5"]) == {"a": 1.0, "b": -2.5}


@pytest.mark.parametrize("text", ["hand.above", "hand.above=high", ""])
def test_what_sets_nothing_is_told(text: str) -> None:
    with pytest.raises(ConfigError, match="NAME=NUMBER"):
        assignment(text)


def test_an_option_must_set_something() -> None:
    with pytest.raises(ConfigError, match="sets nothing"):
        numbers(["hand.above="])


def test_two_pixels_in_a_character() -> None:
    picture = np.zeros((4, 6, 3), np.uint8)
    picture[:2] = (0, 0, 255)
    out = io.StringIO()
    console = Console(width=20, color_system="truecolor", force_terminal=True, file=out)
    console.print(terminal_picture(picture, 6, 2))
    assert out.getvalue().count(UPPER_HALF) == 12
    assert "255;0;0" in out.getvalue()


def run(*words: str) -> BaseException | None:
    return CliRunner().invoke(app, ["see", *words]).exception


def test_a_picture_without_a_board_is_refused_with_the_reason(tmp_path: Path) -> None:
    file = tmp_path / "noise.png"
    cv2.imwrite(str(file), np.random.default_rng(1).integers(0, 255, (400, 600, 3), np.uint8))
    error = run("--image", str(file))
    assert isinstance(error, BoardNotFoundError)
    assert error.message


@pytest.mark.parametrize("content", [None, b"", b"no picture"])
def test_a_file_that_is_no_picture_is_refused(tmp_path: Path, content: bytes | None) -> None:
    file = tmp_path / "board.png"
    if content is not None:
        file.write_bytes(content)
    error = run("--image", str(file))
    assert isinstance(error, CameraError)
    assert error.hint


def test_a_machine_without_a_camera_is_told_to_name_one(tmp_path: Path) -> None:
    config = tmp_path / "kempelen.toml"
    config.write_text('[robot]\nport = "/dev/ttyUSB0"\n')
    error = run("--config", str(config), "--once", "--data-dir", str(tmp_path))
    assert isinstance(error, KempelenError)
    assert "Name one" in error.hint


def test_the_camera_is_calibrated_only_once_the_board_is(tmp_path: Path) -> None:
    config = tmp_path / "kempelen.toml"
    config.write_text('[robot]\nport = "/dev/ttyUSB0"\n')
    words = [
        "calibrate",
        "--camera",
        "--source",
        "uvc:0",
        "--config",
        str(config),
        "--data-dir",
        str(tmp_path),
    ]
    error = CliRunner().invoke(app, words).exception
    assert isinstance(error, KempelenError)
    assert "Touch the board's corners first" in error.hint
    assert json.dumps(sorted(p.name for p in tmp_path.iterdir())) == '["kempelen.toml"]'
