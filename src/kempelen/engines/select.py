"""From what the user asks for, an engine and a level, to the engine that does it best."""

from collections.abc import Callable

import chess

from kempelen.core.errors import ConfigError
from kempelen.core.protocols import Engine
from kempelen.engines.book import BookEngine, open_book
from kempelen.engines.cluster import ClusterEngine, parse_cluster
from kempelen.engines.find import Shelf
from kempelen.engines.program import Habits, ProgramEngine
from kempelen.engines.strength import Level, Means, nearest_maia, parse_level


def create_engine(
    engine: str = "",
    level: str = "full",
    habits: Habits | None = None,
    *,
    shelf: Shelf | None = None,
    time_left: Callable[[chess.Color], float | None] = lambda _: None,
) -> Engine:
    """The engine for a wish; nothing is started before it is entered.

    Where the user names no engine, levels that a Maia network stands for are played by it, since it errs as
    people do; all others by the engine at hand.

    Args:
        engine: A path, a name on PATH, ``maia-1500``, ``cluster`` or ``cluster:ray://HOST``, or empty for the
            best at hand.
        level: ``1``..``20``, an Elo like ``1500``, ``maia-1500`` or ``full``.
        habits: Time, memory, options.
        shelf: Where to look; this machine by default.
        time_left: Tells a side's time on the game's clock, s; None without one.

    Raises:
        EngineError: There is no such engine.
        ConfigError: The level is unknown, or engine and level contradict each other.
    """
    wanted = _wanted(engine, level)
    thinker = _thinker(engine, wanted, habits, shelf or Shelf.here(), time_left)
    if habits and habits.book:
        return BookEngine(thinker, open_book(habits.book, wanted.elo), habits.seed)
    return thinker


def _thinker(
    engine: str,
    wanted: Level,
    habits: Habits | None,
    shelf: Shelf,
    time_left: Callable[[chess.Color], float | None],
) -> Engine:
    if (address := parse_cluster(engine)) is not None:
        if wanted.means is not Means.FULL:
            raise ConfigError("A cluster plays at full strength alone.", hint="Leave out --level.")
        return ClusterEngine(address, habits=habits)
    if wanted.means is Means.MAIA:
        return ProgramEngine(shelf.maia(wanted.number), wanted, habits, time_left)
    if not engine and (elo := nearest_maia(wanted, shelf.maia_elos)):
        return ProgramEngine(shelf.maia(elo), Level(Means.MAIA, elo), habits, time_left)
    return ProgramEngine(shelf.find(engine), wanted, habits, time_left)


def _wanted(engine: str, level: str) -> Level:
    wanted = parse_level(level)
    if not engine.lower().startswith("maia"):
        if engine and wanted.means is Means.MAIA:
            raise ConfigError(
                f"The level {level} is played by Maia, not by the engine '{engine}'.",
                hint="Leave out --engine, or give a level of 1 to 20, an Elo, or full.",
            )
        return wanted
    by_name = parse_level(engine)
    if wanted not in {by_name, parse_level("full")}:
        raise ConfigError(
            f"The engine '{engine}' has a strength of its own and cannot play the level {level}.",
            hint="Leave out --level.",
        )
    return by_name
