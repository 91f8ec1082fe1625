"""Whole games on the twin, from the first turn to the report, told as scripts."""

import math
import os
import re
import signal
from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path
from typing import Any

import chess
import pytest

from kempelen.app.cast import GameRequest
from kempelen.app.report import GameReport
from kempelen.core.events import EngineThinking, Event
from kempelen.core.protocols import RobotPhase
from kempelen.game.modes import Mode
from kempelen.game.pgn import GameScore, read_game
from kempelen.testing.live import Stage
from kempelen.testing.scenarios import children_of

pytestmark = pytest.mark.physics

SPECIAL = Path(__file__).with_name("special.pgn")
STILL_MM = 1e-6
HELD_MM = 0.5  # between the gripper's centre and that of a piece in it


def replay_of(fen: str, *moves: str) -> GameRequest:
    """A game in SAN from a position."""
    board = chess.Board(fen)
    played = tuple(board.push_san(san) for san in moves)
    return GameRequest(Mode.REPLAY, fen, score=GameScore({}, fen, played, "*"))


def replay_file(path: Path, number: int = 1, **options: Any) -> GameRequest:
    score = read_game(path, number)
    return GameRequest(Mode.REPLAY, score.start_fen, score=score, **options)


def assert_well_placed(report: GameReport) -> None:
    assert report.placement is not None
    assert report.standing_max_mm is not None
    assert report.disagreements == []
    assert report.placement.toppled == 0
    assert report.placement.max_mm <= 2.0
    assert report.placement.neighbour_max_mm <= 1.0
    assert report.standing_max_mm <= 2.0
    assert report.collisions == 0


async def test_the_shortest_famous_game(tmp_path: Path) -> None:
    famous = Path(str(files("kempelen") / "data" / "famous.pgn"))
    async with Stage(tmp_path, replay_file(famous)) as stage:
        report = await stage.report()
    assert (report.result, report.plies, report.interventions) == ("1-0", 33, 0)
    assert report.final_fen == "1n1Rkb1r/p4ppp/4q3/4p1B1/4P3/8/PPP2PPP/2K5 b k - 1 17"
    assert stage.moves.endswith("16. Qb8+ Nxb8 17. Rd8#")
    assert stage.trace[-1] == "Game over: 1-0, checkmate."
    assert_well_placed(report)


SPECIAL_SCRIPT = """
    1. bxa8=N: the rook to a tray, the pawn to a tray, the knight to a8
    1... O-O: the king to g8, the rook to f8
    2. O-O: the king to g1, the rook to f1
    2... d5: the pawn to d5
    3. exd6: the pawn to a tray, the pawn to d6
    3... Nxc4: the bishop to a tray, the knight to c4
    4. d7: the pawn to d7
    4... Rxa8: the knight to a tray, the rook to a8
    5. d8=Q+: the pawn to a tray, the queen to d8
    5... Rxd8: the queen to a tray, the rook to d8
    6. Nd4: the knight to d4
    6... Rxd4: the knight to a tray, the rook to d4
"""


def script_of(trace: Iterable[str]) -> list[str]:
    """Each move with what was carried for it."""
    script: list[str] = []
    for line in trace:
        if line[0].isdigit():
            script.append(line + ":")
        elif line.startswith("carrying "):
            script[-1] += ("," if "the" in script[-1] else "") + re.sub(
                r"(left|right)\d+", "a tray", line.removeprefix("carrying")
            )
    return script


async def test_special_moves_transfer_by_transfer(tmp_path: Path) -> None:
    async with Stage(tmp_path, replay_file(SPECIAL)) as stage:
        report = await stage.report()
    assert script_of(stage.trace) == [line.strip() for line in SPECIAL_SCRIPT.strip().splitlines()]
    assert (report.transfers, report.interventions, report.reason) == (22, 0, "score ends")
    assert_well_placed(report)


async def test_a_person_against_the_engine_until_resignation(tmp_path: Path) -> None:
    async with Stage(tmp_path, GameRequest(Mode.PLAY)) as stage:
        stage.play()
        await stage.type("e4")
        await stage.cue("1... ")
        await stage.type("2. f4")
        await stage.cue("2... ")
        await stage.arbiter.resign(chess.WHITE)
        report = await stage.report()
    assert stage.moves.startswith("1. e4 ")
    assert report.plies == 4
    assert (report.result, report.reason) == ("0-1", "White resigns")
    assert_well_placed(report)


async def test_a_person_moves_the_pieces_by_hand(tmp_path: Path) -> None:
    """The virtual hand carries White's moves, the robot Black's; castling and captures by hand too."""
    fen = "rnbqk1nr/pppp1ppp/8/2b1p3/2B1P3/5N2/PPPP1PPP/RNBQK2R w KQkq - 0 1"
    request = GameRequest(Mode.PLAY, fen)
    async with Stage(tmp_path, request, play__hands="person") as stage:
        stage.play()
        await stage.type("Bxf7+")
        await stage.cue("1... ")
        await stage.type("O-O")
        await stage.cue("2... ")
        await stage.arbiter.resign(chess.WHITE)
        report = await stage.report()
        assert await stage.wrong() == []
    assert "1. Bxf7+ by hand" in stage.trace
    assert "2. O-O by hand" in stage.trace
    assert not [line for line in stage.trace if line == "carrying the bishop to f7"]
    assert report.interventions == 0


async def at_rest(stage: Stage) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the twin truly shows, twice."""
    return dict(await stage.truth()), dict(await stage.truth())


async def lifted(stage: Stage, kind: str, *, white: bool, mm: float) -> float:
    """Wait until such a piece hangs so high above the table, and say how high."""
    while True:
        for piece in (await stage.truth())["pieces"]:
            if (piece["kind"], piece["white"]) == (kind, white) and piece["z"] > mm:
                return float(piece["z"])


async def test_pause_with_a_piece_in_the_gripper(tmp_path: Path) -> None:
    """At once, in mid-air; it goes on where it was."""
    async with Stage(tmp_path, replay_of(chess.STARTING_FEN, "Nf3", "e5", "Nxe5")) as stage:
        await stage.control.ask("speed", speed=4)
        await stage.cue("carrying the knight to f3")
        surface = (await stage.piece("b1"))["z"]
        await lifted(stage, "N", white=True, mm=surface + 40.0)
        await stage.arbiter.pause()
        before, after = await at_rest(stage)
        assert math.dist(before["tool"], after["tool"]) < STILL_MM
        assert before["closed"]
        assert stage.live.session.robot.state.phase is RobotPhase.HELD
        assert stage.trace[-1] == "Paused in mid-transfer."
        assert math.dist(before["tool"][:2], held_piece(before, surface)) < HELD_MM
        await stage.control.ask("speed", speed=0)
        await stage.arbiter.resume()
        report = await stage.report()
    assert report.plies == 3
    assert_well_placed(report)


def held_piece(truth: dict[str, Any], surface: float) -> tuple[float, float]:
    """(x, y) of the piece in the air, mm."""
    (held,) = [piece for piece in truth["pieces"] if piece["z"] > surface + 20.0]
    return held["x"], held["y"]


async def test_finish_move_completes_what_is_in_hand_and_stays_paused(tmp_path: Path) -> None:
    async with Stage(tmp_path, replay_file(SPECIAL)) as stage:
        await stage.cue("carrying the king to g8")
        await stage.arbiter.pause()
        await stage.arbiter.finish_move()
        assert stage.moves == "1. bxa8=N O-O"
        assert stage.arbiter.paused
        assert stage.trace[-1] == "Paused."
        assert await stage.wrong() == []
        assert (await stage.piece("f8"))["kind"] == "R"
        before, after = await at_rest(stage)
        assert math.dist(before["tool"], after["tool"]) < STILL_MM
        await stage.arbiter.resume()
        assert_well_placed(await stage.report())


async def test_a_takeback_is_undone_on_the_table(tmp_path: Path) -> None:
    """A capture is taken back: the victim comes out of its tray."""
    fen = "4k3/8/8/3p4/4P3/8/8/4K3 w - - 0 1"
    async with Stage(tmp_path, GameRequest(Mode.PLAY, fen)) as stage:
        stage.play()
        await stage.type("exd5")
        await stage.cue("1... ")
        await stage.arbiter.takeback()
        await stage.cue("Taken back: exd5")
        assert stage.arbiter.state.plies == 0
        assert await stage.wrong() == []
        assert (await stage.piece("d5"))["white"] is False
        await stage.type("e5")
        await stage.cue("1... ")
        await stage.arbiter.resign(chess.WHITE)
        report = await stage.report()
    assert stage.moves.startswith("1. e5 ")
    assert_well_placed(report)


async def test_taking_a_replayed_game_over(tmp_path: Path) -> None:
    """A champion's game until Black's third move; then a person plays on, then the engine for both sides."""
    famous = Path(str(files("kempelen") / "data" / "famous.pgn"))
    request = replay_file(famous, take_over_move=3, person_plays=chess.BLACK)
    async with Stage(tmp_path, request) as stage:
        await stage.cue("3. d4")
        await stage.type("exd4")
        await stage.cue("4. ")
        await stage.live.swap_mode(GameRequest(Mode.WATCH))
        await stage.cue("5. ")
        await stage.arbiter.resign(chess.BLACK)
        report = await stage.report()
    assert stage.moves.startswith("1. e4 e5 2. Nf3 d6 3. d4 exd4 4. ")
    assert [line.split(":")[0] for line in stage.trace if line.startswith("Mode")] == [
        "Mode play",
        "Mode watch",
    ]
    assert report.result == "1-0"
    assert_well_placed(report)


async def test_the_virtual_person_brings_what_an_underpromotion_lacks(tmp_path: Path) -> None:
    """Both white knights are on the board: the third comes out of the drawer."""
    request = replay_of("4k3/1P6/8/8/8/8/8/1N2K1N1 w - - 0 1", "b8=N", "Ke7", "Nc6+")
    async with Stage(tmp_path, request) as stage:
        report = await stage.report()
    assert report.interventions == 1
    assert any(line.startswith("Please:") and "white knight" in line for line in stage.trace)
    assert report.final_fen.startswith("8/4k3/2N5/")
    assert_well_placed(report)


def engines() -> list[int]:
    """Processes of this one that are no twin."""
    return [pid for pid, command in children_of(os.getpid()).items() if "kempelen.twin" not in command]


async def test_an_engine_that_dies_while_it_thinks_is_started_again(tmp_path: Path) -> None:
    full = {"engine__level": "full", "engine__move_time": 1.5}  # it thinks for that long, whatever it sees
    async with Stage(tmp_path, GameRequest(Mode.PLAY), **full) as stage:
        (before,) = engines()
        killed: list[int] = []

        def kill_at_first_thought(event: Event) -> None:
            if isinstance(event, EngineThinking) and not killed:
                os.kill(before, signal.SIGKILL)
                killed.append(before)

        stage.arbiter.events.listen(kill_at_first_thought)
        stage.play()
        await stage.type("e4")
        await stage.cue("1... ")
        (after,) = engines()
        await stage.arbiter.resign(chess.WHITE)
        report = await stage.report()
    assert killed == [before]
    assert after != before
    assert report.plies == 2
    assert_well_placed(report)
