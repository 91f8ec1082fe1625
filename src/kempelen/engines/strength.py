"""How strongly an engine plays: from beginner to all it can.

Three means, by strength. *Maia* networks have learned to choose the moves that people of an Elo choose; their
policy is sampled, so that no two games are alike. *UCI_Elo* is the engine's own handicap. Below the least
Elo that an engine offers, its lines are *sampled*: it judges every move by a shallow search, and the worse a
move, the less likely it is played, by a softmax whose temperature rises as the Elo falls.
"""

import math
import random
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum, auto

import chess
import chess.engine

from kempelen.core.errors import ConfigError, EngineError
from kempelen.core.protocols import EngineChoice, Thinking
from kempelen.engines.adaptive import MOST, Balance, adapted
from kempelen.engines.wire import Findings, OptionValue

FULL_SCALE = 20
_ELO_LEAST, _ELO_MOST = 400, 4000
_ELO_PER_STEP = 125  # level 1 is 400, level 19 is 2650
_SAMPLED_MOST = 2000  # beyond, a single shallow search is not strong enough
_MAIA_REACH = 100  # Elo on either side of a network that it may stand for
_LEVEL = re.compile(r"(?:(?P<maia>maia-?)|(?:elo\s*)?)(?P<number>\d{1,4})", re.IGNORECASE)

_LINES = 64  # MultiPV while sampling; positions with more moves lose their worst ones
_SCORE_MOST = 1000  # centipawns: weak players see a won game, not how far it is won
_POLICY_TEMPERATURE = 0.8  # below 1: a little less random than a crowd, as one person is
_POLICY_LEAST = 0.02  # probability below which a network's move is noise

Chooser = Callable[[Findings, random.Random], EngineChoice]


class Means(Enum):
    """How a level was asked for."""

    FULL = auto()
    SCALE = auto()
    ELO = auto()
    MAIA = auto()
    ADAPTIVE = auto()


@dataclass(frozen=True, slots=True)
class Level:
    """A wanted strength.

    Attributes:
        number: Of the scale 1..20 or an Elo, by ``means``; 0 for full strength.
    """

    means: Means
    number: int = 0

    @property
    def elo(self) -> int:
        """The Elo asked for; on the scale a nominal one."""
        if self.means is Means.SCALE:
            return _ELO_LEAST + (self.number - 1) * _ELO_PER_STEP
        return self.number

    def __str__(self) -> str:
        match self.means:
            case Means.FULL:
                return "full strength"
            case Means.SCALE:
                return f"level {self.number}, about Elo {self.elo}"
            case Means.ELO:
                return f"Elo {self.number}"
            case Means.MAIA:
                return f"like people of Elo {self.number}"
            case Means.ADAPTIVE:
                return "adapts to the other side"


FULL = Level(Means.FULL)


def parse_level(text: str) -> Level:
    """Read a level: ``1``..``20``, an Elo like ``1500``, ``maia-1500``, ``adaptive`` or ``full``.

    Raises:
        ConfigError: It is none of these or out of range.
    """
    plain = text.strip().lower()
    if plain in {"full", "max", str(FULL_SCALE)}:
        return FULL
    if plain == "adaptive":
        return Level(Means.ADAPTIVE)
    match = _LEVEL.fullmatch(plain)
    number = int(match["number"]) if match else 0
    if match and match["maia"]:
        return Level(Means.MAIA, number)
    if match and 1 <= number < FULL_SCALE and plain.isdigit():
        return Level(Means.SCALE, number)
    if match and _ELO_LEAST <= number <= _ELO_MOST:
        return Level(Means.ELO, number)
    raise ConfigError(
        f"The level '{text[:40]}' is unknown.",
        hint=f"Give 1 (beginner) to {FULL_SCALE}, an Elo {_ELO_LEAST} to {_ELO_MOST}, maia-1500, or full; "
        "or adaptive.",
    )


def nearest_maia(level: Level, elos: tuple[int, ...]) -> int | None:
    """The network that stands for a level of the scale or an Elo; None where none is near enough."""
    if level.means not in {Means.SCALE, Means.ELO} or not elos:
        return None
    nearest = min(elos, key=lambda elo: abs(elo - level.elo))
    return nearest if abs(nearest - level.elo) <= _MAIA_REACH else None


@dataclass(frozen=True, slots=True)
class SearchPlan:
    """How to search and choose for a level.

    Attributes:
        options: To set on the engine.
        lines: MultiPV.
        depth: Half-moves at most; None: by time.
        nodes: At most; None: by time.
        choose: Picks the move from what was found.
    """

    options: Mapping[str, OptionValue] = field(default_factory=dict)
    lines: int = 1
    depth: int | None = None
    nodes: int | None = None
    choose: Chooser = field(default=lambda findings, _: best(findings))

    def limit(self, seconds: float) -> chess.engine.Limit:
        """The limit of one search that may take ``seconds``."""
        return chess.engine.Limit(time=seconds, depth=self.depth, nodes=self.nodes)


def plan_for(
    level: Level, offered: Mapping[str, chess.engine.Option], balance: Balance | None = None
) -> SearchPlan:
    """How an engine with these options plays a level.

    Args:
        level: The wanted strength.
        offered: The engine's options.
        balance: Of the adaptive level: what it has learned of the other side.

    Raises:
        EngineError: It cannot; the range that it can play is named.
    """
    if level.means is Means.FULL:
        return SearchPlan()
    if level.means is Means.MAIA:
        return _policy_plan(offered)
    if level.means is Means.ADAPTIVE:
        return _adaptive_plan(offered, balance or Balance())
    bounds = _elo_bounds(offered)
    if bounds and bounds[0] <= level.elo <= bounds[1]:
        return SearchPlan({"UCI_LimitStrength": True, "UCI_Elo": level.elo})
    if bounds and level.elo > bounds[1] and level.means is Means.SCALE:
        return SearchPlan()
    most = bounds[1] if bounds else _SAMPLED_MOST
    if level.elo > most or "MultiPV" not in offered:
        raise _unplayable(level, bounds, offered)
    return _sampled_plan(level.elo, offered["MultiPV"])


def best(findings: Findings) -> EngineChoice:
    """The move that the engine itself named."""
    return EngineChoice(findings.move, findings.lines.get(1, Thinking()))


def _policy_plan(offered: Mapping[str, chess.engine.Option]) -> SearchPlan:
    """One evaluation of the network; its policy as learned, not flattened as for a search."""
    wanted: dict[str, OptionValue] = {
        "VerboseMoveStats": True,
        "PolicyTemperature": "1.0",
        "NNCacheSize": 20_000,
    }
    if missing := [name for name in wanted if name not in offered]:
        raise EngineError(
            f"This engine cannot play Maia networks: it does not offer {', '.join(missing)}.",
            hint="Use lc0 0.30 or newer.",
        )
    return SearchPlan(wanted, nodes=1, choose=_sample_policy)


def _sampled_plan(elo: int, multipv: chess.engine.Option) -> SearchPlan:
    def choose(findings: Findings, dice: random.Random) -> EngineChoice:
        return _sample_lines(findings, dice, temperature(elo))

    return SearchPlan(lines=min(_LINES, multipv.max or 1), depth=_depth(elo), choose=choose)


def _adaptive_plan(offered: Mapping[str, chess.engine.Option], balance: Balance) -> SearchPlan:
    if "MultiPV" not in offered:
        raise EngineError(
            "This engine cannot adapt: it does not offer MultiPV, by which its moves are compared.",
            hint="Use another engine, or a level of 1 to 20.",
        )

    def choose(findings: Findings, dice: random.Random) -> EngineChoice:
        lines = [thinking for thinking in findings.lines.values() if thinking.line]
        elo = balance.weigh(max(map(_score, lines), default=0))
        sampled = best(findings) if elo >= MOST else _sample_lines(findings, dice, temperature(elo))
        return adapted(sampled, elo)

    return SearchPlan(lines=min(_LINES, offered["MultiPV"].max or 1), depth=_depth(MOST), choose=choose)


def temperature(elo: float) -> float:
    """Centipawns by which a move must be worse to be chosen e times less often.

    Fitted, with the depth, by matches of 16 games on Stockfish 17.1 at 30 ms per move: sampled at 1275 it
    scores 47 % against UCI_Elo 1320; at 900 it scores 28 % against Maia 1100.
    """
    return 250.0 * math.exp((_ELO_LEAST - elo) / 550.0)


def _depth(elo: float) -> int:
    """Half-moves of a sampled search: 3 for a beginner, 8 at most."""
    return min(8, 3 + round((elo - _ELO_LEAST) / 250.0))


def _sample_lines(findings: Findings, dice: random.Random, centipawns: float) -> EngineChoice:
    lines = [thinking for _, thinking in sorted(findings.lines.items()) if thinking.line]
    if not lines:
        return best(findings)
    scores = [_score(thinking) for thinking in lines]
    weights = [math.exp((score - max(scores)) / centipawns) for score in scores]
    chosen = dice.choices(lines, weights)[0]
    return EngineChoice(chosen.line[0], chosen)


def _sample_policy(findings: Findings, dice: random.Random) -> EngineChoice:
    most = max(findings.policy.values(), default=0.0)
    likely = {move: p for move, p in findings.policy.items() if p >= min(most, _POLICY_LEAST)}
    if most <= 0.0:
        return best(findings)
    # In a fixed order, whatever the order of the engine's lines, so that a seed gives the same game again.
    moves = sorted(likely, key=chess.Move.uci)
    weights = [likely[move] ** (1.0 / _POLICY_TEMPERATURE) for move in moves]
    move = dice.choices(moves, weights)[0]
    thinking = findings.lines.get(1, Thinking())
    return EngineChoice(move, thinking if thinking.line[:1] == (move,) else Thinking(depth=1, line=(move,)))


def _score(thinking: Thinking) -> float:
    if thinking.mate is not None:
        return math.copysign(_SCORE_MOST, thinking.mate)
    return max(-_SCORE_MOST, min(_SCORE_MOST, thinking.centipawns or 0))


def _elo_bounds(offered: Mapping[str, chess.engine.Option]) -> tuple[int, int] | None:
    if "UCI_LimitStrength" not in offered or "UCI_Elo" not in offered:
        return None
    option = offered["UCI_Elo"]
    return (option.min or 0, option.max or _ELO_MOST)


def _unplayable(
    level: Level, bounds: tuple[int, int] | None, offered: Mapping[str, chess.engine.Option]
) -> EngineError:
    least = _ELO_LEAST if "MultiPV" in offered else bounds[0] if bounds else None
    most = bounds[1] if bounds else _SAMPLED_MOST
    if least is None or least > most:
        return EngineError(
            f"This engine cannot play {level}: it offers neither UCI_Elo nor MultiPV.",
            hint="Use --level full, or another engine.",
        )
    return EngineError(
        f"This engine cannot play {level}: its range is Elo {least} to {most}.",
        hint="Choose a level in that range, or full.",
    )
