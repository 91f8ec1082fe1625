"""A chess clock as it is typed."""

import pytest

from kempelen.cli.start import time_control
from kempelen.core.errors import ConfigError
from kempelen.game.clock import TimeControl


@pytest.mark.parametrize(
    ("text", "control"),
    [
        ("5+3", TimeControl(300, 3)),
        ("5", TimeControl(300)),
        ("0.5+0", TimeControl(30)),
        (" 90 + 30 ", TimeControl(5400, 30)),
        ("5+", TimeControl(300)),
    ],
)
def test_minutes_and_seconds_a_move(text: str, control: TimeControl) -> None:
    assert time_control(text) == control


def test_no_clock() -> None:
    assert time_control(None) is None


@pytest.mark.parametrize("text", ["", "five", "5+x", "+3", "0+3", "-5", "5+-3", "nan", "1e9"])
def test_what_is_none(text: str) -> None:
    with pytest.raises(ConfigError) as refused:
        time_control(text)
    assert refused.value.hint
