"""What is said to people, for pages in other languages: `kempelen.core.words` as a model."""

from pydantic import Field

from kempelen.app.discreet import without_paths
from kempelen.core.words import Datum, parts_of
from kempelen.server.model import Model


class Said(Model):
    """A sentence, or a piece of one.

    Attributes:
        code: What is meant, a key of the page's catalogues ``said``; empty of mere English.
        text: In English.
        data: What fills the holes: pieces are letters as in FEN (their names begin with ``piece``), moves
            are in SAN (theirs begin with ``move``), alternatives are lists.
    """

    code: str
    text: str
    data: dict[str, str | int | float | tuple[str, ...]] = Field(default_factory=dict)


def said(text: str) -> tuple[Said, ...]:
    """What was meant by a text, without paths; nothing of one that is nothing but English."""
    return tuple(
        Said(code=part.code, text=without_paths(part.text), data={k: _clean(v) for k, v in part.data.items()})
        for part in parts_of(text)
    )


def _clean(value: Datum) -> Datum:
    return without_paths(value) if isinstance(value, str) else value
