"""Moves as people and files write them: SAN, coordinates, ICCF numeric.

A move is always read against a position, because only the position can tell what ``Nf3`` means and why it
cannot be played. Standards: PGN 1994 section 8.2.3 (SAN), UCI protocol 2006 (coordinates), ICCF Playing Rules
(numeric).
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import chess

from kempelen.core.errors import NotationError
from kempelen.game.fen import parse_fen

ACCEPTED = "Write a move like Nf3, exd5, O-O, e8=Q, or by its squares: g1f3, e7e8q, or numeric: 7163."
_LONGEST = 24  # characters; the longest sensible move is about "12... Qa1xb2=Q+ e.p.!?"

_PLAIN_LETTERS = str.maketrans("♔♕♖♗♘♚♛♜♝♞\u00d7\u2013\u2014\u2011", "KQRBNKQRBNx---", "♙♟")
_NUMBER = re.compile(r"\A\d+\s*(?:\.+|…)\s*")
_DECORATION = re.compile(r"(?:e\.?p\.?)?(?:[+#!?†‡‼⁇⁉⁈]|e\.p\.)*\Z")
_CASTLING = re.compile(r"\A[O0o]-?[O0o](-?[O0o])?\Z")
_COORDINATES = re.compile(r"\A([a-h][1-8])[-x]?([a-h][1-8])(?:=?\(?([qrbnQRBN])\)?)?\Z")
_NUMERIC = re.compile(r"\A([1-8][1-8])-?([1-8][1-8])([1-4]?)\Z")
_SAN = re.compile(
    r"\A(?P<piece>[KQRBNP])?(?P<file>[a-h])?(?P<rank>[1-8])?-?(?P<takes>[x:])?(?P<target>[a-h][1-8])"
    r"(?:[=/]?\(?(?P<promotion>[A-Za-z])\)?)?\Z"
)
_NULL_MOVES = frozenset({"--", "Z0", "0000", "@@@@", "null", "pass"})
_NUMERIC_PROMOTION = {"1": chess.QUEEN, "2": chess.ROOK, "3": chess.BISHOP, "4": chess.KNIGHT}
_NUMERIC_DIGIT = {piece: digit for digit, piece in _NUMERIC_PROMOTION.items()}
_PROMOTION = {"Q": chess.QUEEN, "R": chess.ROOK, "B": chess.BISHOP, "N": chess.KNIGHT}


def parse_move(text: str, board: chess.Board, *, any_case: bool = True) -> chess.Move:
    """Read one move, however it is written.

    Args:
        text: SAN (``Nf3``, ``e8Q``, ``0-0``), coordinates (``e2e4``, ``e7e8q``) or ICCF numeric (``5254``);
            a move number in front and marks behind (``+ # !?``) are ignored.
        board: The position the move is played in; it is not changed.
        any_case: Also take a lower-case piece letter (``nf3``), as a person types it. Files are read
            without it, since there ``bc4`` and ``Bc4`` differ.

    Returns:
        A move that is legal in ``board``.

    Raises:
        NotationError: The text is unreadable, the move illegal (with the reason) or ambiguous (with the
            candidates).
    """
    plain = _plain(text)
    if not plain or len(plain) > _LONGEST:
        raise _unreadable(text)
    if plain in _NULL_MOVES:
        raise NotationError(
            f"'{plain}' is a null move: nobody can pass on a real board.",
            hint="Leave it out, or name a move.",
        )
    if _CASTLING.match(plain):
        return _castle(plain, board)
    if coordinates := (_COORDINATES.match(plain) or _shouted(plain)):
        return _from_coordinates(plain, coordinates, board)
    if numeric := _NUMERIC.match(plain):
        return _from_numeric(plain, numeric, board)
    readings = tuple(_readings(plain, any_case=any_case))
    if not readings:
        raise _unreadable(text)
    return _choose(plain, readings, board)


def readable(text: str) -> bool:
    """Whether the text has the form of a move, legal or not."""
    plain = _plain(text)
    forms = (_CASTLING, _COORDINATES, _NUMERIC, _SAN)
    return len(plain) <= _LONGEST and any(form.match(plain) for form in forms)


def iccf(move: chess.Move) -> str:
    """The move in ICCF numeric notation, for example ``5254``; castling is the king's move, ``5171``."""
    squares = (move.from_square, move.to_square)
    digits = "".join(f"{chess.square_file(s) + 1}{chess.square_rank(s) + 1}" for s in squares)
    return digits + _NUMERIC_DIGIT.get(move.promotion or chess.PAWN, "")


def san_log(start_fen: str, moves: Iterable[chess.Move]) -> tuple[str, ...]:
    """The moves in SAN, one string each, played from ``start_fen``.

    Raises:
        NotationError: The position is unreadable or one of the moves is illegal in its turn.
    """
    board = parse_fen(start_fen)
    log = []
    for move in moves:
        if move not in board.legal_moves:
            raise illegal(move.uci(), board, why_illegal(board, move))
        log.append(board.san_and_push(move))
    return tuple(log)


def numbered(start_fen: str, sans: Sequence[str]) -> Iterator[str]:
    """The tokens of a score sheet: ``1.``, ``e4``, ``e5``, ``2.``, … or ``1...`` first when Black begins."""
    board = parse_fen(start_fen)
    number, white = board.fullmove_number, board.turn
    for index, san in enumerate(sans):
        if white:
            yield f"{number}."
        elif index == 0:
            yield f"{number}..."
        yield san
        number += not white
        white = not white


@dataclass(frozen=True, slots=True)
class _Reading:
    """What a SAN text asks for: any part that is None is left open."""

    piece: chess.PieceType
    file: int | None
    rank: int | None
    takes: bool
    target: chess.Square
    promotion: chess.PieceType | None

    def origins(self, board: chess.Board) -> Iterator[chess.Square]:
        """Squares of the asked-for pieces of the side to move that the text does not rule out."""
        for square in board.pieces(self.piece, board.turn):
            if self.file not in {None, chess.square_file(square)} or self.rank not in {
                None,
                chess.square_rank(square),
            }:
                continue
            # A pawn move that names neither file nor capture goes straight: "d5" is never short for "exd5".
            pushes = self.piece == chess.PAWN and self.file is None and not self.takes
            if not pushes or chess.square_file(square) == chess.square_file(self.target):
                yield square


def _plain(text: str) -> str:
    """The text without move number, marks, figurines and blanks."""
    bare = _NUMBER.sub("", text.strip().translate(_PLAIN_LETTERS))
    return _DECORATION.sub("", "".join(bare.split()))


def _shouted(plain: str) -> re.Match[str] | None:
    """Coordinates in capitals throughout: ``E2E4``. Mixed case is SAN: ``B1c3`` moves a bishop."""
    return _COORDINATES.match(plain.lower()) if plain.isupper() else None


def _readings(plain: str, *, any_case: bool) -> Iterator[_Reading]:
    """The SAN readings of a text, the likeliest first."""
    if match := _SAN.match(plain):
        yield _reading(match)
    # A lower-case b is the b-file first and a bishop only where no pawn of that file can go: "bc4".
    if any_case and plain[0] in "kqrbn" and (match := _SAN.match(plain[0].upper() + plain[1:])):
        yield _reading(match)


def _reading(match: re.Match[str]) -> _Reading:
    piece, letter = match["piece"], match["promotion"]
    if letter and letter.upper() not in _PROMOTION:
        raise NotationError(
            f"'{match.string}' promotes to '{letter}', which is no piece to promote to.",
            hint="Promote to a queen, rook, bishop or knight: e8=Q, e8=R, e8=B or e8=N.",
        )
    return _Reading(
        piece=chess.PIECE_SYMBOLS.index(piece.lower()) if piece else chess.PAWN,
        file=chess.FILE_NAMES.index(match["file"]) if match["file"] else None,
        rank=int(match["rank"]) - 1 if match["rank"] else None,
        takes=bool(match["takes"]),
        target=chess.parse_square(match["target"]),
        promotion=_PROMOTION[letter.upper()] if letter else None,
    )


def _castle(plain: str, board: chess.Board) -> chess.Move:
    king = board.king(board.turn)
    kingside = sum(letter != "-" for letter in plain) == 2  # noqa: PLR2004 - two letters O
    for move in board.generate_castling_moves():
        if board.is_kingside_castling(move) == kingside:
            return move
    raise illegal(plain, board, _why_not_castle(board, king, kingside=kingside))


def _from_coordinates(plain: str, match: re.Match[str], board: chess.Board) -> chess.Move:
    promotion = _PROMOTION[match[3].upper()] if match[3] else None
    return _checked(
        plain, chess.Move(chess.parse_square(match[1]), chess.parse_square(match[2]), promotion), board
    )


def _from_numeric(plain: str, match: re.Match[str], board: chess.Board) -> chess.Move:
    origin, target = (chess.square(int(match[i][0]) - 1, int(match[i][1]) - 1) for i in (1, 2))
    return _checked(plain, chess.Move(origin, target, _NUMERIC_PROMOTION.get(match[3])), board)


def _checked(plain: str, move: chess.Move, board: chess.Board) -> chess.Move:
    if move in board.legal_moves:
        # The board also takes castling as the king onto its rook, e1h1; its parser makes that e1g1.
        return board.parse_uci(move.uci())
    queened = chess.Move(move.from_square, move.to_square, chess.QUEEN)
    if move.promotion is None and queened in board.legal_moves:
        raise _promotion_missing(plain)
    raise illegal(plain, board, why_illegal(board, move))


def _choose(plain: str, readings: tuple[_Reading, ...], board: chess.Board) -> chess.Move:
    for reading in readings:
        moves = _matching(reading, board)
        if len(moves) == 1:
            return moves[0]
        if moves and reading.promotion is None and all(move.promotion for move in moves):
            raise _promotion_missing(plain)
        if moves:
            raise _ambiguous(plain, moves, board)
    raise illegal(plain, board, _why_no_move(readings[-1], board))


def _matching(reading: _Reading, board: chess.Board) -> list[chess.Move]:
    return [
        move
        for move in board.generate_legal_moves(int(chess.SquareSet(reading.origins(board))))
        if move.to_square == reading.target
        and reading.promotion in {None, move.promotion}
        and (not reading.takes or board.is_capture(move))
    ]


def why_illegal(board: chess.Board, move: chess.Move) -> str:
    """Say in plain words why ``move`` cannot be played in ``board``; empty when it can."""
    piece = board.piece_at(move.from_square)
    if move in board.legal_moves:
        return ""
    if piece is None:
        return f"no piece stands on {chess.square_name(move.from_square)}"
    return next(_faults(board, move, piece))


def _faults(board: chess.Board, move: chess.Move, piece: chess.Piece) -> Iterator[str]:
    """What is wrong with an illegal move, the plainest fault first; each presumes none of those above."""
    origin, target = move.from_square, move.to_square
    victim = board.piece_at(target)
    if piece.color != board.turn:
        yield f"the {_piece_at(board, origin)} is {_side(piece.color)}'s, and {_side(board.turn)} is to move"
    if origin == target:
        yield "a move ends on another square than it starts"
    if victim is not None and victim.color == piece.color:
        yield f"{_side(piece.color)}'s own {_piece_at(board, target)} is in the way"
    if piece.piece_type == chess.KING and _looks_like_castling(origin, target):
        yield _why_not_castle(board, origin, kingside=target > origin)
    if move.promotion and not _promotes(board, origin, target):
        yield "only a pawn that reaches the last rank is promoted"
    pushed = chess.Move(origin, target, chess.QUEEN if _promotes(board, origin, target) else None)
    if board.is_pseudo_legal(pushed):
        yield _why_unsafe(board, pushed)
    yield _why_unreachable(board, piece, origin, target)


def illegal(text: str, board: chess.Board, reason: str) -> NotationError:
    """The error for a readable move that the rules forbid: the reason, and examples of what is allowed."""
    legal = sorted(board.san(move) for move in board.legal_moves)
    if not legal:
        return NotationError(
            f"'{text}' cannot be played: the game is over, {_side(board.turn)} has no legal move."
        )
    shown = ", ".join(legal[:6]) + (", …" if len(legal) > 6 else "")  # noqa: PLR2004 - as many as fit a line
    return NotationError(
        f"'{text}' is illegal for {_side(board.turn)} on move {board.fullmove_number}: {reason}.",
        hint=f"{len(legal)} moves are legal here: {shown}.",
    )


def _unreadable(text: str) -> NotationError:
    return NotationError(f"{quoted(text, 40)} cannot be read as a move.", hint=ACCEPTED)


def _promotion_missing(plain: str) -> NotationError:
    return NotationError(
        f"'{plain}' promotes a pawn but does not say to which piece.",
        hint=f"Add the piece: {plain}=Q, {plain}=R, {plain}=B or {plain}=N.",
    )


def _ambiguous(plain: str, moves: list[chess.Move], board: chess.Board) -> NotationError:
    names = sorted(board.san(move) for move in moves)
    return NotationError(
        f"'{plain}' is ambiguous: it can be {', '.join(names[:-1])} or {names[-1]}.",
        hint="Name the one you mean.",
    )


def _why_no_move(reading: _Reading, board: chess.Board) -> str:
    """Why no piece fits a SAN reading; where a single piece was meant, why that one cannot go."""
    side, kind, target = _side(board.turn), chess.piece_name(reading.piece), chess.square_name(reading.target)
    en_passant = reading.piece == chess.PAWN and reading.target == board.ep_square
    if reading.takes and board.piece_at(reading.target) is None and not en_passant:
        return f"there is nothing to take on {target}"
    if not board.pieces(reading.piece, board.turn):
        return f"{side} has no {kind}"
    origins = list(reading.origins(board))
    meant = (
        [square for square in origins if _could_go(board, square, reading.target)]
        or [
            square
            for square in origins
            if _aims(chess.Piece(reading.piece, board.turn), square, reading.target)
        ]
        or origins
    )
    if len(meant) == 1:
        return why_illegal(board, chess.Move(meant[0], reading.target, reading.promotion))
    where = ", ".join(chess.square_name(square) for square in board.pieces(reading.piece, board.turn))
    return f"no {kind} of {side}'s can go to {target} (there is one on {where})"


def _could_go(board: chess.Board, origin: chess.Square, target: chess.Square) -> bool:
    return any(
        move.to_square == target for move in board.generate_pseudo_legal_moves(chess.BB_SQUARES[origin])
    )


def _why_unsafe(board: chess.Board, move: chess.Move) -> str:
    after = board.copy(stack=False)
    after.push(move)
    king = after.king(board.turn)
    attackers = after.attackers(not board.turn, king) if king is not None else chess.SquareSet()
    by = " and ".join(f"the {_piece_at(after, square)}" for square in attackers)
    verb = "leaves" if board.is_check() else "puts"
    return f"it {verb} {_side(board.turn)}'s king in check from {by}"


def _why_unreachable(
    board: chess.Board, piece: chess.Piece, origin: chess.Square, target: chess.Square
) -> str:
    pawn, there = piece.piece_type == chess.PAWN, chess.square_name(target)
    straight = chess.square_file(origin) == chess.square_file(target)
    if pawn and straight and board.piece_at(target):
        return f"a pawn does not take straight ahead, and the {_piece_at(board, target)} is in the way"
    blockers = chess.SquareSet(chess.between(origin, target)) & chess.SquareSet(board.occupied)
    if blockers and (_aims(piece, origin, target) or (pawn and straight)):
        return f"the {_piece_at(board, next(iter(blockers)))} is in the way"
    if pawn and target in board.attacks(origin):
        return f"a pawn goes diagonally only to take, and there is nothing to take on {there}"
    return f"a {chess.piece_name(piece.piece_type)} does not go from {chess.square_name(origin)} to {there}"


def _aims(piece: chess.Piece, origin: chess.Square, target: chess.Square) -> bool:
    """Whether the piece would bear on the target if the board were empty."""
    alone = chess.Board(None)
    alone.set_piece_at(origin, piece)
    return target in alone.attacks(origin)


def _why_not_castle(board: chess.Board, king: chess.Square | None, *, kingside: bool) -> str:
    home = chess.E1 if board.turn == chess.WHITE else chess.E8
    rook = chess.square(7 if kingside else 0, chess.square_rank(home))
    wing = "kingside" if kingside else "queenside"
    if king != home or not board.castling_rights & chess.BB_SQUARES[rook]:
        return f"{_side(board.turn)} has no right to castle {wing}: the king or that rook has moved"
    blockers = chess.SquareSet(chess.between(king, rook)) & chess.SquareSet(board.occupied)
    if blockers:
        return f"the {_piece_at(board, next(iter(blockers)))} stands between king and rook"
    if board.is_check():
        return "the king is in check"
    return "the king would pass over or reach a square that the opponent attacks"


def _looks_like_castling(origin: chess.Square, target: chess.Square) -> bool:
    return origin in {chess.E1, chess.E8} and abs(target - origin) == 2  # noqa: PLR2004 - the king's two files


def _promotes(board: chess.Board, origin: chess.Square, target: chess.Square) -> bool:
    return board.piece_type_at(origin) == chess.PAWN and chess.square_rank(target) in {0, 7}


def _piece_at(board: chess.Board, square: chess.Square) -> str:
    return f"{chess.piece_name(board.piece_type_at(square) or chess.PAWN)} on {chess.square_name(square)}"


def _side(colour: chess.Color) -> str:
    return "White" if colour == chess.WHITE else "Black"


def quoted(text: str, longest: int) -> str:
    """Text of unknown origin for a message: control characters shown, long text cut."""
    shown = text if len(text) <= longest else text[:longest] + "…"
    return repr(shown)
