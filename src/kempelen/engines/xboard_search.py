"""One search over the xboard protocol: what is said before it, and what each line of it means."""

import asyncio
from collections.abc import Set as AbstractSet

import chess
import chess.engine

from kempelen.core.errors import EngineError
from kempelen.core.protocols import OnThinking, Thinking
from kempelen.engines import xboard_lines as lines_of
from kempelen.engines.wire import Findings

_WHOLE = 1.0  # s from which a time is told as whole seconds per move; shorter ones as a clock
_MOVES_PER_CLOCK = 30  # that an engine is expected to spread its clock over


def control(board: chess.Board, limit: chess.engine.Limit) -> list[str]:
    """Time in the units that every engine of the protocol reads: whole minutes, seconds, centiseconds."""
    seconds = limit.time or 3600.0
    mine, theirs = limit.white_clock, limit.black_clock
    if board.turn is chess.BLACK:
        mine, theirs = theirs, mine
    depth = [] if limit.depth is None else [f"sd {limit.depth}"]
    if mine is None and seconds >= _WHOLE:
        return [*depth, f"st {round(seconds)}"]
    if mine is None:
        mine = seconds * _MOVES_PER_CLOCK
    minutes, left, other = (
        max(1, round(time)) for time in (mine / 60.0, 100 * mine, 100 * (mine if theirs is None else theirs))
    )
    return [*depth, f"level 0 {minutes} 0", f"time {left}", f"otim {other}"]


def continues(told: chess.Board, board: chess.Board) -> int | None:
    """How many moves ``board`` has more than ``told``; None where it is another game or has fewer."""
    n = len(told.move_stack)
    same = told.move_stack == board.move_stack[:n] and told.root().fen() == board.root().fen()
    return len(board.move_stack) - n if same else None


def refuses(line: str, moves: AbstractSet[str]) -> bool:
    """Whether the engine will not have one of these moves."""
    words = (lines_of.refused(line) or "").split()
    return bool(words) and words[-1] in moves


def take(line: str, board: chess.Board, findings: Findings, on_thinking: OnThinking | None) -> bool | None:
    """One line of a search; True when it has moved or resigned."""
    if text := lines_of.move_text(line):
        return _take_move(text, board, findings)
    if line.strip() == "offer draw":
        findings.offers_draw = True
    elif claim := lines_of.verdict(line):
        return _take_claim(claim, line, board, findings)
    elif board.move_stack and refuses(line, {board.peek().uci()}):
        raise EngineError(f"it refuses a legal move of the game: {line}")
    elif thinking := lines_of.parse_thinking(line, board):
        _take_thought(thinking, findings, on_thinking)
    return None


def _take_move(text: str, board: chess.Board, findings: Findings) -> bool:
    move = lines_of.parse_move(text, board)
    if move is None:
        legal = board.legal_moves.count()
        raise EngineError(f"it named '{text[:20]}', which is not among the moves, of which {legal} are legal")
    findings.move = move
    # Its last thought may have been about another move: the score of that one says nothing of this one.
    thought = findings.lines.get(1)
    if thought and thought.line[:1] != (move,):
        findings.lines[1] = Thinking(thought.depth, thought.centipawns, thought.mate, (move,), thought.nodes)
    return True


def _take_claim(claim: lines_of.Verdict, line: str, board: chess.Board, findings: Findings) -> bool:
    """A result instead of a move: only the engine's own resignation is believed."""
    lost = "0-1" if board.turn is chess.WHITE else "1-0"
    if claim.resigned and claim.result in {"", lost}:
        findings.resigns = True
        return True
    legal = board.legal_moves.count()
    raise EngineError(f"it claims '{line[:60]}' instead of a move, although {legal} are legal")


def _take_thought(thinking: Thinking, findings: Findings, on_thinking: OnThinking | None) -> None:
    if not thinking.line and 1 in findings.lines:
        return  # a progress line
    findings.lines[1] = thinking
    if on_thinking:
        # Not called from within the transport: a fault in the listener must not break the wire.
        asyncio.get_running_loop().call_soon(on_thinking, thinking)


def turned(thinking: Thinking, move: chess.Move) -> Thinking:
    """The answer's thought as one about ``move``, from the other side."""
    centipawns = None if thinking.centipawns is None else -thinking.centipawns
    mate = None if thinking.mate is None else 1 - thinking.mate if thinking.mate <= 0 else -thinking.mate
    return Thinking(thinking.depth + 1, centipawns, mate, (move, *thinking.line), thinking.nodes)


def worth(thinking: Thinking) -> float:
    """For sorting: mates before and behind all scores."""
    if thinking.mate is not None:
        return 1e6 - thinking.mate if thinking.mate > 0 else -1e6 - thinking.mate
    return float(thinking.centipawns or 0)
