"""Games from the command line: played, replayed, left, resumed, listed, exported, reported."""

import json
import signal
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from typing import Any

import chess.pgn
import pytest

from kempelen.game.journal import JournalReader

FAMOUS = Path(str(files("kempelen") / "data" / "famous.pgn"))
SHORT = '[White "Short, Nigel"]\n[Black "Long"]\n[Result "0-1"]\n\n1. f3 e5 2. g4 Qh4# 0-1\n'
FIELDS = {
    "result", "reason", "final_fen", "plies", "transfers", "interventions", "placement", "collisions",
    "robot_time_s", "wall_time_s", "robot_time_over_bound",
}  # fmt: skip
PLACEMENT = {"n", "mean_mm", "p95_mm", "max_mm", "toppled", "neighbour_max_mm"}


@pytest.fixture
def short(tmp_path: Path) -> Path:
    file = tmp_path / "short.pgn"
    file.write_text(SHORT)
    return file


@pytest.mark.physics
def test_a_replay_from_first_line_to_report(kempelen: Any, short: Path, tmp_path: Path, data: Path) -> None:
    report = tmp_path / "deep" / "report.json"
    told = kempelen("replay", short, "--speed", "max", "--report", report)
    assert told.code == 0, told.all
    lines = told.out.splitlines()
    assert lines[0] == "Game 1: Short, Nigel against Long (replay)."
    assert lines[1] == "1. f3  (half-move 1 of 4)"
    assert lines[2:5] == [
        "  fetching the pawn from f2", "  carrying the pawn to f3", "  the pawn stands on f3",
    ]  # fmt: skip
    assert "Game over: 0-1, checkmate." in lines
    pgn = data / "games" / "game-1.pgn"
    assert f"PGN: {pgn}" in lines
    assert f"Report: {report}" in lines
    body = json.loads(report.read_text())
    assert set(body) >= FIELDS
    assert set(body["placement"]) == PLACEMENT
    assert (body["result"], body["reason"], body["plies"], body["transfers"]) == ("0-1", "checkmate", 4, 4)
    assert body["final_fen"] == "rnb1kbnr/pppp1ppp/8/4p3/6Pq/5P2/PPPPP2P/RNBQKBNR w KQkq - 1 3"
    assert (body["interventions"], body["collisions"], body["placement"]["n"]) == (0, 0, 4)
    assert body["placement"]["max_mm"] <= 2.0
    assert 1.0 <= body["robot_time_over_bound"] <= 1.15
    assert body["robot_time_s"] > 4.0
    assert "error" not in body
    with pgn.open() as file:
        game = chess.pgn.read_game(file)
    assert game is not None
    assert game.headers["White"] == "Short, Nigel"
    assert game.end().board().is_checkmate()


@pytest.mark.physics
def test_a_game_left_resumed_listed_and_exported(
    kempelen: Any, engine: Path, tmp_path: Path, data: Path
) -> None:
    report = tmp_path / "report.json"
    options = ("--speed", "max", "--report", report)
    told = kempelen("play", "--engine", engine, *options, typed="e4\nquit\n")
    assert told.code == 130
    assert "Your move, White." in told.out
    assert "kempelen resume 1" in told.out
    body = json.loads(report.read_text())
    assert (body["result"], body["reason"]) == ("*", "interrupted")
    assert "placement" in body
    assert "error" not in body

    told = kempelen("resume", *options, typed="resign\n")
    assert told.code == 0, told.all
    assert "goes on after" in told.out
    assert json.loads(report.read_text())["reason"] == "White resigns"

    told = kempelen("games")
    assert told.code == 0
    assert "White resigns" in " ".join(told.out.split())
    log = kempelen("pgn", "--san").out
    assert log.startswith("1. ")
    assert len(log.splitlines()) == 1
    assert log.strip() in " ".join(kempelen("pgn").out.split())
    told = kempelen("pgn")
    assert told.out.startswith('[Event "Casual game"]')
    assert "1. e4" in told.out
    file = tmp_path / "out.pgn"
    assert kempelen("pgn", "1", "--output", file).out == f"Written to {file}.\n"
    assert file.read_text().strip() == told.out.strip()
    with JournalReader(data) as journal:
        assert journal.state(1).ended is not None


@pytest.mark.physics
def test_a_person_takes_a_replay_over(kempelen: Any, engine: Path, short: Path) -> None:
    told = kempelen(
        "replay", short, "--engine", engine, "--take-over", "2", "--side", "black", "--speed", "max",
        typed="e6\nQh4\n",
    )  # fmt: skip
    assert told.code == 0, told.all
    assert "Mode play: " in told.out
    assert "2... Qh4#" in told.out
    assert "'e6' is illegal" in told.out


@pytest.mark.physics
def test_a_twin_of_somebody_elses_with_its_side_door(kempelen: Any, short: Path, tmp_path: Path) -> None:
    """The wire is a link to a pseudo-terminal, the report has the ground truth and the twin's own clock."""
    link, control, report = tmp_path / "gantry", tmp_path / "side", tmp_path / "report.json"
    command = ["twin", "--link", link, "--control", control, "--speed", "max"]
    with subprocess.Popen(
        [sys.executable, "-m", "kempelen", *map(str, command)], stdout=subprocess.PIPE, text=True
    ) as twin:
        try:
            assert twin.stdout is not None
            assert str(link) in twin.stdout.readline()
            told = kempelen("replay", short, "--port", link, "--twin-control", control, "--report", report)
        finally:
            twin.send_signal(signal.SIGINT)
    assert told.code == 0, told.all
    assert twin.returncode == 0
    assert not link.is_symlink()
    body = json.loads(report.read_text())
    assert body["placement"]["n"] == 4
    assert body["disagreements"] == []
    assert 1.0 <= body["robot_time_over_bound"] <= 1.15


def test_no_game_yet(kempelen: Any, data: Path) -> None:
    told = kempelen("games")
    assert told.code == 0
    assert told.out.strip() == f"No game in {data} yet. Begin one: kempelen play"


def test_finished_games_are_listed(kempelen: Any, finished: Path) -> None:
    told = kempelen("games", "--data-dir", finished)
    assert "Ada" in told.out
    assert "1-0 Black resigns" in told.out
    assert "resume" not in told.out


@pytest.mark.physics
def test_a_report_that_cannot_be_written_any_more_loses_nothing(
    kempelen: Any, short: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its disk has filled up during the game: the result is told first."""

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("kempelen.app.report.replace_file", full)
    told = kempelen("replay", short, "--speed", "max", "--report", "report.json")
    assert told.code == 2
    assert "Game 1: 0-1, checkmate" in told.out
    assert "report.json cannot be written: No space left on device" in told.err
    assert "kempelen games" in told.err
