"""Does the table agree with what should stand there?"""

from dataclasses import replace

import chess
import numpy as np
import pytest

from kempelen.core.geometry import Array
from kempelen.core.pieces import PRESETS
from kempelen.core.places import Place, Transfer
from kempelen.core.senses import Observation, Sight
from kempelen.sensing.moves.check import Agrees, CannotTell, CheckParameters, Disagrees, PositionCheck
from kempelen.sensing.moves.reader import MoveReader
from kempelen.testing.move_scenes import board_of
from kempelen.testing.observations import Sensor, with_changes

Result = Agrees | Disagrees | CannotTell
CLUB = PRESETS["club"]


def knight_to_f3() -> tuple[chess.Board, Transfer]:
    transfer = Transfer(chess.Piece.from_symbol("N"), Place("g1"), Place("f3"))
    return board_of("Nf3"), transfer


def look(check: PositionCheck, observations: list[Observation]) -> Result:
    return [check.update(o) for o in observations][-1]


def checked(changes: dict[str, str] | None = None, sensor: Sensor | None = None) -> Result:
    board, transfer = knight_to_f3()
    seen = with_changes(board, changes or {})
    return look(PositionCheck(board, [transfer]), list((sensor or Sensor()).watch(seen, 0.3)))


def measured(heights: Array, offsets: Array | None = None) -> list[Observation]:
    board, _ = knight_to_f3()
    return [replace(o, heights=heights, offsets=offsets) for o in Sensor().watch(board, 0.3)]


def nominal_heights(board: chess.Board, scale: float = 1.0) -> Array:
    out = np.zeros(64)
    for square, piece in board.piece_map().items():
        out[square] = scale * CLUB[piece.piece_type].height
    return out


def test_a_transfer_that_went_well() -> None:
    assert isinstance(checked(), Agrees)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"f3": "empty"}, "F3 is empty. Put the white knight back on f3."),
        ({"g1": "white", "f3": "empty"}, "Put the white knight from g1 back on f3."),
        ({"g1": "white"}, "A white piece stands on g1. Take the white piece off g1."),
        ({"f3": "empty", "g3": "white"}, "Put the white knight from g3 back on f3."),
        ({"f2": "empty"}, "F2 is empty. Put the white pawn back on f2."),
        ({"f3": "black"}, "A black piece stands on f3."),
    ],
)
def test_a_transfer_that_went_wrong(changes: dict[str, str], words: str) -> None:
    result = checked(changes)
    assert isinstance(result, Disagrees)
    assert words in result.sentence
    assert {chess.square_name(d.square) for d in result.differences} == set(changes)


def test_too_little_seen_tells_nothing() -> None:
    board, transfer = knight_to_f3()
    check = PositionCheck(board, [transfer])
    assert isinstance(check.update(Sensor().see(board)), CannotTell)


def test_a_hand_starts_it_again() -> None:
    board, transfer = knight_to_f3()
    check, sensor = PositionCheck(board, [transfer]), Sensor()
    assert isinstance(look(check, list(sensor.watch(board, 0.3))), Agrees)
    blind = look(check, list(sensor.blind(Sight.HAND, 0.1)))
    assert isinstance(blind, CannotTell)
    assert blind.reason == "Not to be seen: hand."
    assert isinstance(check.update(sensor.see(board)), CannotTell)


def test_a_vague_square_of_the_transfer_is_not_agreed_to() -> None:
    result = checked(sensor=Sensor(vague=frozenset({"f3"})))
    assert isinstance(result, CannotTell)
    assert result.reason == "It cannot be made out what stands on f3."


def test_a_square_that_never_reads_well_is_known() -> None:
    before, sensor = chess.Board(), Sensor(stuck={"h5": "black"})
    board, transfer = knight_to_f3()
    reader = MoveReader(before)
    for observation in sensor.watch(before, 1):
        reader.update(observation)
    look_before = reader.expected_look
    assert isinstance(
        look(PositionCheck(board, [transfer]), list(sensor.watch(board, 0.3))), Disagrees
    )  # not known: said
    check = PositionCheck(board, [transfer], look=look_before)
    assert isinstance(look(check, list(sensor.watch(board, 0.3))), Agrees)


def test_set_up() -> None:
    board = chess.Board()
    check = PositionCheck(board)
    assert isinstance(look(check, list(Sensor().watch(board, 0.3))), Agrees)
    wrong = look(check, list(Sensor().watch(with_changes(board, {"d1": "empty"}), 0.3)))
    assert isinstance(wrong, Disagrees)
    assert wrong.sentence == "D1 is empty. Put the white queen back on d1."


@pytest.mark.parametrize("scale", [0.7, 1.0])
def test_upright_and_fallen(scale: float) -> None:
    """Whatever share of the true height the sensor reads."""
    board, transfer = knight_to_f3()
    heights = nominal_heights(board, scale)
    assert isinstance(look(PositionCheck(board, [transfer], pieces=CLUB), measured(heights)), Agrees)
    heights[chess.F3] = scale * CLUB[chess.KNIGHT].base_diameter
    fallen = look(PositionCheck(board, [transfer], pieces=CLUB), measured(heights))
    assert isinstance(fallen, Disagrees)
    assert fallen.sentence == "The white knight on f3 has fallen over: stand it up."


def test_a_height_between_is_not_agreed_to() -> None:
    board, transfer = knight_to_f3()
    heights = nominal_heights(board)
    heights[chess.F3] = (CLUB[chess.KNIGHT].height + CLUB[chess.KNIGHT].base_diameter) / 2
    result = look(PositionCheck(board, [transfer], pieces=CLUB), measured(heights))
    assert isinstance(result, CannotTell)
    assert result.reason == "The white knight on f3 may have fallen over."


def test_heights_that_nobody_measured_do_not_count() -> None:
    board, transfer = knight_to_f3()
    heights = np.full(64, np.nan)
    assert isinstance(look(PositionCheck(board, [transfer], pieces=CLUB), measured(heights)), Agrees)


def test_off_the_middle() -> None:
    board, transfer = knight_to_f3()
    offsets = np.full((64, 2), np.nan)
    offsets[chess.F3] = 3.0, -4.0
    observations = measured(nominal_heights(board), offsets)
    assert isinstance(look(PositionCheck(board, [transfer], pieces=CLUB), observations), Agrees)
    offsets[chess.F3] = 9.0, -12.0
    result = look(PositionCheck(board, [transfer]), measured(nominal_heights(board), offsets))
    assert isinstance(result, Disagrees)
    assert result.sentence == (
        "The white knight on f3 stands 15 mm off the middle of its square, more than the 8 mm allowed: "
        "put it in the middle."
    )


def test_a_piece_that_no_transfer_touched_may_stand_as_it_likes() -> None:
    board, transfer = knight_to_f3()
    offsets = np.full((64, 2), np.nan)
    offsets[chess.E2] = 20.0, 0.0
    observations = measured(nominal_heights(board), offsets)
    assert isinstance(look(PositionCheck(board, [transfer]), observations), Agrees)


def test_trays_are_not_looked_at() -> None:
    board = board_of("e4 d5")
    board.remove_piece_at(chess.D5)
    taken = Transfer(chess.Piece.from_symbol("p"), Place("d5"), Place("left1"))
    assert isinstance(look(PositionCheck(board, [taken]), list(Sensor().watch(board, 0.3))), Agrees)


def test_good_sensors_agree_and_never_overlook() -> None:
    """Over seeds: a right table is agreed to, a dropped piece never."""
    for seed in range(30):
        assert isinstance(checked(sensor=Sensor(seed=seed, separation=6)), Agrees)
        assert not isinstance(checked({"f3": "empty"}, Sensor(seed=seed, separation=4)), Agrees)


def test_parameters_are_bounded() -> None:
    with pytest.raises(ValueError, match="failed"):
        CheckParameters(failed=2.0)
