"""One plain question to the person at the board, instead of a guess."""

from collections.abc import Sequence

import chess

from kempelen.core.pieces import piece_name
from kempelen.core.words import say
from kempelen.sensing.moves.hypotheses import Happened, Hypothesis
from kempelen.sensing.moves.verdicts import Line

NAMED = 3  # more alternatives than that are not listed


def ask(board: chess.Board, rivals: Sequence[Hypothesis]) -> tuple[tuple[Line, ...], str]:
    """Candidates and question.

    Args:
        board: The confirmed position.
        rivals: What may have happened, likeliest first; at least one.
    """
    return _lines(rivals), _question(board, rivals)


def _lines(rivals: Sequence[Hypothesis]) -> tuple[Line, ...]:
    """Whole moves from here, and the empty line for "nothing"; what was only begun as it would end."""
    real = [h for h in rivals if h.happened in {Happened.STANDING, Happened.MOVE, Happened.TWO}]
    real += [other for h in rivals for other in h.also if other.happened is Happened.TWO]
    begun = [h for h in rivals if h.happened is Happened.HALF]
    return tuple(dict.fromkeys(line for h in (*real, *begun) for line in h.lines))


def _question(board: chess.Board, rivals: Sequence[Hypothesis]) -> str:
    best = rivals[0]
    if best.happened is Happened.HALF and best.advice:
        return best.advice
    for attempt in (_back, _promotion, _where, _which, _lifted, _still):
        if text := attempt(board, rivals):
            return text
    return _list(board, rivals)


def _back(board: chess.Board, rivals: Sequence[Hypothesis]) -> str:
    """Take-backs that look like something else, or like nearly nothing."""
    backs = [h for h in rivals if h.happened in {Happened.BACK, Happened.REPLACED}]
    if not backs:
        return ""
    plies = backs[0].plies
    what = "the last move" if plies == 1 else "the last two moves"
    others = [line for h in rivals if h not in backs for line in h.lines]
    others += [line for h in rivals for other in h.also for line in other.lines]
    if not others or not others[0]:
        return say("taken_back", f"Was {what} taken back?", plies=plies)
    move = _san(board, others[0])
    return say("taken_back_or", f"Was {what} taken back, or was it {move}?", plies=plies, move=move)


def _promotion(board: chess.Board, rivals: Sequence[Hypothesis]) -> str:
    """One pawn on the last rank, and nothing known about what it has become."""
    lines = _lines(rivals)
    ways = {(m.from_square, m.to_square, len(line)) for line in lines for m in line[:1]}
    if len(ways) != 1 or not lines or not all(line and line[0].promotion for line in lines):
        return ""
    pawn, square = chess.Piece(chess.PAWN, board.turn), chess.square_name(lines[0][0].to_square)
    text = f"What does the {piece_name(pawn)} become on {square}: a queen, a rook, a bishop or a knight?"
    return say("promotes_to", text, piece=pawn, square=square)


def _where(board: chess.Board, rivals: Sequence[Hypothesis]) -> str:
    """One piece that may stand here or there."""
    lines = _single(rivals)
    moved = [line[0] for line in lines if line]
    if len(lines) == 1 or len({m.from_square for m in moved}) != 1 or len(moved) > NAMED:
        return ""
    home = moved[0].from_square
    spots = {home if not line else line[0].to_square for line in lines}
    squares = [chess.square_name(s) for s in sorted(spots)]
    text = f"Is the {_piece(board, home)} on {_or(squares)}?"
    return say("where", text, piece=_letter(board, home), squares=squares)


def _which(board: chess.Board, rivals: Sequence[Hypothesis]) -> str:
    """Several pieces that may have come to one square."""
    lines = _single(rivals)
    homes = list(dict.fromkeys(line[0].from_square for line in lines if line))
    if len(homes) == 1 or not all(lines) or len({line[0].to_square for line in lines}) != 1:
        return ""
    target = chess.square_name(lines[0][0].to_square)
    pieces = [f"the {_piece(board, home)} from {chess.square_name(home)}" for home in homes[:NAMED]]
    squares = [chess.square_name(home) for home in homes[:NAMED]]
    return say("which_piece", f"Which piece went to {target}: {_or(pieces)}?", square=target, squares=squares)


def _lifted(board: chess.Board, rivals: Sequence[Hypothesis]) -> str:
    """A piece that has left its square and stands nowhere."""
    if rivals[0].happened is not Happened.HALF:
        return ""
    gone = [s for s, state in rivals[0].changes if state == 0 and board.color_at(s) == board.turn]
    if gone:
        return _about("where_goes", "Where does the {piece} from {square} go?", board, gone[0])
    gone = [s for s, _ in rivals[0].changes]
    return _about("what_takes", "What takes the {piece} on {square}?", board, gone[0])


def _still(board: chess.Board, rivals: Sequence[Hypothesis]) -> str:
    """A piece that is hardly to be seen, and may be in the hand."""
    begun = next((h for h in rivals if h.happened is Happened.HALF), None)
    if begun is None:
        return ""
    square = min(s for s, _ in begun.changes)
    return _about("still_there", "Is the {piece} still on {square}?", board, square)


def _list(board: chess.Board, rivals: Sequence[Hypothesis]) -> str:
    lines = _lines(rivals)[:NAMED]
    names = [_san(board, line) for line in lines]
    if len(names) == 1:
        if not lines[0]:
            return say("as_it_was", "Is the position as it was?")
        return say("was_it", f"Was it {names[0]}?", move=names[0])
    return say("what_was_played", f"What was played: {_or(names)}?", moves=names)


def _single(rivals: Sequence[Hypothesis]) -> list[Line]:
    """Finished lines of at most one move; nothing when there are longer ones."""
    lines = [
        line
        for h in rivals
        if h.happened in {Happened.STANDING, Happened.MOVE, Happened.TWO}
        for line in h.lines
    ]
    return lines if all(len(line) <= 1 for line in lines) else []


def _piece(board: chess.Board, square: chess.Square) -> str:
    piece = board.piece_at(square)
    return piece_name(piece) if piece else "piece"


def _letter(board: chess.Board, square: chess.Square) -> str:
    piece = board.piece_at(square)
    return piece.symbol() if piece else ""


def _about(code: str, text: str, board: chess.Board, square: chess.Square) -> str:
    """A question about the piece on a square."""
    name = chess.square_name(square)
    shown = text.format(piece=_piece(board, square), square=name)
    return say(code, shown, piece=_letter(board, square), square=name)


def _san(board: chess.Board, line: Line) -> str:
    """The moves in words: ``"e5 and then d4"``."""
    names, position = [], board.copy(stack=False)
    for move in line:
        names.append(position.san(move))
        position.push(move)
    return " and then ".join(names) or "nothing"


def _or(names: Sequence[str]) -> str:
    return " or ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else names[0]
