"""Games through the camera: the virtual hand moves, the eye reads, what the robot does is looked at."""

import json
import os
import signal
from datetime import UTC, datetime
from pathlib import Path

import chess
import pytest

from kempelen.app.calibration_file import load_calibration, save_calibration
from kempelen.app.camera_pose import CameraPose, as_calibration, measure_board, save_camera_pose, shift_of
from kempelen.app.cameras import open_view
from kempelen.app.cast import GameRequest
from kempelen.app.config import load_config
from kempelen.app.eye import Eye, EyeSettings
from kempelen.app.people import VirtualPerson
from kempelen.core import events
from kempelen.core.geometry import Transform
from kempelen.core.places import Place
from kempelen.core.senses import Sight
from kempelen.game.board_person import BoardPerson
from kempelen.game.modes import Mode
from kempelen.testing.live import Stage
from kempelen.testing.scenarios import Kill, Program

pytestmark = pytest.mark.physics

FORCED = "kn6/3Q4/5p1p/2p2P1P/2P1p3/1R2P3/PP2BPP1/4K2R w K - 0 1"
"""After a capture on b8 Black can only take back, and after castling only go to a8: no engine spoils it."""
CAPTURE = "4k3/pp6/2n5/3p4/4P3/5N2/PP6/4K3 w - - 0 1"


def seen(folder: Path, fen: str = chess.STARTING_FEN) -> Stage:
    return Stage(folder, GameRequest(Mode.PLAY, fen), sensor__kind="camera", play__hands="person")


async def test_captures_and_castling_are_read_off_the_board(tmp_path: Path) -> None:
    """What is typed is made by hand; the program knows of it by seeing it alone."""
    async with seen(tmp_path, FORCED) as stage:
        stage.play()
        await stage.type("Rxb8+")
        await stage.cue("1. Rxb8+ by hand")
        await stage.cue("1... Kxb8")
        await stage.type("O-O")
        await stage.cue("2. O-O by hand")
        await stage.cue("2... Ka8")
        await stage.type("g3")  # typed as soon as it is wanted, that is, when the robot's move has been seen
        await stage.cue("3. g3 by hand")
        await stage.arbiter.resign(chess.WHITE)
        report = await stage.report()
        assert await stage.wrong() == []
        person = stage.live.cast.person
        assert isinstance(person, BoardPerson)
        assert person.answered == 0
    assert (report.interventions, report.disagreements) == (0, [])


async def test_a_hand_that_moves_without_a_word(tmp_path: Path) -> None:
    """Nobody types: the person moves, takes the move and its answer back on the board, and moves again."""
    async with seen(tmp_path) as stage:
        stage.play()
        person = stage.live.person
        assert isinstance(person, VirtualPerson)
        await stage.cue("The board is in sight.")
        assert stage.live.eyes is not None
        await stage.live.eyes.awake()
        await person.play(stage.live.board.copy(), chess.Move.from_uci("e2e4"))
        await stage.cue("1. e4 by hand")
        reply = await stage.cue("1... ")
        await stage.wanted()
        taken_back = stage.live.board.copy()
        move = taken_back.pop()
        x, y = stage.live.session.table.centre(Place.at(move.to_square))[:2].tolist()
        home = stage.live.session.table.centre(Place.at(move.from_square))[:2].tolist()
        await stage.control.ask("carry", **{"from": [x, y], "to": home})
        e4, e2 = (stage.live.session.table.centre(Place(name))[:2].tolist() for name in ("e4", "e2"))
        await stage.control.ask("carry", **{"from": e4, "to": e2})
        await stage.cue("Taken back: e4")
        assert stage.live.board.move_stack == []
        assert reply
        await stage.arbiter.resign(chess.WHITE)
        await stage.report()
        assert await stage.wrong() == []


async def test_the_eye_and_the_camera_die_and_the_lights_go_out(tmp_path: Path) -> None:
    async with seen(tmp_path) as stage:
        sights: list[Sight] = []
        stage.arbiter.events.listen(
            lambda event: sights.append(event.sight) if isinstance(event, events.SensorChanged) else None
        )
        stage.play()
        await stage.type("e4")
        await stage.cue("1. e4 by hand")
        assert stage.live.eyes is not None
        os.kill(stage.live.eyes.eye.pid or 0, signal.SIGKILL)
        await stage.cue("1... ")
        await stage.type("d4")
        await stage.cue("2. d4 by hand")
        await stage.control.ask("camera", change={"lighting": {"on": False}})
        await stage.cue("The board is not in sight (dark).")
        await stage.control.ask("camera", change={"lighting": {"on": True}})
        await stage.cue("The board is in sight.")
        cameras = (await stage.control.ask("stats"))["cameras"]
        os.kill(cameras[0]["pid"], signal.SIGKILL)
        await stage.cue("The board is not in sight (no camera).")
        await stage.cue("The board is in sight.")
        await stage.wanted()
        await stage.type(next(iter(stage.live.board.legal_moves)).uci())  # the engine may have given check
        await stage.cue("3. ")
        await stage.arbiter.resign(chess.WHITE)
        report = await stage.report()
        assert await stage.wrong() == []
    assert report.disagreements == []
    assert Sight.DARK in sights


@pytest.mark.parametrize(
    "after",
    [
        pytest.param("2. ", marks=pytest.mark.soak),
        "carrying",
        pytest.param("stands on", marks=pytest.mark.soak),
    ],
)
def test_killed_in_a_game_through_the_camera(tmp_path: Path, after: str) -> None:
    """While the person's hand is at work, while the robot carries, and before its move has been seen."""
    report = tmp_path / "report.json"
    options = ("--data-dir", str(tmp_path), "--speed", "max", "--report", str(report), "--sensor", "camera")
    begin = ("play", "--fen", CAPTURE, "--level", "1", "--move-time", "0.05")
    with Program(*begin, *options, typing=True) as program:
        program.type("exd5")
        program.type("Kf2")
        assert Kill(after, 1, 0.05).strike(program), program.output
    with Program("resume", "1", *options, typing=True) as program:
        assert program.until("Your move, White."), program.output + program.errors
        program.type("resign")
        assert program.wait() == 0, program.errors
    written = json.loads(report.read_text(encoding="utf-8"))
    assert written["disagreements"] == []
    assert written["interventions"] == 0


async def test_a_board_elsewhere_than_it_was_touched_is_measured_by_camera_alone(tmp_path: Path) -> None:
    """As after a bump: the robot believes the board 7 mm off and turned; the camera tells it better."""
    config = load_config(None, {"data.dir": str(tmp_path), "sensor.kind": "camera"})
    true = config.build_table().robot_from_board
    async with open_view(config, chess.Board()) as frames, Eye(frames, EyeSettings(square=50.0)) as eye:
        eye.expect(chess.Board())
        seen_at = await measure_board(eye, 50.0)
    pose = CameraPose(true @ seen_at.camera_from_board.inverse(), "twin", seen_at.spread, datetime.now(UTC))
    save_camera_pose(config.camera_calibration_path, pose)
    before = true @ Transform.about_z(0.012, (6.0, -4.0, 0.0))
    save_calibration(config.calibration_path, as_calibration(before, 50.0))
    async with seen(tmp_path) as stage:
        stage.play()
        await stage.cue("The board is in sight.")
        said = await stage.live.board_was_bumped()
        table = stage.live.session.table
        assert "The board has moved by" in said
        assert not stage.arbiter.paused
        assert shift_of(true, before, 50.0) > 5.0
        assert shift_of(true, table.robot_from_board, 50.0) < 1.5
        await stage.type("e4")
        await stage.cue("1. e4 by hand")
        await stage.cue("1... ")
        await stage.wanted()
        await stage.arbiter.resign(chess.WHITE)
        report = await stage.report()
        assert await stage.wrong() == []
    assert report.interventions == 0
    assert load_calibration(config.calibration_path) is not None
