"""Which engines clients may choose: those found here, and the configured one.

An engine is a program that the server starts, so that a free choice would let whoever operates the robot from
afar run any program on its computer.
"""

from kempelen.app.config import Config
from kempelen.core.errors import ConfigError
from kempelen.core.words import say
from kempelen.engines.find import Shelf
from kempelen.server.model import Model

_STOCKFISH = "stockfish"


class EngineView(Model):
    """An engine to choose.

    Attributes:
        engine: Value of ``engine`` or ``opponent`` in a command; empty for the configured one.
        name: For people.
        levels: Whether its strength can be set from 1 to 20 or by Elo; a Maia has its own.
    """

    engine: str
    name: str
    levels: bool = True


def offered(config: Config) -> tuple[EngineView, ...]:
    """All that can be chosen, the usual one first."""
    usual = config.engine.path.rpartition("/")[2] or "The best at hand"
    shelf = Shelf.here()
    maias = (EngineView(engine=f"maia-{elo}", name=f"Maia {elo}", levels=False) for elo in shelf.maia_elos)
    others = (EngineView(engine=name, name=name) for name in shelf.others())
    return EngineView(engine="", name=usual), EngineView(engine=_STOCKFISH, name="Stockfish"), *maias, *others


def require_offered(config: Config, *wanted: str) -> None:
    """Refuse any other.

    Raises:
        ConfigError: it is none of these.
    """
    known = {view.engine for view in offered(config)}
    for engine in wanted:
        if engine not in known:
            raise ConfigError(
                say(
                    "engine_not_offered",
                    f"The engine '{engine[:60]}' is not offered here.",
                    engine=engine[:60],
                ),
                hint=say(
                    "choose_engine",
                    "Choose one of the list, or start the server with another one: --engine PATH",
                ),
            )
