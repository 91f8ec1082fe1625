"""Bench results: the file's form, the table."""

import io
import json
from pathlib import Path

from rich.console import Console

from kempelen.bench.result import BenchResult

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
