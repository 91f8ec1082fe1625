"""`kempelen arm`: what it prints, the pictures it draws, what it says of bad input."""

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from typer.testing import CliRunner

from kempelen.cli.main import app
from kempelen.core.errors import ConfigError, ReachError


def _run(*words: str) -> str:
    result = CliRunner().invoke(app, ["arm", *words])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.output
    return " ".join(result.output.split())


def test_show_tells_numbers_and_sources() -> None:
    told = _run("show")
    assert "Lab-Volt 5150" in told
    assert "-185 to 153" in told
    assert "unverified, from memory of the maker's data" in told


def test_paths_tell_both_motions(tmp_path: Path) -> None:
    picture = tmp_path / "paths.svg"
    told = _run("paths", "--picture", str(picture))
    assert "joints together 1 20.4" in told
    assert "joints together 1 83.9" in told
    guided = [float(part.split()[1]) for part in told.split("guided ")[1:]]
    assert len(guided) == 2
    assert max(guided) <= 2.0
    assert ET.parse(picture).getroot().tag.endswith("svg")  # noqa: S314 - written by the test itself


def test_place_tells_where_and_how_large(tmp_path: Path) -> None:
    picture = tmp_path / "place.svg"
    told = _run("place", "--square", "40", "--most", "30", "--picture", str(picture))
    assert "before the base's axis" in told
    assert "squares need tilt" in told
    assert picture.read_text(encoding="utf-8").count("<rect") > 64


def test_workspace_tells_heights(tmp_path: Path) -> None:
    picture = tmp_path / "workspace.svg"
    assert "straight down to mm" in _run("workspace", "--picture", str(picture))
    assert "Workspace of the Lab-Volt 5150" in picture.read_text(encoding="utf-8")


def test_bad_input(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no arm called 'nobody'"):
        _run("show", "--arm", "nobody")
    with pytest.raises(ReachError, match="are the largest"):
        _run("place", "--square", "150")
    with pytest.raises(ConfigError):
        _run("paths", "--picture", str(tmp_path))
