"""Is what the robot has done as it should be?"""

import chess
import pytest

from kempelen.app.judge import BoardJudge, missed_of
from kempelen.core.pieces import PRESETS
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.senses import Sight
from kempelen.core.table import Table, start_layout
from kempelen.game.verify import Fault, SensorVerifier
from kempelen.sensing.moves.verdicts import Difference
from kempelen.testing.eyes import ScriptedSensor
from kempelen.testing.observations import Sensor, with_changes

PAWN = Transfer(chess.Piece.from_symbol("P"), Place("e2"), Place("e4"))
START = start_layout(Table(), chess.Board())
AFTER = START.after(PAWN)


def board_of(layout: Layout) -> chess.BaseBoard:
    board = chess.BaseBoard(None)
    board.set_piece_map(layout.board_part())
    return board


def judge(*transfers: Transfer, standing: Layout = AFTER) -> BoardJudge:
    return BoardJudge(transfers, standing, PRESETS["club"], centred=8.0)


def verdict(judge: BoardJudge, position: object, frames: int = 40) -> "bool | Fault":
    sensor = Sensor(rate=10.0)
    answer: bool | Fault = False
    for _ in range(frames):
        answer = judge.update(sensor.see(position))  # type: ignore[arg-type]
        if answer is not False:
            return answer
    return answer


def test_what_stands_right_is_right() -> None:
    assert verdict(judge(PAWN), board_of(AFTER)) is True


def test_a_piece_still_at_its_source_was_missed() -> None:
    found = verdict(judge(PAWN), board_of(START))
    assert isinstance(found, Fault)
    assert found.missed == (PAWN,)
    assert "e4" in found.text


def test_a_piece_that_is_nowhere_is_a_persons_affair() -> None:
    found = verdict(judge(PAWN), with_changes(board_of(START), {"e2": "empty"}))
    assert isinstance(found, Fault)
    assert (found.missed, found.doubtful) == ((), False)


def test_a_second_thing_wrong_is_not_mended_by_trying_again() -> None:
    found = verdict(judge(PAWN), with_changes(board_of(START), {"d7": "empty"}))
    assert isinstance(found, Fault)
    assert found.missed == ()


def test_what_cannot_be_made_out_is_asked_about_in_the_end() -> None:
    sensor = Sensor(vague=frozenset({"e4"}), rate=10.0)
    asked = judge(PAWN)
    answers = [asked.update(sensor.see(board_of(AFTER))) for _ in range(60)]
    first = next(answer for answer in answers if answer is not False)
    assert isinstance(first, Fault)
    assert first.doubtful
    assert "e4" in first.text


def test_nothing_is_judged_while_nothing_is_seen() -> None:
    sensor = Sensor(rate=10.0)
    asked = judge(PAWN)
    assert not any(asked.update(seen) for seen in sensor.blind(Sight.DARK, seconds=20.0))


def test_a_hand_that_is_leaving_is_no_fault() -> None:
    """What was seen before the hand came is forgotten."""
    sensor = Sensor(rate=10.0)
    asked = judge(PAWN)
    for _ in range(7):
        assert asked.update(sensor.see(board_of(START))) is False
    assert not any(asked.update(seen) for seen in sensor.hand())
    assert verdict(asked, board_of(AFTER)) is True


@pytest.mark.parametrize("piece", ["p", "P"])
def test_only_its_own_colour_can_still_be_there(piece: str) -> None:
    transfer = Transfer(chess.Piece.from_symbol(piece), Place("d5"), Place("right5"))
    seen = [Difference(chess.D5, None, 2)]
    assert missed_of([transfer], seen) == ((transfer,) if piece == "p" else ())


async def test_the_verifier_waits_for_a_clear_view() -> None:
    sensor = Sensor(rate=10.0)
    frames = [*sensor.blind(Sight.COVERED, 2.0), *sensor.hand(1.0), *sensor.watch(board_of(AFTER), 1.0)]
    verifier = SensorVerifier(
        ScriptedSensor(frames), lambda moved, standing: judge(*moved, standing=standing)
    )
    assert await verifier.confirm([PAWN], AFTER) is None
    assert await verifier.in_view()


async def test_a_hand_bars_the_robot_and_blindness_does_not() -> None:
    sensor = Sensor(rate=10.0)
    eyes = ScriptedSensor(sensor.hand(1.0))
    verifier = SensorVerifier(eyes, lambda moved, standing: judge(*moved, standing=standing))
    assert not await verifier.in_view()
    eyes.show(*sensor.hand(0.3), *sensor.blind(Sight.NO_CAMERA, 0.1))
    await verifier.unobstructed()
    verifier.looks = False
    eyes.show(*sensor.hand(0.1))
    await verifier.unobstructed()
    assert await verifier.confirm([PAWN], AFTER) is None
