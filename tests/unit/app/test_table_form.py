from pathlib import Path

import pytest
from pydantic import ValidationError

from kempelen.app.config import Config, load_config
from kempelen.app.config_pieces import PiecesConfig, ShapeConfig
from kempelen.app.table_form import TableForm, built, save_form
from kempelen.core.errors import ConfigError, FitError
from kempelen.core.table import Tray

TRAYS = (Tray(name="left", origin=(-95.5, 25.0), pitch=51.0), Tray(name="right", origin=(450.0, 25.0)))
PIECES = PiecesConfig(preset="club", king=ShapeConfig(height=97.5, grip_height=49.0))
FORM = TableForm(square=51.5, trays=TRAYS, pieces=PIECES)


def config_in(directory: Path, **overrides: object) -> Config:
    return load_config(None, {"data.dir": str(directory), **overrides})


@pytest.fixture(autouse=True)
def _no_file_of_the_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "nowhere"))


def test_what_was_saved_is_there_the_next_time(tmp_path: Path) -> None:
    saved = save_form(FORM, config_in(tmp_path))
    again = config_in(tmp_path)
    assert TableForm.of(again) == TableForm.of(saved) == FORM
    assert again == saved


def test_no_tray_at_all_can_be_saved(tmp_path: Path) -> None:
    save_form(FORM.model_copy(update={"trays": ()}), config_in(tmp_path))
    assert config_in(tmp_path).table.trays == ()


def test_it_is_stronger_than_the_file_and_weaker_than_the_command_line(tmp_path: Path) -> None:
    file = tmp_path / "kempelen.toml"
    file.write_text('[table]\nsquare = 40.0\nboard = [1.0, 2.0, 3.0]\n[pieces]\npreset = "small"\n')
    save_form(FORM, config_in(tmp_path))
    config = load_config(file, {"data.dir": str(tmp_path)})
    assert (config.table.square, config.table.board, config.pieces) == (51.5, (1.0, 2.0, 3.0), PIECES)
    config = load_config(file, {"data.dir": str(tmp_path), "table.square": 45.0})
    assert (config.table.square, config.table.trays) == (45.0, TRAYS)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[robot]\nport = 'x'\n", "'robot' holds what does not belong there"),
        ("[table]\nboard = [1, 2, 3]\n", "'table' holds what does not belong there"),
        ("table = 5\n", "'table' holds what does not belong there"),
        ("[table\n", "is damaged"),
        ("[table]\nsquare = 500\n", "table.toml:2: 'table.square'"),
        ("[pieces]\npreset = 'huge'\n", "table.toml:2: 'pieces.preset'"),
    ],
)
def test_a_damaged_file_is_refused_by_name_and_line(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "table.toml").write_text(text)
    with pytest.raises(ConfigError) as caught:
        config_in(tmp_path)
    assert said in caught.value.message
    assert caught.value.hint


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    (tmp_path / "table.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ConfigError, match="damaged"):
        config_in(tmp_path)


def test_a_directory_that_cannot_be_written_to_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="cannot be written") as caught:
        save_form(FORM, config_in(tmp_path / "file"))
    assert "--data-dir" in caught.value.hint


def test_what_does_not_fit_says_where(tmp_path: Path) -> None:
    far = FORM.model_copy(
        update={"square": 50.0, "trays": (TRAYS[0].model_copy(update={"origin": (-200.0, 25.0)}),)}
    )
    _, findings = built(far.applied(config_in(tmp_path)))
    reach = next(finding for finding in findings if "Reach of the left" in finding.what)
    assert reach.where == ("left", "left1")
    assert reach.by == pytest.approx(50.0)
    assert any("slots" in finding.what and finding.unit == "pieces" for finding in findings)


def test_two_trays_of_one_name_cannot_be_built(tmp_path: Path) -> None:
    twice = FORM.model_copy(update={"trays": (TRAYS[0], TRAYS[0])})
    with pytest.raises(FitError, match="same name"):
        built(twice.applied(config_in(tmp_path)))


def test_pieces_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValidationError, match="grip_height"):
        PiecesConfig(preset="club", pawn=ShapeConfig(grip_height=60.0))
