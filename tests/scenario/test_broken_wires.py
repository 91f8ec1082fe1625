"""The wire and the machine fail in mid-transfer: the error is clear, nothing is lost, the game goes on."""

import math
import re
from pathlib import Path
from typing import Any

import pytest

from kempelen.app.cast import GameRequest
from kempelen.core.errors import AlarmError, KempelenError, RobotError
from kempelen.core.places import Place
from kempelen.game.modes import Mode
from kempelen.game.pgn import read_game
from kempelen.testing.live import Stage

pytestmark = pytest.mark.physics

SPECIAL = Path(__file__).with_name("special.pgn")
FINAL_FEN = "6k1/5ppp/8/8/2nr4/8/P4PPP/R4RK1 w - - 0 7"

MENDED: dict[str, dict[str, Any]] = {"garble": {"in": 0.0, "out": 0.0}, "delay": {"seconds": 0.0}}


def special() -> GameRequest:
    score = read_game(SPECIAL, 1)
    return GameRequest(Mode.REPLAY, score.start_fen, score=score)


async def castling(stage: Stage, cue: str) -> None:
    """Up to ``cue``: from the move on at a machine's own pace, so that on a busy computer nothing goes by."""
    await stage.cue("1... O-O")
    await stage.control.ask("speed", speed=1.0)
    await stage.cue(cue)


async def broken_off(data: Path, cue: str, name: str, **how: Any) -> KempelenError:
    """Play until ``cue``, break something, and give the error that ends the program's run."""
    async with Stage(data, special()) as stage:
        await castling(stage, cue)
        await stage.fault(name, **how)
        with pytest.raises(KempelenError) as caught:
            await stage.report()
        if name in MENDED:
            await stage.fault(name, **MENDED[name])
    return caught.value


async def assert_goes_on(data: Path) -> int:
    """Resume; the game ends as it should. How often somebody had to help."""
    async with Stage(data, 1) as stage:
        report = await stage.report()
    assert report.final_fen == FINAL_FEN
    assert report.disagreements == []
    assert report.standing_max_mm is not None
    assert report.standing_max_mm <= 2.0
    assert report.placement is not None
    assert report.placement.toppled == 0
    return report.interventions


Fault = tuple[str, dict[str, Any], str]
DROPPED: Fault = ("drop-link", {}, "The connection to .* is lost")
SWALLOWED = ("swallow-ok", {"count": 1}, "owes 1 acknowledgement")
SILENCE = r"no answer (for|to a status query within) 5 s"  # the watchdog or a barrier, whoever asked first
DEAF = ("garble", {"in": 1.0}, SILENCE)
MUMBLING = ("garble", {"out": 1.0}, SILENCE)
RESTARTED: Fault = ("reset", {}, "restarted in the middle of its work")

FETCHING, CARRYING, STANDING = "fetching the king from e8", "carrying the king to g8", "king stands on g8"


@pytest.mark.parametrize(
    ("cue", "fault", "helps"),
    [
        pytest.param(FETCHING, DROPPED, 0, marks=pytest.mark.soak),
        (CARRYING, DROPPED, 0),
        pytest.param(STANDING, DROPPED, 0, marks=pytest.mark.soak),
        (CARRYING, SWALLOWED, 0),
        (CARRYING, DEAF, 0),
        pytest.param(STANDING, MUMBLING, 0, marks=pytest.mark.soak),
        (CARRYING, RESTARTED, 0),
        (FETCHING, RESTARTED, 1),  # it closed by itself, perhaps around the piece: only eyes can tell
        (STANDING, RESTARTED, 2),
    ],
)
async def test_a_fault_in_mid_transfer(tmp_path: Path, cue: str, fault: Fault, helps: int) -> None:
    name, how, words = fault
    error = await broken_off(tmp_path, cue, name, **how)
    assert isinstance(error, RobotError)
    assert re.search(words, error.message)
    assert error.hint
    assert await assert_goes_on(tmp_path) <= helps


async def test_a_dead_switch_stops_the_homing_of_a_resumed_game(tmp_path: Path) -> None:
    """With a piece in the gripper; once the switch is mended, the piece is put where it belongs."""
    async with Stage(tmp_path, special()) as stage:
        await castling(stage, CARRYING)
        await stage.fault("dead-switch", axis="X")
    async with Stage(tmp_path, 1) as stage:
        with pytest.raises(AlarmError, match=r"(?i)homing") as caught:
            await stage.report()
        await stage.fault("dead-switch", axis="X", on=False)
    assert caught.value.hint
    assert await assert_goes_on(tmp_path) == 0


async def test_a_slip_is_told_by_the_report_and_gone_after_the_next_homing(tmp_path: Path) -> None:
    """Steps lost by an axis without an encoder go unnoticed; the grip forgives a millimetre."""
    async with Stage(tmp_path, special()) as stage:
        await castling(stage, FETCHING)
        await stage.fault("lose-steps", axis="Y", steps=80)
        await stage.cue(STANDING)
        await stage.arbiter.pause()
        assert await off_centre(stage, "g8") == pytest.approx(1.0, abs=0.2)
    async with Stage(tmp_path, 1) as stage:
        await stage.cue("rook stands on f8")
        await stage.cue(STANDING.replace("g8", "g1"))
        await stage.arbiter.pause()
        assert await off_centre(stage, "f8") <= 0.3
        assert await off_centre(stage, "g1") <= 0.3
        await stage.arbiter.resume()
        report = await stage.report()
    assert report.disagreements == []
    assert report.standing_max_mm == pytest.approx(1.0, abs=0.2)


async def off_centre(stage: Stage, square: str) -> float:
    """How far from the centre of a square the piece on it really stands, mm."""
    x, y, _ = stage.live.session.table.centre(Place(square))
    piece = await stage.piece(square)
    return math.hypot(piece["x"] - x, piece["y"] - y)


async def test_a_twin_that_dies_takes_its_table_along(tmp_path: Path) -> None:
    """The error says so; the resumed game has its table set up again."""
    async with Stage(tmp_path, special()) as stage:
        await stage.cue(CARRYING)
        stage.kill_twin()
        with pytest.raises(KempelenError) as caught:
            await stage.report()
    assert caught.value.hint
    assert stage.live.notices == []
    async with Stage(tmp_path, 1) as stage:
        assert "set up another one as the journal has it" in "".join(stage.live.notices)
        report = await stage.report()
    assert report.interventions == 1
    assert report.final_fen == FINAL_FEN
    assert report.disagreements == []
