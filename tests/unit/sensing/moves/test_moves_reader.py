"""What happens at the table, told as scenes."""

import chess
import numpy as np
import pytest

from kempelen.core.senses import Sight
from kempelen.sensing.moves.parameters import MoveParameters
from kempelen.sensing.moves.reader import MoveReader
from kempelen.sensing.moves.verdicts import (
    Hidden,
    Moved,
    Settling,
    TakenBack,
    Unchanged,
    Unsure,
    Verdict,
    Wrong,
)
from kempelen.testing.move_scenes import Scene
from kempelen.testing.observations import Sensor, kinds_of, with_changes, with_kinds

LONG = 2.5  # s, beyond the patience


def moves(verdict: Verdict) -> list[str]:
    assert isinstance(verdict, Moved | TakenBack), verdict
    return [m.uci() for m in verdict.moves]


def question(verdict: Verdict) -> str:
    assert isinstance(verdict, Unsure), verdict
    return verdict.question


def advice(verdict: Verdict) -> str:
    assert isinstance(verdict, Wrong), verdict
    return verdict.advice


def test_a_standing_position_is_unchanged() -> None:
    scene = Scene("e4 e5", seconds=2)
    assert all(isinstance(v, Unchanged) for v in scene.verdicts[4:])
    assert not scene.accepted


def test_a_quiet_move_is_named_once_it_is_steady() -> None:
    scene = Scene().hand()
    assert isinstance(scene.after("e4", seconds=0.2), Settling)
    assert moves(scene.after("e4")) == ["e2e4"]


def test_a_person_who_moves_as_soon_as_the_board_was_seen_is_not_asked() -> None:
    """The looks that fill the first window are learned from, too; with fewer, a move is not yet told."""
    scene = Scene("rnbqk1nr/pppp1ppp/8/2b1p3/2B1P3/5N2/PPPP1PPP/RNBQK2R w KQkq - 0 1", seconds=0)
    scene.feed(scene.sensor.see(scene.board) for _ in range(MoveParameters().frames))
    scene.hand()
    assert moves(scene.after("Bxf7+")) == ["c4f7"]


def test_no_frame_is_learned_from_twice() -> None:
    scene = Scene("e4 e5", seconds=1)
    known = scene.reader.expected_look
    scene.reader.confirm(scene.board)
    assert np.array_equal(scene.reader.expected_look, known)


def test_how_a_moved_piece_looks_is_learned_when_its_move_is_confirmed() -> None:
    scene = Scene().hand()
    scene.after("e4")
    scene.confirm("e4")
    known = scene.reader.expected_look[[chess.E2, chess.E4]]
    assert known.max(axis=1) == pytest.approx(1, abs=MoveParameters().misread / 4)


def test_a_move_is_reported_until_it_is_confirmed() -> None:
    scene = Scene().hand()
    assert moves(scene.after("e4")) == moves(scene.after("e4"))
    scene.confirm("e4")
    assert isinstance(scene.stands(), Unchanged)


@pytest.mark.parametrize(
    ("position", "san", "uci"),
    [
        ("e4 d5", "exd5", "e4d5"),
        ("e4 e5 Nf3 Nc6 Bc4 Bc5", "O-O", "e1g1"),
        ("r3k2r/8/8/8/8/8/8/R3K2R b KQkq - 0 1", "O-O-O", "e8c8"),
        ("e4 a6 e5 d5", "exd6", "e5d6"),
        ("4k3/8/8/8/8/8/1r6/R3K3 w Q - 0 1", "O-O-O", "e1c1"),
        ("4k3/8/8/8/8/8/8/4K2R w K - 0 1", "Kf1", "e1f1"),
    ],
)
def test_kinds_of_move(position: str, san: str, uci: str) -> None:
    scene = Scene(position).hand()
    assert moves(scene.after(san)) == [uci]


def test_a_piece_in_the_hand_is_asked_for_without_a_guess() -> None:
    scene = Scene(seconds=1).hand()
    assert isinstance(scene.stands({"g1": "empty"}, seconds=0.6), Settling)
    assert question(scene.stands({"g1": "empty"}, LONG)) == "Where does the white knight from g1 go?"
    assert not scene.accepted


def test_a_capture_in_progress_waits() -> None:
    """Attacker lifted, victim still there; then both in the hand; then done."""
    scene = Scene("e4 d5").hand()
    assert isinstance(scene.stands({"e4": "empty"}), Settling)
    scene.hand()
    assert isinstance(scene.stands({"e4": "empty", "d5": "empty"}), Settling)
    scene.hand()
    assert moves(scene.after("exd5")) == ["e4d5"]


def test_victim_first() -> None:
    scene = Scene("e4 d5").hand()
    assert question(scene.stands({"d5": "empty"}, LONG)) == "What takes the black pawn on d5?"


def test_castling_king_first() -> None:
    scene = Scene("e4 e5 Nf3 Nc6 Bc4 Bc5").hand()
    text = question(scene.stands({"e1": "empty", "g1": "white"}, LONG))
    assert text == "Castling: now move the rook from h1 to f1."
    scene.hand()
    assert moves(scene.after("O-O")) == ["e1g1"]


def test_castling_rook_first_waits_for_the_king() -> None:
    scene = Scene("e4 e5 Nf3 Nc6 Bc4 Bc5").hand()
    assert isinstance(scene.after("Rf1", seconds=1.5), Settling)
    scene.hand()
    assert moves(scene.after("O-O")) == ["e1g1"]
    assert {v.moves for v in scene.accepted} == {(chess.Move.from_uci("e1g1"),)}


def test_a_rook_that_stays_has_moved() -> None:
    scene = Scene("e4 e5 Nf3 Nc6 Bc4 Bc5").hand()
    assert moves(scene.after("Rf1", seconds=3)) == ["h1f1"]


def test_castling_after_the_rook_was_taken_for_a_move() -> None:
    scene = Scene("e4 e5 Nf3 Nc6 Bc4 Bc5").hand()
    scene.after("Rf1", seconds=3)
    before = scene.board.copy()
    scene.confirm("Rf1").hand()
    before.push_san("O-O")
    verdict = scene.shows(before)
    assert isinstance(verdict, TakenBack)
    assert moves(verdict) == ["e1g1"]


def test_en_passant_with_the_pawn_still_there() -> None:
    scene = Scene("e4 a6 e5 d5").hand()
    text = question(scene.stands({"e5": "empty", "d6": "white"}, LONG))
    assert text == "En passant: now take the black pawn off d5."
    scene.hand()
    assert moves(scene.after("exd6")) == ["e5d6"]


def test_a_promotion_is_asked_for() -> None:
    scene = Scene("8/P6k/8/8/8/8/7K/8 w - - 0 1").hand()
    verdict = scene.after("a8=Q", seconds=LONG)
    assert "What does the white pawn become on a8" in question(verdict)
    assert isinstance(verdict, Unsure)
    assert {line[0].promotion for line in verdict.candidates} == {2, 3, 4, 5}


def test_a_promotion_is_read_when_kinds_are() -> None:
    scene = Scene("8/P6k/8/8/8/8/7K/8 w - - 0 1").hand()
    board = scene.board.copy()
    board.push_san("a8=N")
    verdict = scene.feed(with_kinds(scene.sensor.watch(board, 0.8), kinds_of(board)))
    assert moves(verdict) == ["a7a8n"]


def test_vague_kinds_do_not_decide_a_promotion() -> None:
    scene = Scene("8/P6k/8/8/8/8/7K/8 w - - 0 1").hand()
    board = scene.board.copy()
    board.push_san("a8=N")
    scene.feed(with_kinds(scene.sensor.watch(board, LONG), kinds_of(board, sure=1.0)))
    assert not scene.accepted
    assert isinstance(scene.verdicts[-1], Unsure)


def test_hesitation_changes_nothing() -> None:
    scene = Scene("e4 e5").hand()
    scene.stands({"g1": "empty"}, 0.3)
    scene.hand()
    assert isinstance(scene.stands(), Unchanged)
    assert not scene.accepted


def test_sliding_through_squares_names_the_last() -> None:
    scene = Scene("d4 d5")
    for square in ("d2", "e3", "f4"):
        scene.hand(0.1)
        scene.stands({"c1": "empty", square: "white"} if square != "d2" else {"c1": "empty"}, 0.2)
    scene.hand(0.1)
    assert moves(scene.after("Bg5")) == ["c1g5"]
    assert {v.moves for v in scene.accepted} == {(chess.Move.from_uci("c1g5"),)}


def test_between_two_squares_is_asked() -> None:
    sensor = Sensor(vague=frozenset({"e3", "e4"}))
    scene = Scene(sensor=sensor).hand()
    assert question(scene.after("e4", seconds=LONG)) == "Is the white pawn on e3 or e4?"


def test_one_of_two_knights() -> None:
    scene = Scene("4k3/8/8/8/8/5N2/8/1N2K3 w - - 0 1").hand()
    assert moves(scene.after("Nbd2")) == ["b1d2"]


def test_which_knight_is_asked_when_both_sources_are_vague() -> None:
    sensor = Sensor(vague=frozenset({"f3", "b1"}))
    scene = Scene("4k3/8/8/8/8/5N2/8/1N2K3 w - - 0 1", sensor).hand()
    verdict = scene.after("Nbd2", seconds=LONG)
    assert "d2" in question(verdict)
    assert isinstance(verdict, Unsure)
    assert {line[0].uci() for line in verdict.candidates if line} == {"b1d2", "f3d2"}


def test_taken_back_one_ply_and_two() -> None:
    scene = Scene("e4 e5 Nf3").hand()
    back = scene.board.copy()
    back.pop()
    verdict = scene.shows(back)
    assert isinstance(verdict, TakenBack)
    assert (verdict.plies, verdict.moves) == (1, ())
    back.pop()
    scene.hand()
    verdict = scene.shows(back)
    assert isinstance(verdict, TakenBack)
    assert (verdict.plies, verdict.moves) == (2, ())


def test_another_move_instead() -> None:
    scene = Scene("e4 e5 Nf3").hand()
    other = scene.board.copy()
    other.pop()
    other.push_san("Nc3")
    verdict = scene.shows(other)
    assert isinstance(verdict, TakenBack)
    assert (verdict.plies, moves(verdict)) == (1, ["b1c3"])


def test_back_and_forth_is_not_mistaken_for_a_take_back() -> None:
    """Ng1 Ng8 leaves what taking back Nf3 Nf6 leaves."""
    scene = Scene("Nf3 Nf6").hand()
    assert "taken back" in question(scene.after("Ng1", "Ng8", seconds=LONG))
    assert not scene.accepted


def test_two_plies_played_quickly() -> None:
    scene = Scene("e4").hand()
    assert moves(scene.after("e5", "Nf3")) == ["e7e5", "g1f3"]


def test_two_plies_where_only_one_is_the_persons() -> None:
    scene = Scene("e4", parameters=MoveParameters(plies=1)).hand()
    text = advice(scene.after("e5", "Nf3", seconds=LONG))
    assert text.startswith("Two moves have been made, to e5 and to f3, but only one was due.")


def test_one_side_twice() -> None:
    scene = Scene("e4").hand()
    changes = {"e7": "empty", "e5": "black", "d7": "empty", "d5": "black"}
    text = advice(scene.stands(changes, LONG + 2))
    assert text.startswith("Black has moved twice, to ")
    assert "put the black pawn from e5 back on e7" in text.lower()


def test_an_illegal_move_is_explained() -> None:
    scene = Scene().hand()
    verdict = scene.stands({"c1": "empty", "h6": "white"}, LONG)
    assert advice(verdict) == (
        "That is no legal move: the bishop cannot go from c1 to h6: the white pawn on d2 stands in the way. "
        "Put the white bishop from h6 back on c1."
    )
    assert isinstance(verdict, Wrong)
    assert {str(d) for d in verdict.differences} == {
        "c1: empty instead of B",
        "h6: a white piece instead of nothing",
    }


def test_a_move_and_something_else() -> None:
    scene = Scene().hand()
    board = scene.board.copy()
    board.push_san("e4")
    verdict = scene.feed(scene.sensor.watch(with_changes(board, {"a7": "empty"}), LONG))
    assert advice(verdict) == "After e4: Put the black pawn back on a7."
    assert not scene.accepted


def test_wrong_is_put_right() -> None:
    scene = Scene().hand()
    scene.stands({"a7": "empty", "b8": "empty"}, LONG)
    scene.hand()
    assert isinstance(scene.stands(), Unchanged)


def test_a_hand_hides_the_board_and_starts_the_wait_again() -> None:
    scene = Scene().hand()
    scene.after("e4", seconds=0.35)
    verdict = scene.blind(Sight.HAND, 0.1)
    assert isinstance(verdict, Hidden)
    assert verdict.sight is Sight.HAND
    assert isinstance(scene.after("e4", seconds=0.15), Settling)
    assert not scene.accepted


@pytest.mark.parametrize("sight", [s for s in Sight if s is not Sight.CLEAR])
def test_blind_says_why(sight: Sight) -> None:
    scene = Scene()
    verdict = scene.blind(sight)
    assert isinstance(verdict, Hidden)
    assert (verdict.sight, bool(verdict.message)) == (sight, True)


@pytest.mark.parametrize("square", ["e4", "e5", "h3"])
def test_an_empty_square_that_always_looks_taken_hinders_no_other_move(square: str) -> None:
    scene = Scene(sensor=Sensor(stuck={square: "white"}), seconds=1).hand()
    assert moves(scene.after("d4")) == ["d2d4"]


@pytest.mark.parametrize("seed", range(4))
def test_a_move_to_a_misread_square_is_asked_for(seed: int) -> None:
    scene = Scene(sensor=Sensor(seed=seed, stuck={"e4": "white"}), seconds=1).hand()
    assert "e4" in question(scene.after("e4", seconds=LONG))
    assert not scene.accepted


@pytest.mark.parametrize("look", ["empty", "white"])
def test_a_square_that_turns_bad_is_no_move(look: str) -> None:
    """From one frame to the next, with nobody at the board."""
    scene = Scene("e4 e5", seconds=1)
    scene.sensor.stuck = {"d4": look, "g8": "empty"}
    scene.stands(seconds=4)
    assert not scene.accepted


def test_a_person_says_that_it_stands() -> None:
    scene = Scene("e4 e5", seconds=1).hand()
    scene.sensor.stuck = {"a5": "black", "h4": "white"}
    assert isinstance(scene.stands(seconds=LONG), Wrong)
    scene.reader.confirm(scene.board, as_seen=True)
    assert isinstance(scene.stands(), Unchanged)
    scene.hand()
    assert moves(scene.after("Nf3")) == ["g1f3"]


def test_colour_blind_sensors_read_quiet_moves_and_ask_for_captures() -> None:
    scene = Scene("e4 d5", Sensor(colour_blind=True)).hand()
    assert moves(scene.after("Nf3")) == ["g1f3"]
    scene = Scene("e4 d5", Sensor(colour_blind=True)).hand()
    scene.after("exd5", seconds=LONG)
    assert not scene.accepted


def test_a_long_gap_may_hide_a_hand() -> None:
    scene = Scene("e4")
    scene.sensor.time += 30
    assert moves(scene.after("e5")) == ["e7e5"]


def test_a_sensor_that_is_always_slow_is_still_believed() -> None:
    scene = Scene("e4", Sensor(rate=0.6), seconds=20.0)
    assert moves(scene.after("e5", seconds=30.0)) == ["e7e5"]


def test_a_clock_that_restarts_is_survived() -> None:
    scene = Scene("e4")
    scene.sensor.time = 0.0
    assert moves(scene.after("e5")) == ["e7e5"]


def test_two_pictures_are_enough_where_they_are_clear() -> None:
    sensor, board = Sensor(rate=0.1), chess.Board()
    reader = MoveReader(board, MoveParameters.of_pictures())
    reader.update(sensor.see(board))
    board.push_san("e4")
    assert moves(reader.update(sensor.see(board))) == ["e2e4"]


def after_castling(fen: str) -> Verdict:
    board = chess.Board(fen, chess960=True)
    sensor, reader = Sensor(), MoveReader(board)
    for observation in sensor.watch(board, 1):
        reader.update(observation)
    board.push_san("O-O")
    return [reader.update(o) for o in [*sensor.hand(), *sensor.watch(board, 4)]][-1]


def test_chess960_castling() -> None:
    assert moves(after_castling("4k3/8/8/8/8/8/8/RK5R w KQ - 0 1")) == ["b1h1"]


def test_chess960_castling_that_looks_like_a_rooks_move() -> None:
    verdict = after_castling("4k3/8/8/8/8/8/8/R4K1R w KQ - 0 1")
    assert isinstance(verdict, Unsure)
    assert {line[0].uci() for line in verdict.candidates} == {"f1h1", "h1g1"}
