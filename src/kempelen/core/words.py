"""English that can be said in other languages: what was meant goes with the text, as a code and values.

`Words` is a `str`, so that whatever shows, logs or keeps text needs not know of it; whoever speaks another
language looks at `parts_of`. The codes are the keys of the page's catalogues ``said.json``; a test goes
through all calls of `say` and finds those that have no words there.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Self

import chess

Value = str | int | float | chess.Piece | Sequence[str]
Datum = str | int | float | tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Part:
    """A sentence, or a piece of one.

    Attributes:
        code: What is meant; empty where there is nothing but English.
        text: In English.
        data: What fills the holes: pieces are letters as in FEN (their names begin with ``piece``), moves are
            in SAN (theirs begin with ``move``), alternatives are tuples.
    """

    code: str
    text: str
    data: dict[str, Datum] = field(default_factory=dict)


class Words(str):
    """English text with what was meant by it.

    Args:
        text: In English.
        parts: The same, piece by piece.
    """

    __slots__ = ("parts",)
    parts: tuple[Part, ...]

    def __new__(cls, text: str, parts: tuple[Part, ...]) -> Self:
        """A string."""
        made = super().__new__(cls, text)
        made.parts = parts
        return made


def say(code: str, text: str, /, **data: Value) -> Words:
    """What is meant, in English and for other languages.

    Args:
        code: Key of the catalogue.
        text: In English, complete.
        data: What fills the holes of other languages' sentences.
    """
    return Words(text, (Part(code, text, {name: _datum(value) for name, value in data.items()}),))


def joined(*texts: str) -> Words:
    """One after another; the empty ones are left out."""
    shown = [text for text in texts if text]
    parts = [parts_of(text) or (Part("", text),) for text in shown]
    return Words(" ".join(shown), tuple(chain.from_iterable(parts)))


def parts_of(text: str) -> tuple[Part, ...]:
    """What was meant; nothing of a plain string."""
    return text.parts if isinstance(text, Words) else ()


def _datum(value: Value) -> Datum:
    if isinstance(value, chess.Piece):
        return value.symbol()
    if isinstance(value, Words):
        return str(value)
    return value if isinstance(value, str | int | float) else tuple(value)
