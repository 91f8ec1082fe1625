"""The adaptive level: stronger when behind, weaker when ahead, and open about it."""

import random
from pathlib import Path

import chess
import pytest
from chess.engine import Option
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.errors import EngineError
from kempelen.core.protocols import Thinking
from kempelen.engines.adaptive import LEAST, MOST, START, Balance
from kempelen.engines.find import EngineProgram, Source
from kempelen.engines.program import Habits, ProgramEngine
from kempelen.engines.strength import Level, Means, parse_level, plan_for
from kempelen.engines.wire import Findings
from kempelen.testing.uci_engines import write_engine

OFFERED = {"MultiPV": Option("MultiPV", "spin", 1, 1, 256, [])}
E4, A3 = chess.Move.from_uci("e2e4"), chess.Move.from_uci("a2a3")


def test_even_chances_leave_it_as_it_is() -> None:
    balance = Balance()
    assert [balance.weigh(0.0) for _ in range(5)] == [START] * 5


def test_ahead_it_becomes_weaker_and_behind_stronger() -> None:
    ahead, behind = Balance(), Balance()
    weaker = [ahead.weigh(250.0) for _ in range(20)]
    stronger = [behind.weigh(-250.0) for _ in range(20)]
    assert weaker == sorted(weaker, reverse=True)
    assert stronger == sorted(stronger)
    assert weaker[0] < START < stronger[0]
    assert (weaker[-1], stronger[-1]) == (LEAST, MOST)


@given(st.lists(st.floats(-1e6, 1e6), max_size=60))
def test_it_stays_in_its_range(scores: list[float]) -> None:
    balance = Balance()
    assert all(LEAST <= balance.weigh(score) <= MOST for score in scores)


def test_the_score_of_the_moment_is_forgotten_what_was_learned_is_not() -> None:
    balance = Balance()
    for _ in range(10):
        balance.weigh(400.0)
    assert balance.weigh(0.0) == round(balance.estimate) < START


def findings(score: int) -> Findings:
    lines = {
        1: Thinking(depth=5, centipawns=score, line=(E4,)),
        2: Thinking(depth=5, centipawns=score - 200, line=(A3,)),
    }
    return Findings(E4, lines)


def test_it_errs_when_ahead_and_not_when_lost() -> None:
    def share(score: int) -> float:
        plan = plan_for(Level(Means.ADAPTIVE), OFFERED, Balance())
        dice = random.Random(1)
        return sum(plan.choose(findings(score), dice).move == A3 for _ in range(200)) / 200

    assert share(-600) == 0.0
    assert share(600) > 0.2


def test_it_says_at_which_elo_it_has_chosen() -> None:
    plan = plan_for(parse_level("adaptive"), OFFERED)
    choice = plan.choose(findings(0), random.Random(1))
    assert choice.thinking.adapted == START
    assert str(parse_level("Adaptive")) == "adapts to the other side"


def test_without_several_lines_there_is_nothing_to_choose_from() -> None:
    with pytest.raises(EngineError, match="cannot adapt"):
        plan_for(Level(Means.ADAPTIVE), {})


async def test_what_it_has_learned_survives_a_restart_and_is_told(tmp_path: Path) -> None:
    path = write_engine(
        tmp_path, "--multipv", "--on-go", "die", "--nth", "2", "--once", str(tmp_path / "done")
    )
    program = EngineProgram("fake", (str(path),), Source.NAMED)
    thoughts: list[Thinking] = []
    board = chess.Board()
    async with ProgramEngine(program, Level(Means.ADAPTIVE), Habits(seconds=0.05, seed=1)) as engine:
        assert engine.name == "Fake 1.0 (adapts to the other side)"
        for _ in range(3):  # the fake thinks that it is half a pawn ahead, always
            board.push((await engine.choose(board, on_thinking=thoughts.append)).move)
    elos = [thought.adapted for thought in thoughts if thought.adapted is not None]
    assert len(elos) == 3
    assert elos == sorted(elos, reverse=True)
    assert elos[0] < START
