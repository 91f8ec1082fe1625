"""Whatever the program can say has words in every language of the page, with the values it comes with."""

import ast
import json
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import kempelen
from kempelen.core import errors
from kempelen.core.words import joined, parts_of, say
from kempelen.robots.grbl.explain import ALARMS, alarm_words
from kempelen.server.problems import kind_of, told
from kempelen.server.said import said

SOURCE = Path(kempelen.__file__).parent
CATALOGUES = sorted((Path(__file__).parents[3] / "web" / "src" / "i18n").glob("*/said.json"))
LANGUAGES = ["ar", "cs", "de", "en"]
HOLES = re.compile(r"\{(\w+)\}")
OF_ALARMS = {f"alarm_{number}" for number in (*ALARMS, "unknown")}
SAYING = {"say": set[str](), "_about": {"piece", "square"}}
"""Functions that take a code first, and what they add to it."""


@cache
def sayings() -> tuple[tuple[str, set[str], str], ...]:
    """Each code that is written anywhere, the names of its values, and where."""
    return tuple(_sayings())


def _sayings() -> Iterator[tuple[str, set[str], str]]:
    for path in sorted(SOURCE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            name = node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""
            if isinstance(node, ast.Call) and name in SAYING and isinstance(node.args[0], ast.Constant):
                values = {word.arg for word in node.keywords if word.arg}
                yield str(node.args[0].value), values | SAYING[name], f"{path.name}:{node.lineno}"


def kinds(error: type[errors.KempelenError] = errors.KempelenError) -> Iterator[str]:
    yield f"kind_{kind_of(error(''))}"
    for one in error.__subclasses__():
        if one.__module__ == errors.__name__:
            yield from kinds(one)


def words(catalogue: Path) -> dict[str, str]:
    found: dict[str, str] = json.loads(catalogue.read_text(encoding="utf-8"))
    return found


def test_the_languages_are_there() -> None:
    assert [path.parent.name for path in CATALOGUES] == LANGUAGES


@pytest.mark.parametrize("catalogue", CATALOGUES, ids=LANGUAGES)
def test_every_code_has_words_whose_holes_it_can_fill(catalogue: Path) -> None:
    has = words(catalogue)
    wanting = [
        (code, where, has.get(code))
        for code, values, where in sayings()
        if code not in has or not set(HOLES.findall(has[code])) <= values
    ]
    assert wanting == []
    assert (OF_ALARMS | set(kinds())) - has.keys() == set()


def test_no_words_are_left_over() -> None:
    spoken = {code for code, _, _ in sayings()} | OF_ALARMS | set(kinds())
    unused = words(CATALOGUES[0]).keys() - spoken
    assert {code for code in unused if not code.startswith("some_")} == set()


def test_texts_are_joined_and_keep_what_was_meant() -> None:
    text = joined(say("home_it", "Home it."), "", "Motor 3 is hot.")
    assert text == "Home it. Motor 3 is hot."
    assert [(part.code, part.text) for part in parts_of(text)] == [
        ("home_it", "Home it."),
        ("", "Motor 3 is hot."),
    ]
    assert parts_of("plain") == ()


def test_alarms_say_which() -> None:
    assert parts_of(alarm_words(6))[0].code == "alarm_6"
    assert parts_of(alarm_words(77))[0].code == "alarm_unknown"


def test_a_refusal_has_both_and_no_path() -> None:
    error = errors.GameError(
        say("off_table", "/home/anna/x is off", x=1, y=2), hint=say("stay_on_it", "Stay.")
    )
    why = told(error)
    assert (why.kind, why.error) == ("game", "x is off")
    assert why.error_said[0].data == {"x": 1, "y": 2}
    assert why.error_said[0].text == "x is off"
    assert why.hint_said[0].code == "stay_on_it"
    assert said("plain") == ()
