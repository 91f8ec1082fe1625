"""Moves as transfers, and back."""

import itertools
import random

import chess
import pytest

from kempelen.core.errors import OperatorNeededError
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.table import Table, Tray, start_layout
from kempelen.game.transfers import Crowded, Missing, move_transfers, takeback_transfers

TABLE = Table()


def planned(fen: str, move: str, table: Table = TABLE) -> list[str]:
    """The transfers of a move from the layout in which the game would begin there."""
    board = chess.Board(fen)
    transfers = move_transfers(board, board.parse_san(move), start_layout(table, board), table)
    assert isinstance(transfers, tuple)
    return [str(transfer) for transfer in transfers]


def carried(layout: Layout, transfers: tuple[Transfer, ...]) -> Layout:
    for transfer in transfers:
        layout = layout.after(transfer)
    return layout


def test_quiet_move_is_one_transfer() -> None:
    assert planned(chess.STARTING_FEN, "Nf3") == ["N g1-f3"]


def test_the_victim_leaves_first() -> None:
    transfers = planned("4k3/8/8/3p4/4P3/8/8/4K3 w - - 0 1", "exd5")
    assert len(transfers) == 2
    assert transfers[0].startswith("p d5-right")
    assert transfers[1] == "P e4-d5"


def test_regression_en_passant_takes_the_right_victim() -> None:
    """The original took whatever stood on the target square: nothing."""
    white = planned("4k3/8/8/3pP3/8/8/8/4K3 w - d6 0 1", "exd6")
    assert white[0].startswith("p d5-")
    assert white[1] == "P e5-d6"
    black = planned("4k3/8/8/8/3pP3/8/8/4K3 b - e3 0 1", "dxe3")
    assert black[0].startswith("P e4-")
    assert black[1] == "p d4-e3"


@pytest.mark.parametrize(
    ("fen", "move", "expected"),
    [
        ("4k3/8/8/8/8/8/8/R3K2R w KQ - 0 1", "O-O", ["K e1-g1", "R h1-f1"]),
        ("4k3/8/8/8/8/8/8/R3K2R w KQ - 0 1", "O-O-O", ["K e1-c1", "R a1-d1"]),
        ("r3k2r/8/8/8/8/8/8/4K3 b kq - 0 1", "O-O", ["k e8-g8", "r h8-f8"]),
        ("r3k2r/8/8/8/8/8/8/4K3 b kq - 0 1", "O-O-O", ["k e8-c8", "r a8-d8"]),
    ],
)
def test_castling_carries_king_and_rook(fen: str, move: str, expected: list[str]) -> None:
    assert planned(fen, move) == expected


@pytest.mark.parametrize(
    ("rank", "side", "expected"),
    [
        ("6KR", "O-O", ["R h1-f1"]),  # the king stands already where it goes
        ("4KR2", "O-O", ["K e1-g1"]),  # the rook stands already where it goes
        ("5KR1", "O-O", "swap"),  # king and rook change places
        ("4K1R1", "O-O", ["R g1-f1", "K e1-g1"]),  # the rook stands where the king goes
        ("5K1R", "O-O", ["K f1-g1", "R h1-f1"]),  # the king stands where the rook goes
        ("RK6", "O-O-O", ["K b1-c1", "R a1-d1"]),
        ("2RK4", "O-O-O", "swap"),
        ("R2K4", "O-O-O", ["K d1-c1", "R a1-d1"]),
    ],
)
def test_chess960_castling(rank: str, side: str, expected: list[str] | str) -> None:
    right = chess.FILE_NAMES[expand(rank).index("R")].upper()
    board = chess.Board(f"4k3/8/8/8/8/8/8/{rank} w {right} - 0 1", chess960=True)
    layout = start_layout(TABLE, board)
    move = board.parse_san(side)
    transfers = move_transfers(board, move, layout, TABLE)
    assert isinstance(transfers, tuple)
    if expected == "swap":
        assert len(transfers) == 3
        assert transfers[0].target == transfers[-1].source
    else:
        assert [str(transfer) for transfer in transfers] == expected
    after = carried(layout, transfers)
    board.push(move)
    assert after.board_part() == board.piece_map()
    back = takeback_transfers(board, after, TABLE)
    assert isinstance(back, tuple)
    assert carried(after, back).board_part() == board.root().piece_map()


def expand(rank: str) -> str:
    return "".join("." * int(letter) if letter.isdigit() else letter for letter in rank)


@pytest.mark.parametrize("kind", "QRBN")
def test_promotion_brings_the_piece_from_the_tray(kind: str) -> None:
    transfers = planned("4k3/P7/8/8/8/8/8/4K3 w - - 0 1", f"a8={kind}")
    assert transfers[0].startswith("P a7-left")
    assert transfers[1].startswith(f"{kind} left")
    assert transfers[1].endswith("-a8")
    assert len(transfers) == 2


@pytest.mark.parametrize("kind", "QRBN")
def test_capturing_promotion_is_three_transfers(kind: str) -> None:
    transfers = planned("1n2k3/P7/8/8/8/8/8/4K3 w - - 0 1", f"axb8={kind}")
    assert len(transfers) == 3
    assert transfers[0].startswith("n b8-")
    assert transfers[1].startswith("P a7-")
    assert transfers[2].startswith(f"{kind} ")
    assert transfers[2].endswith("-b8")


def test_black_promotes_from_its_own_pieces() -> None:
    transfers = planned("4k3/8/8/8/8/8/p7/4K3 b - - 0 1", "a1=N")
    assert transfers[1].startswith("n ")


def test_regression_a_promotion_that_lacks_its_piece_reports_back() -> None:
    """The original asked nobody and hung; here the request names piece and slot, and the move follows it."""
    fen = "4k3/P7/8/8/8/8/8/QQ2K3 w - - 0 1"
    board = chess.Board(fen)
    layout = start_layout(TABLE, board)
    move = board.parse_san("a8=Q")
    request = move_transfers(board, move, layout, TABLE)
    assert isinstance(request, Missing)
    assert request.piece == chess.Piece(chess.QUEEN, chess.WHITE)
    assert request.place not in layout
    assert request.place.tray == "left"
    assert "white queen" in str(request)
    layout = layout.having(request.place, request.piece)
    transfers = move_transfers(board, move, layout, TABLE)
    assert isinstance(transfers, tuple)
    assert str(transfers[-1]) == f"Q {request.place}-a8"


def test_a_captured_piece_is_promoted_to_before_a_spare_that_stands_farther_away() -> None:
    board = chess.Board("4k3/7P/8/8/8/8/8/4K3 w - - 0 1")
    layout = start_layout(TABLE, board).without(Place("right8"))
    queen = chess.Piece(chess.QUEEN, chess.WHITE)
    assert Place("right8") not in layout
    layout = layout.having(Place("right8"), queen)
    transfers = move_transfers(board, board.parse_san("h8=Q"), layout, TABLE)
    assert isinstance(transfers, tuple)
    assert transfers[-1].source == Place("right8")


def test_the_nearest_slot_on_the_own_side_is_taken() -> None:
    opened = "rnbqkbnr/p1pppppp/8/1p6/P7/8/1PPPPPPP/RNBQKBNR b KQkq - 0 1"
    assert planned(opened, "bxa4")[0] == "P a4-left12"  # level with rank 4, in the column beside the board
    opened = "rnbqkbnr/ppppppp1/8/7p/6P1/8/PPPPPP1P/RNBQKBNR w KQkq - 0 1"
    assert planned(opened, "gxh5")[0] == "p h5-right5"
    # The opponent's side counts as four squares farther away: from the h-file that is still nearer.
    opened = "rnbqkbnr/pppppp1p/8/6p1/7P/8/PPPPPPP1/RNBQKBNR b KQkq - 0 1"
    assert planned(opened, "gxh4")[0] == "P h4-right4"
    opened = "rnbqkbnr/ppppp1pp/8/5p2/4P3/8/PPPP1PPP/RNBQKBNR b KQkq - 0 1"
    assert planned(opened, "fxe4")[0] == "P e4-left12"


def test_slots_are_chosen_alike_every_time() -> None:
    fen = "r3k2r/p1ppqpb1/bn2pnp1/3PN3/1p2P3/2N2Q1p/PPPBBPPP/R3K2R w KQkq - 0 1"
    board = chess.Board(fen)
    layout = start_layout(TABLE, board)
    captures = [move for move in board.legal_moves if board.is_capture(move)]
    assert len(captures) > 5
    shuffled = Layout(dict(random.Random(3).sample(sorted(layout.items()), len(layout))))
    for move in captures:
        assert move_transfers(board, move, layout, TABLE) == move_transfers(board, move, shuffled, TABLE)


def test_regression_the_27th_capture_has_a_slot_of_its_own() -> None:
    """The original ran out of tray after 26 captures and put the next piece on a1."""
    board, layout = chess.Board(), start_layout(TABLE, chess.Board())
    captures = 0
    for move in all_captured():
        captures += board.is_capture(move)
        transfers = move_transfers(board, move, layout, TABLE)
        assert isinstance(transfers, tuple)
        if board.is_capture(move):
            assert not transfers[0].target.is_square
        layout = carried(layout, transfers)
        board.push(move)
        assert layout.board_part() == board.piece_map()
    assert captures == 30
    assert len(board.piece_map()) == 2
    assert len([place for place in layout if not place.is_square]) == 32


def all_captured() -> list[chess.Move]:
    """A legal game in which everything but the kings is taken: always take, else wander, until it happens."""
    for seed in itertools.count():
        choose = random.Random(seed)
        board = chess.Board()
        while len(board.move_stack) < 2000 and any(board.legal_moves):
            moves = sorted(board.legal_moves, key=chess.Move.uci)
            takes = [move for move in moves if board.is_capture(move) and not move.promotion]
            plain = [move for move in moves if not move.promotion] or moves
            board.push(choose.choice(takes or plain))
            if len(board.piece_map()) == 2:
                if not any(move.promotion for move in board.move_stack):
                    return list(board.move_stack)
                break
    raise AssertionError


def test_full_trays_ask_for_room() -> None:
    small = Table(trays=(Tray(name="left", origin=(-90.0, 25.0), rows=2, columns=1),))
    board = chess.Board("4k3/8/8/3p4/4P3/8/8/4K3 w - - 0 1")
    layout = Layout(
        {Place.at(square): piece for square, piece in board.piece_map().items()}
        | {Place("left1"): chess.Piece.from_symbol("Q"), Place("left2"): chess.Piece.from_symbol("p")}
    )
    request = move_transfers(board, board.parse_san("exd5"), layout, small)
    assert request == Crowded(chess.Piece.from_symbol("p"), Place("left2"))
    assert "black pawn" in str(request)
    transfers = move_transfers(board, board.parse_san("exd5"), layout.without(Place("left2")), small)
    assert isinstance(transfers, tuple)
    assert transfers[0].target == Place("left2")


def test_a_table_without_trays_says_so() -> None:
    bare = Table(trays=())
    board = chess.Board("4k3/8/8/3p4/4P3/8/8/4K3 w - - 0 1")
    layout = Layout({Place.at(square): piece for square, piece in board.piece_map().items()})
    with pytest.raises(OperatorNeededError, match="no tray"):
        move_transfers(board, board.parse_san("exd5"), layout, bare)


def test_a_layout_that_differs_from_the_position_is_refused() -> None:
    board = chess.Board()
    layout = start_layout(TABLE, board).without(Place("g1"))
    with pytest.raises(OperatorNeededError, match="g1"):
        move_transfers(board, board.parse_san("e4"), layout, TABLE)


@pytest.mark.parametrize("seed", range(6))
def test_random_games_on_the_table_and_back(seed: int) -> None:
    """Position and layout agree after every move, and taking everything back gives the start again."""
    choose = random.Random(seed)
    board, layout = chess.Board(), start_layout(TABLE, chess.Board())
    for _ in range(160):
        moves = sorted(board.legal_moves, key=chess.Move.uci)
        if not moves:
            break
        weights = [
            8 if move.promotion or board.is_castling(move) else 2 + board.is_capture(move) for move in moves
        ]
        move = choose.choices(moves, weights)[0]
        layout = settled(layout, lambda now, move=move: move_transfers(board, move, now, TABLE))
        board.push(move)
        assert layout.board_part() == board.piece_map()
    while board.move_stack:
        layout = settled(layout, lambda now: takeback_transfers(board, now, TABLE))
        board.pop()
        assert layout.board_part() == board.piece_map()


def settled(layout: Layout, plan) -> Layout:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """The layout after the transfers, the operator having done what was asked."""
    while not isinstance(planned := plan(layout), tuple):
        layout = (
            layout.having(planned.place, planned.piece)
            if isinstance(planned, Missing)
            else layout.without(planned.place)
        )
    assert 1 <= len(planned) <= 4
    return carried(layout, planned)
