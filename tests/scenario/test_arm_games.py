"""Games by the simulated arm, told as scripts; the long ones are soak tests and `kempelen bench arm`."""

from pathlib import Path

import chess
import pytest

from kempelen.app.cast import GameRequest
from kempelen.bench.arm import ARM, UNCARED, play
from kempelen.game.modes import Mode
from kempelen.game.pgn import GameScore
from kempelen.testing.live import Stage

pytestmark = pytest.mark.physics

CASTLES = "r3k2r/8/8/3pP3/8/8/8/R3K2R w KQkq d6 0 2"


def replay_of(fen: str, *moves: str) -> GameScore:
    board = chess.Board(fen)
    return GameScore({}, fen, tuple(board.push_san(san) for san in moves), "*")


async def test_an_arm_captures_en_passant_and_castles(tmp_path: Path) -> None:
    score = replay_of(CASTLES, "exd6", "O-O")
    request = GameRequest(Mode.REPLAY, score.start_fen, score=score)
    options = {"robot__kind": "arm", "sensor__kind": "none"}
    async with Stage(tmp_path, request, **options) as stage:
        report = await stage.report()
    assert (report.plies, report.transfers, report.interventions) == (2, 4, 0)
    assert report.disagreements == []
    assert report.placement is not None
    assert report.placement.toppled == 0
    assert report.placement.max_mm <= 4.0
    assert report.placement.neighbour_max_mm <= 1.0


@pytest.mark.soak
async def test_without_care_a_queen_is_missed_and_with_it_she_is_not() -> None:
    way = ["Qa1", "Kc8", "Qg1", "Kd8", "Qb1", "Kc8", "Qf1", "Kd8"] * 4
    score = replay_of("3k4/8/8/8/8/7K/8/4Q3 w - - 0 1", *way)
    missed = await play(score, 1, UNCARED, until_failure=True)
    cared = await play(score, 1, ARM)
    assert missed.failed
    assert cared.failed == []
    assert cared.rehomings > 0
