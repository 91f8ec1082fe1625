"""Time scales as people write them; where things are kept."""

from pathlib import Path

import pytest

from kempelen.app.config import load_config
from kempelen.app.paths import journal_path, pgn_path, twin_state_path
from kempelen.app.speed import parse_speed
from kempelen.app.table_session import twin_speed
from kempelen.core.errors import ConfigError


@pytest.mark.parametrize(
    ("text", "scale"), [("1", 1.0), ("2.5", 2.5), ("max", 0.0), (" MAX ", 0.0), ("1000", 1000.0)]
)
def test_time_scales(text: str, scale: float) -> None:
    assert parse_speed(text) == scale


@pytest.mark.parametrize("text", ["", "0", "-1", "1001", "fast", "nan", "inf"])
def test_what_is_no_time_scale(text: str) -> None:
    with pytest.raises(ConfigError, match="is no time scale"):
        parse_speed(text)


@pytest.mark.parametrize(("speed", "scale"), [(4, 4.0), ("max", 0.0)])
def test_the_configured_scale(speed: float | str, scale: float) -> None:
    assert twin_speed(load_config(None, {"twin.speed": speed})) == scale


def test_where_things_are_kept(tmp_path: Path) -> None:
    places = [journal_path(tmp_path), pgn_path(tmp_path, 3), twin_state_path(tmp_path, 3)]
    assert [str(place.relative_to(tmp_path)) for place in places] == [
        "journal.sqlite3", "games/game-3.pgn", "twin/game-3.json",
    ]  # fmt: skip
