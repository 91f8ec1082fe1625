"""The doctor's findings."""

from dataclasses import dataclass
from enum import StrEnum

from kempelen.core.errors import KempelenError


class Status(StrEnum):
    """How bad it is."""

    OK = "ok"
    WARN = "warn"  # a game can be played, something is missing or slow
    FAIL = "fail"  # no game until it is mended


@dataclass(frozen=True, slots=True)
class Check:
    """One row.

    Attributes:
        name: What was looked at.
        found: In words, with the number.
        todo: What to do; empty when all is well.
    """

    name: str
    status: Status
    found: str
    todo: str = ""


def ok(name: str, found: str) -> Check:
    """All is well."""
    return Check(name, Status.OK, found)


def warn(name: str, found: str, todo: str) -> Check:
    """A game can be played all the same."""
    return Check(name, Status.WARN, found, todo)


def fail(name: str, found: str, todo: str) -> Check:
    """No game until it is mended."""
    return Check(name, Status.FAIL, found, todo)


def failed(name: str, error: KempelenError) -> Check:
    """An error that explains itself."""
    return fail(name, error.message, error.hint)
