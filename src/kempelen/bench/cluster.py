"""`kempelen bench cluster`: does a vote of several searches play better than one search of the same size?

Four voters of N nodes against one search of N nodes, the same program on both sides, from seeded openings
that a longer search thinks balanced, each played with both colours. The yardstick is one search of 4 N nodes
against the same opponent, from the first half of these openings: what the same effort is worth where it need
not be shared out.

A game ends by the rules; or when both sides have agreed for two moves that one is 5 pawns up; or as a draw
after 120 moves. The share of a voter's nodes that goes into warming counts as its own.
"""

import asyncio
import random
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import chess

from kempelen.bench.elo import elo_interval, elo_of
from kempelen.bench.result import BenchResult, Progress
from kempelen.core.errors import ConfigError
from kempelen.engines.cluster import ClusterEngine
from kempelen.engines.program import Habits
from kempelen.engines.voter import Voter
from kempelen.engines.voting import Effort, Vote, score_of

NODES = 2000
_VOTERS = 4
_GAMES = 150
_YARDSTICK = 0.5  # of that many games: it is only looked at beside them
_HASH = {"Hash": 16, "Threads": 1}
_PLIES = 8  # of an opening, played at random
_BALANCED, _JUDGED_NODES = 60.0, 20_000  # centipawns, by a search of so many nodes
_WON = 500.0  # centipawns
_AGREED = 4  # half-moves in a row, two of each side
_LONGEST = 240  # half-moves

Mover = Callable[[chess.Board, str], Awaitable[tuple[str, float]]]
"""A move and its score in centipawns, for a position of the game with this name."""


@dataclass
class _Match:
    """Points of one player, pair by pair.

    Attributes:
        results: Of each game: 1, 0.5 or 0.
    """

    name: str
    results: list[float] = field(default_factory=list)

    @property
    def pairs(self) -> list[float]:
        return [sum(self.results[i : i + 2]) for i in range(0, len(self.results) - 1, 2)]

    def row(self) -> dict[str, str | float]:
        elo, low, high = elo_interval(self.pairs)
        won, lost = self.results.count(1.0), self.results.count(0.0)
        return {
            "against one search": self.name,
            "games": len(self.results),
            "won": won,
            "drawn": len(self.results) - won - lost,
            "lost": lost,
            "elo": round(elo, 1),
            "low": round(low, 1),
            "high": round(high, 1),
        }


def run(
    *, seed: int, pgn: Path | None, data: Path | None, games: float | None = None, progress: Progress
) -> BenchResult:
    """Play both matches.

    Args:
        seed: Of the openings.
        pgn: Not used.
        data: Not used.
        games: Of the vote; rounded up to an even number. The yardstick has half as many.
        progress: Told how far it is.

    Raises:
        ConfigError: Ray is not installed, or fewer than four games were asked for.
        EngineError: No engine, or it failed.
    """
    del pgn, data
    wanted = _GAMES if games is None else int(games)
    if wanted < 4:  # noqa: PLR2004 - two pairs
        raise ConfigError(f"{wanted} games say nothing.", hint="Play at least 4: --games 150")
    return asyncio.run(_play(seed, wanted + wanted % 2, progress))


async def _play(seed: int, games: int, progress: Progress) -> BenchResult:
    vote, yardstick = _Match(f"{_VOTERS} voters of {NODES} nodes"), _Match(f"1 of {_VOTERS * NODES} nodes")
    progress("waking the voters", 0.0)
    habits = Habits(hash_mb=_HASH["Hash"], voters=_VOTERS)
    async with (
        ClusterEngine(engine="stockfish", habits=habits, nodes=NODES) as cluster,
        Voter(0, "stockfish", _HASH) as judge,
        Voter(0, "stockfish", _HASH) as opponent,
        Voter(0, "stockfish", _HASH) as other,
        Voter(0, "stockfish", _HASH) as long,
    ):
        openings = [opening async for opening in _openings(seed, games // 2, judge)]

        fewer = openings[: max(2, round(_YARDSTICK * len(openings)))]

        def told() -> None:
            done = len(vote.results) + len(yardstick.results)
            share = sum(vote.results) / max(1, len(vote.results))
            so_far = f"{elo_of(share):+.0f} Elo" if vote.results else "…"
            progress(
                f"game {len(vote.results)}, {so_far}; yardstick {len(yardstick.results)}",
                done / (games + 2 * len(fewer)),
            )

        await asyncio.gather(
            _match(vote, openings, _by_vote(cluster), _alone(opponent, NODES), told),
            _match(yardstick, fewer, _alone(long, _VOTERS * NODES), _alone(other, NODES), told),
        )
    elo, low, high = elo_interval(vote.pairs)
    figures = {
        "games": float(len(vote.results)),
        "elo": round(elo, 1),
        "elo_low": round(low, 1),
        "elo_high": round(high, 1),
        "yardstick_elo": round(elo_interval(yardstick.pairs)[0], 1),
    }
    return BenchResult("cluster", figures, [vote.row(), yardstick.row()])


async def _openings(seed: int, n: int, judge: Voter) -> AsyncIterator[chess.Board]:
    """Random beginnings that a search of their own thinks balanced."""
    found = 0
    for board in _beginnings(seed):
        judged = await _ask(judge, board, "openings", _JUDGED_NODES)
        if abs(judged.score) <= _BALANCED:
            found += 1
            yield board
        if found == n:
            return


def _beginnings(seed: int) -> Iterator[chess.Board]:
    dice = random.Random(seed)  # noqa: S311 - openings, no secret
    while True:
        board = chess.Board()
        for _ in range(_PLIES):
            moves = sorted(board.legal_moves, key=chess.Move.uci)
            if moves:
                board.push(dice.choice(moves))
        if any(board.legal_moves):
            yield board


async def _match(
    match: _Match, openings: list[chess.Board], one: Mover, other: Mover, told: Callable[[], None]
) -> None:
    for number, opening in enumerate(openings):
        for colour in chess.COLORS:
            name = f"{match.name} {number} {colour}"
            movers = {colour: one, not colour: other}
            white = await _game(opening.copy(), movers, name)
            match.results.append(white if colour is chess.WHITE else 1.0 - white)
            told()


async def _game(board: chess.Board, movers: dict[chess.Color, Mover], name: str) -> float:
    """White's points."""
    agreed: list[int] = []
    while (outcome := board.outcome(claim_draw=True)) is None:
        if board.ply() >= _LONGEST:
            return 0.5
        move, score = await movers[board.turn](board, name)
        for_white = score if board.turn is chess.WHITE else -score
        agreed.append((for_white > _WON) - (for_white < -_WON))
        if len(agreed) >= _AGREED and abs(sum(agreed[-_AGREED:])) == _AGREED:
            return float(agreed[-1] > 0)
        board.push_uci(move)
    return {True: 1.0, False: 0.0, None: 0.5}[outcome.winner]


def _by_vote(cluster: ClusterEngine) -> Mover:
    before = [""]

    async def move(board: chess.Board, game: str) -> tuple[str, float]:
        if game != before[0]:
            before[0] = game
            cluster.new_game()
        choice = await cluster.choose(board)
        return choice.move.uci(), score_of(choice.thinking)

    return move


def _alone(voter: Voter, nodes: int) -> Mover:
    async def move(board: chess.Board, game: str) -> tuple[str, float]:
        vote = await _ask(voter, board, game, nodes)
        return vote.move, vote.score

    return move


async def _ask(voter: Voter, board: chess.Board, game: str, nodes: int) -> Vote:
    moves = [move.uci() for move in board.move_stack]
    return await voter.vote(board.root().fen(), moves, game, Effort(nodes=nodes))
