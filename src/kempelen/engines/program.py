"""An engine that keeps its word: it names a legal move, or says why it cannot."""

import difflib
import random
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import chess
import chess.engine

from kempelen.core.errors import ConfigError, EngineError
from kempelen.core.protocols import EngineChoice, OnThinking, Thinking
from kempelen.engines.adaptive import Balance
from kempelen.engines.find import EngineProgram
from kempelen.engines.strength import FULL, Level, Means, SearchPlan, plan_for
from kempelen.engines.tongues import Tongue, start_process
from kempelen.engines.wire import EngineProcess, Findings, OptionValue, Patience

_SECONDS_LEAST, _SECONDS_MOST = 0.01, 3600.0
_MANAGED = frozenset({"multipv", "ponder", "uci_chess960", "uci_variant", "uci_limitstrength", "uci_elo"})


@dataclass(frozen=True, slots=True)
class Habits:
    """How an engine is used.

    Attributes:
        seconds: For each move, 0.01..3600.
        threads: Of the search.
        hash_mb: Of the table of positions, MB.
        options: Further options by name.
        seed: Of the choice among sampled moves: with the same one the same game comes again. None: by chance.
        patience: How long it may be silent, and how often it is started again.
        ponder: It thinks on in the opponent's time.
        book: ``people`` or the path of an opening book; empty for none.
        depth: Half-moves that it looks ahead at most; None: as far as the time allows.
        voters: How many searches a cluster makes of one position.
    """

    seconds: float = 1.0
    threads: int = 1
    hash_mb: int = 64
    options: Mapping[str, OptionValue] = field(default_factory=dict)
    seed: int | None = None
    patience: Patience = field(default_factory=Patience)
    ponder: bool = False
    depth: int | None = None
    voters: int = 4
    book: str = ""

    def __post_init__(self) -> None:
        _check_seconds(self.seconds)
        if self.threads < 1 or self.hash_mb < 1:
            raise ConfigError(
                f"An engine needs at least 1 thread and 1 MB, not {self.threads} and {self.hash_mb}.",
                hint="The defaults are 1 thread and 64 MB.",
            )

    def seconds_for(self, board: chess.Board, wanted: float | None) -> float:
        """The time for a move at ``board``: as wanted, or the usual one, s.

        Raises:
            EngineError: There is no legal move to choose.
            ConfigError: ``wanted`` is out of range.
        """
        if not any(board.legal_moves):
            raise EngineError(
                f"There is no legal move in {board.fen()}: the game is over.", hint="Start another game."
            )
        seconds = self.seconds if wanted is None else wanted
        _check_seconds(seconds)
        return seconds


def _check_seconds(seconds: float) -> None:
    """Refuse a time per move that is out of range.

    Raises:
        ConfigError: It is.
    """
    if not _SECONDS_LEAST <= seconds <= _SECONDS_MOST:
        raise ConfigError(
            f"A time of {seconds:g} s per move is out of range.",
            hint=f"Give {_SECONDS_LEAST:g} to {_SECONDS_MOST:g} s.",
        )


class ProgramEngine:
    """A UCI or xboard engine at a level (implements `kempelen.core.protocols.Engine`).

    A process that dies, falls silent or names an illegal move is ended and started again, and the search is
    repeated, ``patience.restarts`` times at most for one move. What is chosen among sampled moves depends on
    the seed and the position alone, so that it is the same after a restart.

    Args:
        program: What to start.
        level: How strongly it plays.
        habits: Time, memory, options.
        time_left: Tells a side's time on the game's clock, s; None without one. Engines of xboard manage it
            themselves, within the time of the move.
    """

    def __init__(
        self,
        program: EngineProgram,
        level: Level = FULL,
        habits: Habits | None = None,
        time_left: Callable[[chess.Color], float | None] = lambda _: None,
    ) -> None:
        self.name = _shown(program.name, level)
        self._program = program
        self._tongue = program.tongue
        self._time_left = time_left
        self._level = level
        self._habits = habits or Habits()
        self._seed = secrets.randbits(32) if self._habits.seed is None else self._habits.seed
        self._plan = SearchPlan()
        self._balance = Balance()
        self._process: EngineProcess | None = None
        self._game: object = object()

    async def __aenter__(self) -> Self:
        """Start the engine.

        Raises:
            EngineError: It cannot be executed, speaks neither UCI nor xboard, or cannot play the level.
            ConfigError: An option is unknown to it or out of range.
        """
        await self._running()
        return self

    async def __aexit__(self, *exc: object) -> None:
        """End the engine; no process is left behind."""
        await self._close(politely=True)

    @property
    def options(self) -> Mapping[str, str]:
        """What the running engine lets its user set, by name: kind and range in words."""
        offered = self._process.options if self._process else {}
        return {name: _in_words(option) for name, option in offered.items()}

    @property
    def tongue(self) -> Tongue | None:
        """The protocol that it speaks; None until it is known."""
        return self._tongue

    @property
    def pid(self) -> int | None:
        """Of the engine's process; None when there is none."""
        return self._process.pid if self._process else None

    def new_game(self) -> None:
        """What comes next is another game: the engine forgets what it has learned in this one."""
        self._game = object()

    async def choose(
        self, board: chess.Board, *, seconds: float | None = None, on_thinking: OnThinking | None = None
    ) -> EngineChoice:
        """A legal move for ``board``, whose move stack is the game so far; cancelled, it stops thinking.

        Raises:
            EngineError: There is no legal move to choose, or the engine named none in all its attempts.
            ConfigError: ``seconds`` is out of range.
        """
        limit = self._habits.seconds_for(board, seconds)
        findings = await self._search(board, limit, on_thinking)
        if findings.resigns:
            return EngineChoice(chess.Move.null(), findings.lines.get(1, Thinking()), resigns=True)
        dice = random.Random(f"{self._seed} {board.ply()} {board.fen()}")  # noqa: S311 - chance in play, no secret
        choice = replace(self._plan.choose(findings, dice), offers_draw=findings.offers_draw)
        if on_thinking and choice.thinking.adapted is not None:
            on_thinking(choice.thinking)  # it is told openly at what strength this move was chosen
        return choice

    async def _search(self, board: chess.Board, seconds: float, on_thinking: OnThinking | None) -> Findings:
        faults: list[EngineError] = []
        while len(faults) <= self._habits.patience.restarts:
            try:
                process = await self._running()
                limit = self._limit(seconds)
                return await process.search(
                    board,
                    limit,
                    self._game,
                    on_thinking,
                    ponder=self._habits.ponder and self._plan.lines == 1,
                )
            except EngineError as fault:
                faults.append(fault)
                await self._close(politely=False)
        raise EngineError(
            f"The engine {self.name} named no move in {len(faults)} attempts at {board.fen()}: "
            f"{faults[-1].message.rstrip('.')}.",
            hint="The game is kept. Try another engine (--engine) or more time (--move-time), and resume.",
        ) from faults[-1]

    def _limit(self, seconds: float) -> chess.engine.Limit:
        limit = self._plan.limit(seconds)
        if self._habits.depth is not None and (limit.depth is None or limit.depth > self._habits.depth):
            limit.depth = self._habits.depth
        if self._tongue is Tongue.XBOARD:
            limit.white_clock, limit.black_clock = self._time_left(chess.WHITE), self._time_left(chess.BLACK)
        return limit

    async def _running(self) -> EngineProcess:
        if self._process is None:
            self._process = await self._started()
        return self._process

    async def _started(self) -> EngineProcess:
        try:
            process = await start_process(self._program.command, self._habits.patience, self._tongue)
        except EngineError as fault:
            raise self._in_context(fault) from fault
        try:
            self._plan = plan_for(self._level, process.options, self._balance)
            await process.configure(self._settings(process), lines=self._plan.lines)
        except EngineError as fault:
            await process.close(politely=False)
            raise self._in_context(fault) from fault
        except BaseException:
            await process.close(politely=False)
            raise
        self._tongue = Tongue(process.tongue)
        if process.name and self._level.means is not Means.MAIA:
            self.name = _shown(process.name, self._level, sampled=process.apart and self._plan.lines > 1)
        return process

    def _in_context(self, fault: EngineError) -> EngineError:
        return EngineError(
            f"The engine {' '.join(self._program.command[:1])}: {fault.message}",
            hint=fault.hint or "Name another engine with --engine, or leave it out to use the best at hand.",
        )

    async def _close(self, *, politely: bool) -> None:
        process, self._process = self._process, None
        if process:
            await process.close(politely=politely)

    def _settings(self, process: EngineProcess) -> dict[str, OptionValue]:
        """In rising order of right: ours where offered, the program's needs, the user's, the level's."""
        modest = {"Threads": self._habits.threads, "Hash": self._habits.hash_mb}
        settings: dict[str, OptionValue] = {
            name: value for name, value in modest.items() if name in process.options
        }
        settings |= self._program.options
        for name, value in self._habits.options.items():
            _check_option(name, process)
            settings[name] = value
        return settings | dict(self._plan.options)


def _shown(name: str, level: Level, *, sampled: bool = False) -> str:
    """A Maia network's name tells its strength; it matters more than the program that evaluates it."""
    how = f"{level}, by sampling" if sampled else str(level)
    return name if level.means is Means.MAIA else f"{name} ({how})"


def _in_words(option: chess.engine.Option) -> str:
    if option.type == "spin":
        return f"number {option.min} to {option.max}"
    return f"one of {', '.join(option.var)}" if option.var else option.type


def _check_option(name: str, process: EngineProcess) -> None:
    if name.lower() in _MANAGED:
        raise ConfigError(
            f"The engine option '{name}' is set by Kempelen itself.", hint="Leave it out; see --level."
        )
    if name not in process.options:
        close = difflib.get_close_matches(name, process.options, n=3, cutoff=0.4)
        raise ConfigError(
            f"The engine {process.name} has no option '{name}'.",
            hint=f"Did you mean {', '.join(close)}?" if close else "Leave it out.",
        )
