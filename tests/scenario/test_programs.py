"""The program as it is started from a shell: what it prints, how it ends, and how it goes on."""

import json
import signal
from pathlib import Path

import chess
import pytest

from kempelen.game.journal import JournalReader
from kempelen.testing.scenarios import Program

pytestmark = pytest.mark.physics

SPECIAL = Path(__file__).with_name("special.pgn")


def test_moves_typed_into_a_pipe(tmp_path: Path) -> None:
    """A person at a pipe against the weakest engine, from a position of their own, until they resign."""
    report = tmp_path / "report.json"
    fen = "4k3/pppp4/8/8/8/8/4PPPP/4K3 w - - 0 1"
    with Program(
        "play", "--fen", fen, "--level", "1", "--move-time", "0.05", "--speed", "max",
        "--data-dir", str(tmp_path), "--report", str(report), typing=True,
    ) as program:  # fmt: skip
        for number, move in enumerate(("e4", "f2f4", "g2-g4"), start=1):
            program.type(move)
            assert program.until(f"{number}... "), program.output + program.errors
            assert program.until("stands on")
        program.type("h9")
        program.type("resign")
        assert program.wait() == 0, program.errors
    written = json.loads(report.read_text(encoding="utf-8"))
    assert (written["result"], written["reason"], written["plies"]) == ("0-1", "White resigns", 6)
    assert written["disagreements"] == []
    assert "h9" in program.output  # told that it is no move
    assert "Game over: 0-1, White resigns." in program.output


@pytest.mark.parametrize(
    "number", [signal.SIGINT, signal.SIGTERM, pytest.param(signal.SIGHUP, marks=pytest.mark.soak)]
)
def test_a_signal_leaves_the_robot_at_rest_and_says_how_to_resume(
    tmp_path: Path, number: signal.Signals
) -> None:
    """Ctrl-C, a polite kill and a closed terminal, with a piece in the gripper."""
    options = ("--data-dir", str(tmp_path), "--speed", "max")
    with Program("replay", str(SPECIAL), *options) as program:
        assert program.until("carrying the king to g1")
        program.send(number)
        assert program.wait() == 128 + number
        assert "kempelen resume 1" in program.output + program.errors
        assert "Traceback" not in program.errors
    report = tmp_path / "report.json"
    with Program("resume", *options, "--report", str(report)) as program:
        assert program.wait() == 0, program.errors
    written = json.loads(report.read_text(encoding="utf-8"))
    assert written["disagreements"] == []
    assert written["interventions"] == 0
    assert written["standing_max_mm"] <= 2.0


def test_the_board_is_set_up_again_after_a_game(tmp_path: Path) -> None:
    """Captured pieces out of the trays, the promoted ones back into them; cut off once, it goes on."""
    options = ("--data-dir", str(tmp_path), "--speed", "max")
    with Program("replay", str(SPECIAL), *options) as program:
        assert program.wait() == 0, program.errors
    with Program("setup", *options) as program:
        assert program.until("carrying the")
        program.send(signal.SIGINT)
        assert program.wait() == 128 + signal.SIGINT
        assert "kempelen resume 2" in program.output + program.errors
    report = tmp_path / "report.json"
    with Program("resume", *options, "--report", str(report)) as program:
        assert program.wait() == 0, program.errors
        assert "The position is set up." in program.output
    written = json.loads(report.read_text(encoding="utf-8"))
    assert written["final_fen"] == chess.STARTING_FEN
    assert (written["disagreements"], written["interventions"]) == ([], 0)


def test_what_cannot_be_set_up_is_refused(tmp_path: Path) -> None:
    options = ("--data-dir", str(tmp_path))
    for what, why in (
        (("setup", "--from", "7"), "There is no journal"),
        (("setup", "8/8/8/8/8/8/8/8 w - - 0 1"), "the board is empty"),
        (("setup", "--from", "nowhere"), "cannot be read as FEN"),
    ):
        with Program(*what, *options) as program:
            assert program.wait() not in (0, None)
            assert why in program.output + program.errors


def test_the_end_of_typing_is_no_end_of_the_game(tmp_path: Path) -> None:
    """When the pipe runs dry and a move is wanted, the program leaves and says how to go on."""
    options = ("--move-time", "0.05", "--speed", "max", "--data-dir", str(tmp_path))
    with Program("play", "--level", "1", *options, typing=True) as program:
        program.type("e4")
        assert program.wait() not in {0, -9}, program.errors
        assert "kempelen resume 1" in program.output + program.errors
    with JournalReader(tmp_path / "journal.sqlite3") as journal:
        assert journal.state(1).plies == 2


def test_a_twin_that_dies_under_a_program_is_told_in_words(tmp_path: Path) -> None:
    options = ("--data-dir", str(tmp_path), "--speed", "max")
    with Program("replay", str(SPECIAL), *options) as program:
        assert program.until("carrying the king to g1")
        program.kill_twin()
        assert program.wait() not in {0, -9}
        assert "Traceback" not in program.errors
        assert "kempelen resume 1" in program.output + program.errors


def test_a_second_program_on_the_same_games_is_refused(tmp_path: Path) -> None:
    options = ("--data-dir", str(tmp_path))  # at its own pace the first one plays for minutes
    with Program("replay", str(SPECIAL), *options) as program:
        assert program.until("fetching")
        with Program("resume", "1", *options) as second:
            assert second.wait() not in {0, -9}
            assert str(tmp_path) in second.errors.replace("\n", "")
        program.send(signal.SIGINT)
        assert program.wait() == 128 + signal.SIGINT, program.errors
        assert "kempelen resume 1" in program.output + program.errors


def test_the_end_of_typing_in_a_pause(tmp_path: Path) -> None:
    """Nobody can end the pause: the program says so instead of waiting for ever."""
    options = ("--speed", "max", "--data-dir", str(tmp_path))
    with Program("replay", str(SPECIAL), *options, typing=True) as program:
        assert program.until("carrying the king to g1")
        program.type("pause")
        assert program.wait() not in {0, -9}, program.errors
        assert "paused" in program.errors
        assert "kempelen resume 1" in program.output + program.errors


def test_what_the_journal_holds_is_listed_exported_and_gone_on_with(tmp_path: Path) -> None:
    data = ("--data-dir", str(tmp_path))
    with Program("replay", str(SPECIAL), *data, "--speed", "max") as program:
        assert program.until("carrying the king to g1")
        program.kill()
    with Program("games", *data) as program:
        assert program.wait() == 0
        assert "unfinished" in program.output
    with Program("resume", *data, "--speed", "max") as program:
        assert program.wait() == 0, program.errors
    with Program("pgn", "1", *data) as program:
        assert program.wait() == 0
        assert "5. d8=Q+ Rxd8 6. Nd4 Rxd4" in program.output.replace("\n", " ")
    with Program("resume", *data) as program:
        assert program.wait() not in {0, -9}
        assert "no unfinished game" in program.errors


def test_a_wrong_calibration_shows_on_the_board(tmp_path: Path) -> None:
    """The twin's board stands where it stands: a calibration that is 1 mm off puts every piece 1 mm off."""
    corners = ("--corner", "a1=151,25,0", "--corner", "h1=551,25,0", "--corner", "h8=551,425,0")
    with Program("calibrate", *corners, "--data-dir", str(tmp_path)) as program:
        assert program.wait() == 0, program.errors
    report = tmp_path / "report.json"
    options = ("--speed", "max", "--data-dir", str(tmp_path), "--report", str(report))
    with Program("replay", str(SPECIAL), *options) as program:
        assert program.wait() == 0, program.errors
    written = json.loads(report.read_text(encoding="utf-8"))
    assert written["placement"]["mean_mm"] == pytest.approx(1.0, abs=0.15)
    assert written["disagreements"] == []
