"""Bench results: the file's form, the table."""

import io
import json
from pathlib import Path

from rich.console import Console

from kempelen.bench.result import BenchResult, part_of

RESULT = BenchResult("motion", {"collisions": 0, "ratio": 1.00213}, [{"planner": "asynchronous", "n": 3}])


def test_the_file_holds_bench_figures_and_rows(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "motion.json"
    RESULT.to_json(path)
    assert json.loads(path.read_text(encoding="utf-8")) == {
        "bench": "motion",
        "figures": {"collisions": 0, "ratio": 1.00213},
        "rows": [{"planner": "asynchronous", "n": 3}],
    }


def test_the_table_shows_rows_and_figures() -> None:
    out = io.StringIO()
    RESULT.print_table(Console(file=out, width=100))
    for text in ("kempelen bench motion", "asynchronous", "collisions", "1.002"):
        assert text in out.getvalue()


def test_figures_alone_are_fine() -> None:
    out = io.StringIO()
    BenchResult("empty", {"n": 1}).print_table(Console(file=out, width=100))
    assert "n" in out.getvalue()


def test_what_else_was_written_is_told(tmp_path: Path) -> None:
    out, drawing = io.StringIO(), tmp_path / "a [long] name of a folder" / "sweep.svg"
    result = BenchResult("eyes", {"n": 1}, files=[drawing])
    result.print_table(Console(file=out, width=40))
    assert f"Written: {drawing}\n" in out.getvalue()
    result.to_json(tmp_path / "eyes.json")
    assert set(json.loads((tmp_path / "eyes.json").read_text(encoding="utf-8"))) == {
        "bench",
        "figures",
        "rows",
    }


def test_a_parts_progress_is_a_share_of_the_whole() -> None:
    told: list[tuple[str, float]] = []
    part = part_of(lambda what, done: told.append((what, done)), 0.25, 0.5)
    part("begins", 0.0)
    part("ends", 1.0)
    assert told == [("begins", 0.25), ("ends", 0.75)]
