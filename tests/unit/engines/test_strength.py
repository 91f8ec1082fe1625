import collections
import random

import chess
import pytest
from chess.engine import Option
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.errors import ConfigError, EngineError
from kempelen.core.protocols import Thinking
from kempelen.engines.strength import (
    FULL,
    Level,
    Means,
    SearchPlan,
    nearest_maia,
    parse_level,
    plan_for,
    temperature,
)
from kempelen.engines.wire import Findings

STOCKFISH = {
    "UCI_LimitStrength": Option("UCI_LimitStrength", "check", False, None, None, []),
    "UCI_Elo": Option("UCI_Elo", "spin", 1320, 1320, 3190, []),
    "MultiPV": Option("MultiPV", "spin", 1, 1, 256, []),
}
LC0 = {name: Option(name, "string", "", None, None, []) for name in ("VerboseMoveStats", "PolicyTemperature")}
LC0["NNCacheSize"] = Option("NNCacheSize", "spin", 2_000_000, 0, 999_999_999, [])
E4, D4, A3 = (chess.Move.from_uci(name) for name in ("e2e4", "d2d4", "a2a3"))


@pytest.mark.parametrize(
    ("text", "level"),
    [
        ("1", Level(Means.SCALE, 1)),
        ("19", Level(Means.SCALE, 19)),
        ("20", FULL),
        (" Full ", FULL),
        ("max", FULL),
        ("1500", Level(Means.ELO, 1500)),
        ("elo 1500", Level(Means.ELO, 1500)),
        ("maia-1500", Level(Means.MAIA, 1500)),
        ("adaptive", Level(Means.ADAPTIVE)),
        ("Maia1100", Level(Means.MAIA, 1100)),
    ],
)
def test_levels_are_read(text: str, level: Level) -> None:
    assert parse_level(text) == level


@pytest.mark.parametrize(
    "text", ["", "0", "21", "399", "4001", "-3", "hard", "maia", "elo 5", "1500.5", "99999"]
)
def test_other_levels_are_refused_with_the_range(text: str) -> None:
    with pytest.raises(ConfigError, match="unknown") as caught:
        parse_level(text)
    assert "1 (beginner) to 20, an Elo 400 to 4000, maia-1500, or full" in caught.value.hint


def test_levels_are_told_in_words() -> None:
    assert [str(parse_level(text)) for text in ("full", "9", "1500", "maia-1100")] == [
        "full strength",
        "level 9, about Elo 1400",
        "Elo 1500",
        "like people of Elo 1100",
    ]


def test_the_scale_rises() -> None:
    elos = [Level(Means.SCALE, number).elo for number in range(1, 20)]
    assert elos == sorted(set(elos))
    assert elos[0] == 400


@pytest.mark.parametrize(
    ("level", "network"),
    [
        (Level(Means.ELO, 1500), 1500),
        (Level(Means.ELO, 1000), 1100),
        (Level(Means.ELO, 999), None),
        (Level(Means.ELO, 2000), 1900),
        (Level(Means.ELO, 2001), None),
        (Level(Means.SCALE, 10), 1500),
        (Level(Means.SCALE, 1), None),
        (FULL, None),
        (Level(Means.MAIA, 1500), None),
    ],
)
def test_the_network_that_stands_for_a_level(level: Level, network: int | None) -> None:
    assert nearest_maia(level, (1100, 1300, 1500, 1700, 1900)) == network
    assert nearest_maia(level, ()) is None


def test_full_strength_changes_nothing() -> None:
    plan = plan_for(FULL, {})
    assert (dict(plan.options), plan.lines, plan.limit(2.0).time, plan.limit(2.0).nodes) == ({}, 1, 2.0, None)


@pytest.mark.parametrize("elo", [1320, 2000, 3190])
def test_within_its_bounds_the_engine_handicaps_itself(elo: int) -> None:
    plan = plan_for(Level(Means.ELO, elo), STOCKFISH)
    assert plan.options == {"UCI_LimitStrength": True, "UCI_Elo": elo}
    assert plan.lines == 1


def test_beyond_its_bounds_an_elo_is_refused_and_a_level_is_all_it_can() -> None:
    with pytest.raises(EngineError, match="range is Elo 400 to 3190"):
        plan_for(Level(Means.ELO, 3500), STOCKFISH)
    weak = STOCKFISH | {"UCI_Elo": Option("UCI_Elo", "spin", 800, 800, 1500, [])}
    assert dict(plan_for(Level(Means.SCALE, 19), weak).options) == {}
    with pytest.raises(EngineError, match="range is Elo 1320 to 3190"):
        plan_for(Level(Means.ELO, 1000), {name: o for name, o in STOCKFISH.items() if name != "MultiPV"})


def test_without_a_handicap_of_its_own_lines_are_sampled() -> None:
    offered = {"MultiPV": STOCKFISH["MultiPV"]}
    assert plan_for(Level(Means.ELO, 1900), offered).lines == 64
    with pytest.raises(EngineError, match="range is Elo 400 to 2000"):
        plan_for(Level(Means.ELO, 2100), offered)
    with pytest.raises(EngineError, match="neither UCI_Elo nor MultiPV"):
        plan_for(Level(Means.SCALE, 5), {})


def lines(*scores: tuple[chess.Move, int | None, int | None]) -> Findings:
    thoughts = [Thinking(depth=2, centipawns=cp, mate=mate, line=(move,)) for move, cp, mate in scores]
    return Findings(scores[0][0], dict(enumerate(thoughts, start=1)))


def frequencies(plan: SearchPlan, findings: Findings, n: int = 4000) -> dict[chess.Move, float]:
    dice = random.Random(1)
    counts = collections.Counter(plan.choose(findings, dice).move for _ in range(n))
    return {move: count / n for move, count in counts.items()}


def test_a_beginner_errs_by_the_softmax() -> None:
    plan = plan_for(Level(Means.SCALE, 1), STOCKFISH)
    assert (plan.lines, plan.depth) == (64, 3)
    share = frequencies(plan, lines((E4, 0, None), (D4, -250, None)))
    assert share[E4] == pytest.approx(1 / (1 + 0.36788), abs=0.02)


def test_the_stronger_the_less_it_errs() -> None:
    findings = lines((E4, 50, None), (D4, -50, None))
    shares = [
        frequencies(plan_for(Level(Means.ELO, elo), STOCKFISH), findings)[E4] for elo in (400, 800, 1300)
    ]
    assert shares == sorted(shares)
    assert shares[0] < 0.65
    assert shares[2] > 0.8


@pytest.mark.parametrize(("mate", "liked"), [(2, True), (-2, False)])
def test_mates_count_as_won_or_lost(mate: int, liked: bool) -> None:
    findings = lines((E4, None, mate), (D4, 0, None))
    share = frequencies(plan_for(Level(Means.ELO, 1000), STOCKFISH), findings)
    assert (share.get(E4, 0.0) > 0.95) is liked


def test_the_thought_told_belongs_to_the_move() -> None:
    findings = lines((E4, 0, None), (D4, -1, None))
    choice = plan_for(Level(Means.SCALE, 1), STOCKFISH).choose(findings, random.Random(3))
    assert choice.thinking.line == (choice.move,)


def test_without_lines_the_engine_s_own_move_is_played() -> None:
    findings = Findings(A3, {1: Thinking(depth=1, centipawns=3)})
    assert plan_for(Level(Means.SCALE, 1), STOCKFISH).choose(findings, random.Random(0)).move == A3
    assert plan_for(Level(Means.MAIA, 1500), LC0).choose(findings, random.Random(0)).move == A3


def test_maia_plays_its_policy_without_the_noise() -> None:
    plan = plan_for(Level(Means.MAIA, 1500), LC0)
    assert plan.nodes == 1
    assert plan.options["PolicyTemperature"] == "1.0"
    findings = lines((E4, 30, None))
    findings.policy = {E4: 0.6, D4: 0.39, A3: 0.01}
    share = frequencies(plan, findings)
    assert A3 not in share
    assert share[E4] == pytest.approx(0.6**1.25 / (0.6**1.25 + 0.39**1.25), abs=0.02)
    told = {plan.choose(findings, random.Random(seed)).thinking.line for seed in range(20)}
    assert told == {(E4,), (D4,)}


def test_a_policy_without_a_likely_move_is_still_played() -> None:
    findings = lines((E4, 30, None))
    findings.policy = {E4: 0.015, D4: 0.012}
    assert frequencies(plan_for(Level(Means.MAIA, 1500), LC0), findings).keys() == {E4}


def test_an_engine_that_is_not_lc0_cannot_play_maia() -> None:
    with pytest.raises(EngineError, match="does not offer VerboseMoveStats"):
        plan_for(Level(Means.MAIA, 1500), STOCKFISH)


@given(st.integers(400, 2000), st.integers(1, 400))
def test_the_temperature_falls_with_the_elo(elo: int, more: int) -> None:
    assert temperature(elo + more) < temperature(elo) <= 250.0
