"""`kempelen bench reed` in small: a few games, each kind of fault once."""

from collections import Counter

import pytest

from kempelen.bench import reed
from kempelen.bench.reed import Fault, Game, Tally


def test_a_sloppy_persons_moves_are_all_right() -> None:
    result = reed.run(seed=5, pgn=None, data=None, games=3, progress=lambda _what, _share: None)
    figures = result.figures
    assert figures["moves"] > 60
    assert (figures["moves_right"], figures["wrong_accepts"], figures["told"]) == (100.0, 0.0, 0.0)
    assert figures["wrong_moves"] == figures["wrong_moves_told"]
    assert {row["habit"] for row in result.rows if "habit" in row} >= {"slide", "touch", "adjust", "think"}


@pytest.mark.parametrize("fault", ["stuck closed", "stuck open", "ghost"])
def test_what_is_broken_is_named(fault: Fault) -> None:
    tally = Tally()
    Game(31, fault, tally).play()
    assert tally.injected == tally.named == Counter({fault: 1})
    assert tally.counts["wrong_accepts"] == 0


def test_a_damaged_line_costs_nothing_but_lines() -> None:
    tally = Tally()
    Game(32, "damaged line", tally).play()
    assert tally.counts["lines_damaged"] > 20
    assert tally.counts["wrong_accepts"] == 0
    assert tally.counts["moves_right"] == tally.counts["moves"]
