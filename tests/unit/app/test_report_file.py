"""The report's file, and small files that must be whole."""

import json
import os
from dataclasses import replace
from pathlib import Path

import pytest

from kempelen.app.audit import Placement
from kempelen.app.files import replace_file
from kempelen.app.report import GameReport
from kempelen.core.errors import ConfigError

PLACEMENT = Placement(4, 0.1, 0.2, 0.3, 0, 0.01)
REPORT = GameReport(
    result="1-0", reason="checkmate", final_fen="fen", plies=33, transfers=46, interventions=0,
    placement=PLACEMENT, collisions=0, robot_time_s=137.3, wall_time_s=4.6, robot_time_over_bound=1.013,
    game=1, standing_max_mm=0.2, disagreements=[],
)  # fmt: skip


def written(report: GameReport, path: Path) -> dict[str, object]:
    report.write(path)
    body: dict[str, object] = json.loads(path.read_text(encoding="utf-8"))
    return body


def test_the_fields(tmp_path: Path) -> None:
    body = written(REPORT, tmp_path / "new" / "report.json")
    assert body["placement"] == {
        "n": 4, "mean_mm": 0.1, "p95_mm": 0.2, "max_mm": 0.3, "toppled": 0, "neighbour_max_mm": 0.01,
    }  # fmt: skip
    assert list(body)[:6] == ["result", "reason", "final_fen", "plies", "transfers", "interventions"]
    assert "error" not in body


def test_placement_is_absent_on_real_hardware_and_a_fault_is_told(tmp_path: Path) -> None:
    real = replace(REPORT, placement=None, standing_max_mm=None, error="The line is lost.")
    body = written(real, tmp_path / "report.json")
    assert {"placement", "standing_max_mm"} & set(body) == set()
    assert body["error"] == "The line is lost."


def test_a_report_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=f"The report {tmp_path} cannot be written"):
        REPORT.write(tmp_path)


def test_the_old_file_stays_when_the_new_one_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "kept.txt"
    replace_file(file, "old")

    def full(_descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        replace_file(file, "new")
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]


def test_links_stay_links_and_devices_stay_devices(tmp_path: Path) -> None:
    real, link = tmp_path / "real.txt", tmp_path / "link.txt"
    real.write_text("old")
    link.symlink_to(real)
    replace_file(link, "new")
    assert link.is_symlink()
    assert real.read_text() == "new"
    replace_file(Path(os.devnull), "gone")
    assert not Path(os.devnull).is_file()


def test_a_new_file_may_be_read_by_others(tmp_path: Path) -> None:
    file = tmp_path / "shared.json"
    replace_file(file, "{}")
    umask = os.umask(0)
    os.umask(umask)
    assert file.stat().st_mode & 0o777 == 0o666 & ~umask
