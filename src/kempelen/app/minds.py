"""Engines as configured: programs of this machine, and those at nodes."""

from collections.abc import Callable

import chess

from kempelen.app.config import NODE_PORT, Config
from kempelen.app.network import link_of, table_name
from kempelen.core.protocols import Engine
from kempelen.engines.program import Habits
from kempelen.engines.select import create_engine
from kempelen.engines.wire import OptionValue
from kempelen.nodes.remote_engine import RemoteEngine


def habits_of(config: Config, seconds: float) -> Habits:
    """How engines are used, as configured."""
    chosen = config.engine
    options: dict[str, OptionValue] = {
        name: value for name, value in chosen.options.items() if not isinstance(value, float)
    }
    return Habits(
        seconds, chosen.threads, chosen.hash_mb, options, config.twin.seed or None,
        ponder=chosen.ponder, depth=chosen.depth or None, voters=chosen.voters, book=chosen.book,
    )  # fmt: skip


def engine_of(
    config: Config,
    path: str,
    level: str,
    seconds: float,
    time_left: Callable[[chess.Color], float | None] = lambda _: None,
) -> Engine:
    """The engine for a wish, to be entered.

    Args:
        config: For its habits, and the network.
        path: As `create_engine`, or ``node:NAME`` for one at a node.
        level: As `create_engine`; a node's engine has that of its node, and says so in its name.
        seconds: For each move.
        time_left: Tells a side's time on the game's clock, s.

    Raises:
        EngineError: there is no such engine.
        ConfigError: engine and level contradict each other, or the name of the node is none.
    """
    if not path.startswith(NODE_PORT):
        return create_engine(path, level, habits_of(config, seconds), time_left=time_left)
    return RemoteEngine(link_of(config), table_name(path.removeprefix(NODE_PORT)))
