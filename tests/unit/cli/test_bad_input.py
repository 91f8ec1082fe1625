"""Whatever is wrong: what, where, the next step; an exit code; no traceback, nothing lost."""

import errno
import fcntl
import json
import os
import pty
import signal
import socket
import stat
import subprocess
import sys
import threading
import tty
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from kempelen.game.journal import Journal, JournalReader
from kempelen.testing.uci_engines import write_engine

FAMOUS = Path(str(files("kempelen") / "data" / "famous.pgn"))
CONFIG, ENGINE, JOURNAL, ROBOT, TWIN, OPERATOR = 2, 3, 4, 6, 7, 8


def assert_told(told: Any, code: int, *parts: str) -> None:
    """An error in words: every part of it is there, and what to do stands on a line of its own."""
    assert told.code == code, told.all
    assert "Traceback" not in told.all
    for part in parts:
        assert part in told.err, told.err
    assert len(told.err.strip().splitlines()) >= 2, told.err


# --- PGN --------------------------------------------------------------------------------------------------

PGN_FAULTS = {
    "cut off in a comment": (b'[Event "x"]\n\n1. e4 e5 {a comm', "line 3", "cut off"),
    "an illegal move": (b"1. e4 e5\n2. Ke3 1-0\n", "line 2", "'Ke3' is illegal"),
    "not PGN": (b"Dear diary, today I went out.\n", "line 1", "is not a PGN file"),
    "empty": (b"", "is empty", "Name a PGN file"),
    "binary": (bytes(range(256)) * 8, "binary", "Name a PGN file"),
}


@pytest.mark.parametrize("fault", PGN_FAULTS)
def test_a_faulty_pgn(kempelen: Any, tmp_path: Path, fault: str) -> None:
    content, *parts = PGN_FAULTS[fault]
    file = tmp_path / "game.pgn"
    file.write_bytes(content)
    assert_told(kempelen("replay", file), CONFIG, str(file), *parts)
    assert not (tmp_path / "data").exists()


def test_a_pgn_of_100_megabytes(kempelen: Any, tmp_path: Path) -> None:
    """A sparse file with a game in front of it, and one line without end."""
    file = tmp_path / "big.pgn"
    file.write_bytes(b"1. e4 e5 2. Nf3 " + b"Nc6 Ng1 Nb8 Nf3 " * 70_000)
    os.truncate(file, 100_000_000)
    assert_told(kempelen("replay", file), CONFIG, str(file), "too big")


def test_a_pgn_that_is_missing_or_a_directory(kempelen: Any, tmp_path: Path) -> None:
    assert_told(kempelen("replay", tmp_path / "no.pgn"), CONFIG, "There is no file", "Check the name")
    assert_told(kempelen("replay", tmp_path), CONFIG, "is a directory", "Name a file in it")


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        (("--game", "99"), ("has 5 games", "1..5")),
        (("--game", "0"), ("There is no game 0", "counted from 1")),
        (("--take-over", "0"), ("--take-over is 0", "1 to 17")),
        (("--take-over", "40"), ("--take-over is 40", "numbered up to 17")),
    ],
)
def test_games_and_moves_that_a_file_does_not_have(kempelen: Any, options: Any, parts: Any) -> None:
    assert_told(kempelen("replay", FAMOUS, *options), CONFIG, *parts)


# --- positions, options, configuration --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fen", "parts"),
    [
        ("", ("empty fen", "A FEN looks like")),
        ("garbage", ("'garbage' cannot be read as FEN",)),
        ("8/8/8/8/8/8/8/8 w - - 0 1", ("the board is empty", "Correct the FEN")),
        ("kk6/8/8/8/8/8/8/K7 w - - 0 1", ("more than one king",)),
    ],
)
def test_positions(kempelen: Any, fen: str, parts: Any) -> None:
    assert_told(kempelen("play", "--fen", fen), CONFIG, *parts)


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        (("--move-time", "0"), ("--move-time is 0.0", "0.01 to 3600")),
        (("--planner", "zz"), ("--planner is 'zz'", "safe-height")),
        (("--speed", "0"), ("--speed is 0.0", "'max'")),
        (("--speed", "fast"), ("--speed is 'fast'",)),
        (("--speed", "nan"), ("--speed is nan",)),
        (("--seed", "-1"), ("--seed is -1", "from 0")),
        (("--port", ""), ("--port is ''",)),
        (("--level", "99"), ("The level '99' is unknown", "1 (beginner) to 20")),
        (("--level", "x"), ("The level 'x' is unknown",)),
    ],
)
def test_options_out_of_range_are_named_as_they_were_given(
    kempelen: Any, options: Any, parts: Any, data: Path
) -> None:
    assert_told(kempelen("play", *options), CONFIG, *parts)
    assert not list(data.glob("games/*"))


def test_an_unknown_kind_of_robot(kempelen: Any, engine: Path) -> None:
    told = kempelen("play", "--robot", "crane", "--engine", engine)
    assert_told(told, CONFIG, "'crane'", "Installed: arm, gantry")


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ('[robot]\nprot = "twin"\n', (":2: unknown key 'robot.prot'", "Did you mean 'port'")),
        ("[engine]\nmove_time = -3\n", (":2: 'engine.move_time' is -3", "0.01 to 3600")),
        ("hello = = 3\n", ("is not TOML", "line 1")),
        ("[twin]\nspeed = 0\n[engine]\nhash_mb = 0\n", (":2: 'twin.speed'", ":4: 'engine.hash_mb'")),
    ],
)
def test_configurations(kempelen: Any, tmp_path: Path, text: str, parts: Any) -> None:
    file = tmp_path / "k.toml"
    file.write_text(text)
    assert_told(kempelen("play", "--config", file), CONFIG, str(file), *parts)


def test_a_configuration_that_is_missing_or_a_directory(kempelen: Any, tmp_path: Path) -> None:
    told = kempelen("watch", "--config", tmp_path / "no.toml")
    assert_told(told, CONFIG, "no.toml", "kempelen config > kempelen.toml")
    assert_told(kempelen("watch", "--config", tmp_path), CONFIG, "Is a directory", "Name a TOML file")


# --- calibration ------------------------------------------------------------------------------------------


def test_crossed_corners(kempelen: Any, data: Path) -> None:
    corners = ("a1=150,25,0", "h1=550,25,0", "h8=150,425,0", "a8=550,425,0")
    options = [word for corner in corners for word in ("--corner", corner)]
    assert_told(kempelen("calibrate", *options), CONFIG, "h8 and a8 look swapped", "anticlockwise")
    assert not (data / "calibration-twin.json").exists()


@pytest.mark.parametrize("corner", ["a1=150,25", "a1", "a1=x,y,z"])
def test_corners_that_are_none(kempelen: Any, corner: str) -> None:
    assert_told(kempelen("calibrate", "--corner", corner), CONFIG, repr(corner), "a1=150.0,25.0,0.0")


def test_a_board_out_of_reach_is_not_kept(kempelen: Any, data: Path) -> None:
    told = kempelen("calibrate", "--corner", "a1=900,25,0", "--corner", "h1=1300,25,0")
    assert_told(told, CONFIG, "mm")
    assert not (data / "calibration-twin.json").exists()


def test_a_damaged_calibration_stops_a_game(kempelen: Any, engine: Path, data: Path) -> None:
    data.mkdir()
    (data / "calibration-twin.json").write_text('{"version": 1, broken')
    told = kempelen("play", "--engine", engine)
    assert_told(told, CONFIG, "calibration-twin.json is damaged", "kempelen calibrate")


def test_the_pad_needs_a_keyboard(kempelen: Any) -> None:
    assert_told(kempelen("calibrate"), CONFIG, "needs a terminal", "--corner a1=X,Y,Z")
    assert_told(kempelen("jog"), CONFIG, "needs a terminal", "kempelen jog --to X Y Z")


# --- ports ------------------------------------------------------------------------------------------------


@pytest.fixture
def terminal() -> Iterator[tuple[int, str]]:
    """A pseudo-terminal: our end, and the other one's name."""
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    yield ours, os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


@pytest.mark.parametrize(
    ("port", "code", "parts"),
    [
        ("/dev/ttyNONE7", ROBOT, ("/dev/ttyNONE7 does not exist", "plugged in")),
        ("/dev/null", ROBOT, ("/dev/null is not a serial device", "kempelen doctor")),
        ("/proc", ROBOT, ("/proc is a directory", "/dev/ttyUSB0")),
        ("gopher://x", CONFIG, ("'gopher://x' is no port", "socket://host:port")),
        ("socket://127.0.0.1", CONFIG, ("expected both host and port",)),
    ],
)
def test_ports_that_are_none(
    kempelen: Any, engine: Path, data: Path, port: str, code: int, parts: Any
) -> None:
    assert_told(kempelen("play", "--engine", engine, "--port", port), code, *parts)
    with JournalReader(data) as journal:
        assert journal.games() == []  # a game that could not begin is no game


def test_a_port_that_refuses(kempelen: Any, engine: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # bound, not listening: refused
        port = f"socket://127.0.0.1:{taken.getsockname()[1]}"
        assert_told(kempelen("play", "--engine", engine, "--port", port), ROBOT, port, "nobody listens")


def test_a_port_without_permission(kempelen: Any, engine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = os.open

    def guarded(path: Any, *rest: Any, **named: Any) -> int:
        if path == "/dev/ttyACM0":
            raise PermissionError(errno.EACCES, "Permission denied", path)
        return real(path, *rest, **named)

    monkeypatch.setattr(os, "open", guarded)
    told = kempelen("play", "--engine", engine, "--port", "/dev/ttyACM0")
    assert_told(told, ROBOT, "/dev/ttyACM0 may not be opened by this user", "usermod -aG dialout")


def test_a_port_in_use(kempelen: Any, engine: Path, terminal: tuple[int, str]) -> None:
    descriptor = os.open(terminal[1], os.O_RDWR | os.O_NOCTTY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        told = kempelen("play", "--engine", engine, "--port", terminal[1])
    finally:
        os.close(descriptor)
    assert_told(told, ROBOT, f"{terminal[1]} is already in use", "End the other program")


def test_another_device_answers(kempelen: Any, engine: Path, terminal: tuple[int, str]) -> None:
    ours, name = terminal
    over = threading.Event()

    def marlin() -> None:
        while not over.is_set():
            try:
                os.read(ours, 100)
            except OSError:
                return
            os.write(ours, b'echo:Unknown command: "?"\nok\n')

    device = threading.Thread(target=marlin)
    device.start()
    try:
        told = kempelen("play", "--engine", engine, "--port", name)
    finally:
        over.set()
        other = os.open(name, os.O_RDWR | os.O_NOCTTY)
        os.write(other, b"x")  # wakes the device
        device.join()
        os.close(other)
    assert_told(told, ROBOT, name, "not GRBL", "kempelen doctor")


def test_the_control_socket_of_a_twin_that_is_not_there(kempelen: Any, engine: Path, tmp_path: Path) -> None:
    lonely = kempelen("play", "--engine", engine, "--twin-control", tmp_path / "side")
    assert_told(lonely, CONFIG, "side", "--port PORT --twin-control SOCKET")
    absent = kempelen("play", "--engine", engine, "--port", "/dev/null", "--twin-control", tmp_path / "side")
    assert_told(absent, TWIN, "No twin answers", "kempelen twin --control")


@pytest.mark.parametrize(
    ("options", "code", "parts"),
    [
        (("--wire", "string"), CONFIG, ("--wire cannot be 'string'",)),
        (("--wire", "tcp:99999"), TWIN, ("99999",)),
        (("--speed", "slow"), CONFIG, ("'slow'", "or max")),
        (("--fen", "x"), CONFIG, ("'x' cannot be read as FEN",)),
        (("--keep",), CONFIG, ("--keep", "--state FILE")),
    ],
)
def test_options_of_the_twin(kempelen: Any, options: Any, code: int, parts: Any) -> None:
    assert_told(kempelen("twin", *options), code, *parts)


def test_the_twins_link_spares_a_file(kempelen: Any, tmp_path: Path) -> None:
    file = tmp_path / "thesis.txt"
    file.write_text("three years of work")
    assert_told(kempelen("twin", "--link", file), TWIN, str(file), "where no file is yet")
    assert file.read_text() == "three years of work"


# --- engines ----------------------------------------------------------------------------------------------


def test_engines_that_are_none(kempelen: Any, tmp_path: Path) -> None:
    text = tmp_path / "notes"
    text.write_text("no program")
    assert_told(kempelen("watch", "--engine", "/no/engine"), ENGINE, "/no/engine", "leave --engine out")
    assert_told(kempelen("watch", "--engine", text), ENGINE, "not executable", f"chmod +x {text}")
    text.chmod(text.stat().st_mode | stat.S_IXUSR)
    assert_told(kempelen("watch", "--engine", text), ENGINE, str(text))


def test_an_engine_that_does_not_speak_uci(kempelen: Any, tmp_path: Path) -> None:
    dead = write_engine(tmp_path, "--start", "die", name="dead")
    assert_told(kempelen("watch", "--engine", dead), ENGINE, str(dead), "uciok", "Name another engine")


@pytest.mark.physics
def test_an_engine_that_crashes_on_go_loses_nothing(kempelen: Any, tmp_path: Path, data: Path) -> None:
    bad = write_engine(tmp_path, "--on-go", "die", name="bad")
    report = tmp_path / "report.json"
    told = kempelen("watch", "--engine", bad, "--speed", "max", "--report", report)
    assert_told(told, ENGINE, "named no move in 3 attempts", "resume")
    assert "kempelen resume 1" in told.all
    body = json.loads(report.read_text())
    assert (body["result"], body["reason"], body["plies"]) == ("*", "interrupted", 0)
    assert "named no move" in body["error"]
    with JournalReader(data) as journal:
        assert [game.over for game in journal.games()] == [False]


# --- journal, data directory, report ----------------------------------------------------------------------


def test_nothing_to_resume_or_export(kempelen: Any, data: Path) -> None:
    for command in ("resume", "pgn"):
        assert_told(kempelen(command), JOURNAL, str(data), "kempelen play")
    with Journal(data / "journal.sqlite3"):
        pass
    assert_told(kempelen("resume"), JOURNAL, "holds no unfinished game", "kempelen play")
    assert_told(kempelen("resume", "7"), JOURNAL, "has no game 7", "kempelen games")
    assert_told(kempelen("pgn", "7"), JOURNAL, "has no game 7", "kempelen games")


def test_a_journal_in_use(kempelen: Any, engine: Path, data: Path) -> None:
    with Journal(data / "journal.sqlite3"):
        told = kempelen("play", "--engine", engine)
        assert kempelen("games").code == 0  # looking on is allowed
    assert_told(told, JOURNAL, f"in use by process {os.getpid()}", "--data-dir")


def test_a_journal_that_is_none(kempelen: Any, engine: Path, data: Path) -> None:
    data.mkdir()
    (data / "journal.sqlite3").write_text("no database at all, but long enough to be looked at" * 20)
    assert_told(kempelen("play", "--engine", engine), JOURNAL, "journal.sqlite3", "damaged")
    assert "no database" in (data / "journal.sqlite3").read_text()


def test_a_data_directory_that_is_a_file_or_cannot_be(kempelen: Any, engine: Path, tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    assert_told(kempelen("play", "--data-dir", file), CONFIG, f"{file} is no directory", "--data-dir")
    told = kempelen("play", "--engine", engine, "--data-dir", "/proc/kempelen")
    assert_told(told, JOURNAL, "/proc/kempelen", "--data-dir")


@pytest.mark.parametrize("where", ["/proc/self/x/report.json", "."])
def test_a_report_that_cannot_be_written_is_told_before_the_game(
    kempelen: Any, engine: Path, data: Path, where: str
) -> None:
    told = kempelen("play", "--engine", engine, "--report", where)
    assert_told(told, CONFIG, f"{where} cannot be written", "that you may write to")
    assert not data.exists()


def test_a_file_to_export_to_that_cannot_be_written(kempelen: Any, finished: Path) -> None:
    told = kempelen("pgn", "--data-dir", finished, "--output", "/proc/self/x.pgn")
    assert_told(told, CONFIG, "/proc/self/x.pgn cannot be written", "that you may write to")


def test_a_game_that_is_over_cannot_be_resumed(kempelen: Any, finished: Path) -> None:
    told = kempelen("resume", "1", "--data-dir", finished)
    assert_told(told, JOURNAL, "Game 1 is over: 1-0", "kempelen pgn 1")


# --- the input ends ---------------------------------------------------------------------------------------


@pytest.mark.physics
def test_nobody_reads_the_output_any_more(tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    command = [
        sys.executable, "-m", "kempelen", "replay", str(FAMOUS), "--speed", "max",
        "--data-dir", str(tmp_path), "--report", str(report),
    ]  # fmt: skip
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        assert program.stderr is not None
        assert program.stdout.readline().startswith("Game 1:")
        program.stdout.close()
        errors = program.stderr.read()
    assert program.returncode == 128 + signal.SIGPIPE
    assert "Traceback" not in errors
    assert "kempelen resume 1" in errors
    assert json.loads(report.read_text())["reason"] == "interrupted"


@pytest.mark.physics
def test_a_disk_that_fills_up_in_mid_game_loses_nothing(kempelen: Any, data: Path) -> None:
    """No file of the program may grow over 100 kB: to it, the same as a full disk."""
    command = [sys.executable, "-m", "kempelen", "replay", str(FAMOUS), "--speed", "max"]
    limited = ["prlimit", "--fsize=100000", *command]
    ran = subprocess.run(limited, check=False, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert ran.returncode == JOURNAL, ran.stderr
    assert "Traceback" not in ran.stderr
    assert f"The journal {data / 'journal.sqlite3'} cannot be used" in ran.stderr
    assert "kempelen resume 1" in ran.stdout
    told = kempelen("resume", "--speed", "max")
    assert told.code == 0, told.all
    assert "Game over: 1-0, checkmate." in told.out
    assert "table differs" not in told.out


@pytest.mark.physics
def test_the_input_ends_when_a_person_is_to_move(kempelen: Any, engine: Path, data: Path) -> None:
    told = kempelen("play", "--engine", engine, "--speed", "max", typed="e4\n")
    assert_told(told, OPERATOR, "Standard input has ended", "White is to move", "Resume with")
    assert "kempelen resume 1" in told.all
    with JournalReader(data) as journal:
        assert journal.state(1).plies == 2


def test_benches_that_are_none(kempelen: Any, tmp_path: Path) -> None:
    assert_told(kempelen("bench", "speed"), CONFIG, "There is no bench 'speed'", "spectators, tracking, twin")
    told = kempelen("bench", "motion", "--json", tmp_path)
    assert_told(told, CONFIG, f"{tmp_path} cannot be written")
    told = kempelen("bench", "motion", "--clients", "5")
    assert_told(told, CONFIG, "bench motion does not take --clients", "bench spectators")


# --- what nobody foresaw ----------------------------------------------------------------------------------


def test_a_fault_of_ours_is_told_in_a_sentence_and_kept(
    kempelen: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("kempelen.cli.listing.show", _boom(ZeroDivisionError("by zero")))
    told = kempelen("games")
    assert_told(told, 70, "ZeroDivisionError: by zero", "Please report it")
    (kept,) = tmp_path.glob("kempelen-fault-*.txt")
    assert "Traceback" in kept.read_text()


def test_a_fault_of_the_system_names_the_file(kempelen: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    full = OSError(errno.ENOSPC, "No space left on device", "/data/x")
    monkeypatch.setattr("kempelen.cli.listing.show", _boom(full))
    assert_told(kempelen("games"), 1, "/data/x: No space left on device", "free space")


def _boom(error: Exception) -> Callable[..., None]:
    def fail(*_: object) -> None:
        raise error

    return fail
