"""The commands around the games: jog, calibrate, bench, config."""

import json
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from kempelen.bench.result import BenchResult


@pytest.mark.physics
def test_jog_to_a_point(kempelen: Any) -> None:
    told = kempelen("jog", "--to", "150", "25", "60", "--speed", "20")
    assert told.code == 0, told.all
    assert told.out.splitlines()[-1] == "x 150.000  y 25.000  z 60.000 mm"


@pytest.mark.physics
def test_jog_out_of_reach(kempelen: Any) -> None:
    told = kempelen("jog", "--to", "150", "25", "900", "--speed", "20")
    assert told.code == 5
    assert "900" in told.err


def test_calibrate_keeps_and_shows(kempelen: Any, data: Path) -> None:
    assert "There is no calibration" in kempelen("calibrate", "--show").out
    corners = ("--corner", "a1=151,26,0", "--corner", "h1=551,26,0")
    told = kempelen("calibrate", *corners)
    assert told.code == 0, told.all
    assert f"Kept in {data / 'calibration-twin.json'}." in " ".join(told.out.split())
    told = kempelen("calibrate", "--show")
    assert "x 151.00  y 26.00  z 0.00 mm" in told.out
    assert "50.00 mm" in told.out


def test_the_configuration_that_is_printed_can_be_read(kempelen: Any, tmp_path: Path) -> None:
    told = kempelen("config")
    assert tomllib.loads(told.out)
    file = tmp_path / "k.toml"
    file.write_text(told.out)
    assert kempelen("games", "--config", file).code == 0


def test_a_bench_prints_and_keeps(kempelen: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, Any] = {}

    def run(**options: Any) -> BenchResult:
        options.pop("progress")("half of it", 0.5)
        asked.update(options)
        return BenchResult("motion", {"collisions": 0}, [{"game": "A-B", "n": 3}])

    monkeypatch.setattr("importlib.import_module", lambda name: SimpleNamespace(run=run, name=name))
    file = tmp_path / "out" / "motion.json"
    told = kempelen("bench", "motion", "--json", file, "--seed", "4", "--pgn", "x.pgn", "--data", "d")
    assert told.code == 0, told.all
    assert "A-B" in told.out
    assert asked == {"seed": 4, "pgn": Path("x.pgn"), "data": Path("d")}
    assert json.loads(file.read_text())["figures"] == {"collisions": 0}
