import chess
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.errors import NotationError
from kempelen.game.notation import (
    iccf,
    illegal,
    numbered,
    parse_move,
    quoted,
    readable,
    san_log,
    why_illegal,
)

PROMOTING = "1n2k3/P7/8/8/8/8/8/4K3 w - - 0 1"
CASTLING = "r3k2r/8/8/8/8/8/8/R3K2R w KQkq - 0 1"
EN_PASSANT = "4k3/8/8/3pP3/8/8/8/4K3 w - d6 0 2"
THREE_QUEENS = "4k3/8/8/8/Q6Q/8/8/Q3K3 w - - 0 1"
PINNED = "4k3/8/8/8/1b6/8/3N4/4K3 w - - 0 1"
IN_CHECK = "4k3/8/8/8/8/8/4q3/N3K3 w - - 0 1"


@pytest.mark.parametrize(
    ("fen", "texts", "uci"),
    [
        (
            chess.STARTING_FEN,
            "e4|e4!|e4!?|e4+|1.e4|1. e4|e2e4|E2E4|e2-e4|Pe4|♙e4|5254|52-54|1... e4| e 4 ",
            "e2e4",
        ),
        (chess.STARTING_FEN, "Nf3|nf3|♘f3|Ngf3|N1f3|Ng1f3|Ng1-f3|g1f3|7163|Nf3??|Nf3‼", "g1f3"),
        (PROMOTING, "a8=Q|a8Q|a8(Q)|a8/Q|a8q|a8=Q+|a8=Q#|a7a8q|a7a8=Q|a7a8Q|17181|a8=♕", "a7a8q"),
        (PROMOTING, "a8=N|a8N|a8(N)|a7a8n|17184", "a7a8n"),
        (PROMOTING, "axb8=R|axb8R|ab8=R|a7xb8=R|a7b8r|17282", "a7b8r"),
        (PROMOTING, "axb8=B|17283|axb8=b", "a7b8b"),
        (CASTLING, "O-O|0-0|o-o|OO|O-O+|e1g1|e1h1|Kg1|5171", "e1g1"),
        (CASTLING, "O-O-O|0-0-0|o-o-o|0-0-0!|e1c1|5131", "e1c1"),
        (EN_PASSANT, "exd6|exd6e.p.|ed6|e5d6|5546|exd6ep|exd6+e.p.", "e5d6"),
        (THREE_QUEENS, "Qa4d4|Qa4-d4|a4d4", "a4d4"),
    ],
)
def test_every_way_of_writing_a_move(fen: str, texts: str, uci: str) -> None:
    board = chess.Board(fen)
    for text in texts.split("|"):
        assert parse_move(text, board).uci() == uci, text
    assert board.fen() == fen


def test_marks_behind_a_move_with_blanks() -> None:
    board = chess.Board(EN_PASSANT)
    assert parse_move("3. exd6 e.p.!?", board).uci() == "e5d6"
    assert parse_move("12... e x d6 ", board).uci() == "e5d6"


def test_a_lower_case_b_is_the_file_first_and_a_bishop_only_for_people() -> None:
    both = chess.Board("4k3/8/8/8/8/2p5/1P2B3/4K3 w - - 0 1")
    assert parse_move("bxc3", both).uci() == "b2c3"
    assert parse_move("bc4", both).uci() == "e2c4"
    with pytest.raises(NotationError, match="illegal"):
        parse_move("bc4", both, any_case=False)
    with pytest.raises(NotationError, match="cannot be read"):
        parse_move("nf3", chess.Board(), any_case=False)


def test_capital_squares_are_coordinates_only_when_all_are_capital() -> None:
    board = chess.Board("4k3/8/8/8/8/8/8/1B2K3 w - - 0 1")
    assert parse_move("B1D3", board).uci() == "b1d3"
    assert parse_move("B1d3", board).uci() == "b1d3"  # a bishop from rank 1


@pytest.mark.parametrize(
    "text",
    ["", " ", "hello", "e9", "i4", "N", "Nf", "e4e5e6", "e4 and e5", "5", "52", "5259", "x" * 5000, "\x00e4"],
)
def test_what_cannot_be_read_is_refused_with_examples(text: str) -> None:
    with pytest.raises(NotationError, match="cannot be read as a move") as caught:
        parse_move(text, chess.Board())
    assert "e8=Q" in caught.value.hint
    assert len(caught.value.message) < 100
    assert not readable(text)


@pytest.mark.parametrize("text", ["--", "Z0", "0000", "pass"])
def test_null_moves_are_refused(text: str) -> None:
    with pytest.raises(NotationError, match="nobody can pass"):
        parse_move(text, chess.Board())


@pytest.mark.parametrize("text", ["a8", "axb8", "a7a8", "1718", "a7xb8"])
def test_a_promotion_without_its_piece_asks_for_it(text: str) -> None:
    with pytest.raises(NotationError, match="does not say to which piece") as caught:
        parse_move(text, chess.Board(PROMOTING))
    assert f"{text}=N" in caught.value.hint


@pytest.mark.parametrize("text", ["a8=K", "a8=P", "a8Z"])
def test_a_promotion_to_no_such_piece_is_refused(text: str) -> None:
    with pytest.raises(NotationError, match="no piece to promote to"):
        parse_move(text, chess.Board(PROMOTING))


@pytest.mark.parametrize(
    ("fen", "text", "candidates"),
    [
        ("4k3/8/8/8/8/8/8/1N2KN2 w - - 0 1", "Nd2", "Nbd2 or Nfd2"),
        ("4k3/8/8/2p5/1P1P4/8/8/4K3 w - - 0 1", "xc5", "bxc5 or dxc5"),
        (THREE_QUEENS, "Qd4", " or "),
    ],
)
def test_an_ambiguous_move_names_the_candidates(fen: str, text: str, candidates: str) -> None:
    with pytest.raises(NotationError, match="is ambiguous") as caught:
        parse_move(text, chess.Board(fen))
    assert candidates in caught.value.message
    for name in caught.value.message.partition("it can be ")[2].rstrip(".").replace(" or ", ", ").split(", "):
        assert parse_move(name, chess.Board(fen))


@pytest.mark.parametrize(
    ("fen", "text", "reason"),
    [
        (chess.STARTING_FEN, "e3e4", "no piece stands on e3"),
        (chess.STARTING_FEN, "e7e5", "the pawn on e7 is Black's, and White is to move"),
        (chess.STARTING_FEN, "d1d2", "White's own pawn on d2 is in the way"),
        (chess.STARTING_FEN, "e2e2", "another square than it starts"),
        (chess.STARTING_FEN, "e2e4q", "only a pawn that reaches the last rank is promoted"),
        (chess.STARTING_FEN, "Nf3=Q", "only a pawn that reaches the last rank is promoted"),
        (chess.STARTING_FEN, "Bc4", "the pawn on e2 is in the way"),
        (chess.STARTING_FEN, "b1b3", "a knight does not go from b1 to b3"),
        (chess.STARTING_FEN, "Nd5", "no knight of White's can go to d5 (there is one on b1, g1)"),
        (chess.STARTING_FEN, "e5", "a pawn does not go from e2 to e5"),
        (
            chess.STARTING_FEN,
            "e2d3",
            "a pawn goes diagonally only to take, and there is nothing to take on d3",
        ),
        (chess.STARTING_FEN, "exd5", "there is nothing to take on d5"),
        (chess.STARTING_FEN, "Nxf3", "there is nothing to take on f3"),
        (chess.STARTING_FEN, "O-O", "the bishop on f1 stands between king and rook"),
        (PROMOTING, "Rd1", "White has no rook"),
        (PINNED, "Nf3", "it puts White's king in check from the bishop on b4"),
        (PINNED, "d2f3", "it puts White's king in check from the bishop on b4"),
        (IN_CHECK, "Nb3", "it leaves White's king in check from the queen on e2"),
        (IN_CHECK, "O-O", "has no right to castle kingside"),
        ("4k3/8/8/4p3/4P3/8/8/4K3 w - - 0 1", "e4e5", "a pawn does not take straight ahead"),
        ("4k3/8/8/8/4P3/4p3/4P3/K7 w - - 0 1", "e2e4", "in the way"),
        ("4k3/8/8/8/8/4p3/4P3/K7 w - - 0 1", "e4", "the pawn on e3 is in the way"),
        ("4k3/8/8/8/8/8/8/R3K2R b KQ - 0 1", "e8g8", "Black has no right to castle kingside"),
        ("4k3/8/8/8/4r3/8/8/R3K2R w KQ - 0 1", "O-O-O", "the king is in check"),
        ("3rk3/8/8/8/8/8/8/R3K2R w KQ - 0 1", "O-O-O", "the king would pass over or reach a square"),
        ("4k3/8/8/8/8/8/8/4K3 w - - 0 1", "e1e3", "a king does not go from e1 to e3"),
    ],
)
def test_an_illegal_move_is_told_why(fen: str, text: str, reason: str) -> None:
    with pytest.raises(NotationError, match="is illegal for") as caught:
        parse_move(text, chess.Board(fen))
    assert reason in caught.value.message
    assert "moves are legal here" in caught.value.hint


def test_when_the_game_is_over_nothing_is_suggested() -> None:
    with pytest.raises(NotationError, match="the game is over, Black has no legal move"):
        parse_move("Kg8", chess.Board("7k/6Q1/6K1/8/8/8/8/8 b - - 0 1"))


def test_a_legal_move_has_no_fault() -> None:
    assert why_illegal(chess.Board(), chess.Move.from_uci("e2e4")) == ""


def test_an_error_lists_a_few_legal_moves() -> None:
    board = chess.Board("k7/8/1K6/8/8/8/8/1R6 b - - 0 1")
    assert illegal("Ka7", board, "so").hint == "1 moves are legal here: Kb8."


@pytest.mark.parametrize(
    ("uci", "text"),
    [
        ("e2e4", "5254"),
        ("e1g1", "5171"),
        ("a7a8q", "17181"),
        ("h2h1n", "82814"),
        ("b7a8r", "27182"),
        ("c7c8b", "37383"),
    ],
)
def test_iccf_out(uci: str, text: str) -> None:
    assert iccf(chess.Move.from_uci(uci)) == text


def test_san_log_and_numbers() -> None:
    moves = [chess.Move.from_uci(uci) for uci in ("e2e4", "e7e5", "g1f3")]
    log = san_log(chess.STARTING_FEN, moves)
    assert log == ("e4", "e5", "Nf3")
    assert list(numbered(chess.STARTING_FEN, log)) == ["1.", "e4", "e5", "2.", "Nf3"]
    after = "rnbqkbnr/pppppppp/8/8/4P3/8/PPPP1PPP/RNBQKBNR b KQkq - 0 7"
    assert list(numbered(after, ["e5", "Nf3", "Nc6"])) == ["7...", "e5", "8.", "Nf3", "Nc6"]
    with pytest.raises(NotationError, match="no piece stands on e3"):
        san_log(chess.STARTING_FEN, [chess.Move.from_uci("e3e4")])


def test_text_of_unknown_origin_is_shown_safely() -> None:
    assert quoted("a\x1b[31m", 40) == r"'a\x1b[31m'"
    assert quoted("x" * 50, 5) == "'xxxxx…'"


@given(st.randoms(use_true_random=False), st.integers(0, 80))
def test_what_is_written_is_read_back(dice: object, plies: int) -> None:
    board = chess.Board()
    for _ in range(plies):
        legal = list(board.legal_moves)
        if not legal:
            break
        move = dice.choice(legal)  # type: ignore[attr-defined]
        for text in (board.san(move), board.lan(move), move.uci(), iccf(move)):
            assert parse_move(text, board) == move
            assert parse_move(text, board, any_case=False) == move
            assert readable(text)
        board.push(move)


@given(
    st.text(max_size=30)
    | st.from_regex(r"[KQRBNPkqrbn]?[a-h]?[1-8]?x?[a-h][1-8](=?[QRBNKX])?[+#]?", fullmatch=True)
)
def test_any_text_gives_a_legal_move_or_an_explanation(text: str) -> None:
    for fen in (chess.STARTING_FEN, PROMOTING, CASTLING, PINNED, IN_CHECK):
        board = chess.Board(fen)
        try:
            move = parse_move(text, board)
        except NotationError as error:
            fault = error
        else:
            assert move in list(board.legal_moves)
            continue
        assert fault.hint
        assert ": ." not in fault.message
