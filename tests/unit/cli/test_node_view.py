"""The table of a hall in a terminal of 80 columns: names whole, states in words."""

import io

from rich.console import Console

from kempelen.cli.node_view import hall_table
from kempelen.nodes.status import Seen, Status


def drawn(tables: dict[str, Seen], now: float = 10.0, width: int = 80) -> list[str]:
    console = Console(file=io.StringIO(), width=width)
    console.print(hall_table(tables, now))
    out = console.file
    assert isinstance(out, io.StringIO)
    return out.getvalue().splitlines()


def seen(*, here: bool = True, heard: float = 9.0, **status: object) -> Seen:
    made = Status.model_validate({"table": "t", "game": 1, **status})
    return Seen(status=made, here=here, heard=heard)


def state_of(table: Seen) -> str:
    (row,) = [line for line in drawn({"hall-3": table}) if "hall-3" in line]
    return row[8:20].strip()


def test_names_and_moves_are_whole_on_80_columns() -> None:
    lines = drawn(
        {
            "light-001": seen(
                white="Anna", black="Stockfish 15.1 (level 3)", ply=24, last="O-O-O+", robot="moving"
            ),
            "light-002": seen(white="B", black="C", ply=1, last="e4", doing="carrying the knight to f3"),
        }
    )
    assert all(len(line) <= 80 for line in lines)
    assert any("light-001" in line and "12... O-O-O+" in line and "moving" in line for line in lines)
    assert any("light-002" in line and "1. e4" in line and "carrying the knight" in line for line in lines)


def test_the_worst_is_told_first() -> None:
    assert state_of(seen(robot="idle")) == "idle"
    assert state_of(seen(game=0)) == "free"
    assert state_of(seen(result="1-0", robot="idle")) == "1-0"
    assert state_of(seen(paused=True, result="1-0")) == "paused"
    assert state_of(seen(trouble="Bring a queen.", paused=True)) == "needs help"
    assert state_of(seen(heard=1.0, trouble="Bring a queen.")) == "silent 9 s"
    assert state_of(seen(here=False, trouble="Bring a queen.")) == "gone"
    assert state_of(Seen(here=True)) == "silent"


def test_the_title_counts() -> None:
    assert "No table is seen yet." in drawn({})[0]
    title = drawn({"a": seen(trouble="Help."), "b": seen(here=False)})[0]
    assert "1 of 2 tables on the network, 1 in trouble" in title


def test_what_is_wrong_takes_the_place_of_what_goes_on() -> None:
    text = "\n".join(drawn({"a": seen(trouble="Bring a queen.", doing="thinking")}))
    assert "Bring a queen." in text
    assert "thinking" not in text
