"""What goes wrong, as answers: a sentence and a next step, never a path, a secret or a trace."""

import logging
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import ValidationError
from starlette.exceptions import HTTPException

from kempelen.app.discreet import without_paths
from kempelen.core.errors import KempelenError
from kempelen.core.words import say
from kempelen.server.model import Model
from kempelen.server.said import Said, said

_log = logging.getLogger(__name__)
_SHOWN = 3
_LOGGED_EVERY_S = 10.0
FAULT = say("server_fault", "The server made a mistake; its log says which.")


class Problem(Model):
    """Why a request was not answered.

    Attributes:
        error: What is wrong.
        hint: What to do next.
        kind: Of the error: ``game``, ``config``, ``link`` …, as `kempelen.core.errors` tells them apart.
        error_said: For other languages; empty where there is nothing but English.
        hint_said: Likewise.
    """

    error: str
    hint: str = ""
    kind: str = ""
    error_said: tuple[Said, ...] = ()
    hint_said: tuple[Said, ...] = ()


class Tally:
    """Counts what is refused, by reason; logs each reason at most every ten seconds."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._logged: dict[str, float] = {}

    def refused(self, reason: str, who: str, detail: str = "") -> None:
        """One more."""
        self.counts[reason] += 1
        now = time.monotonic()
        if now - self._logged.get(reason, -_LOGGED_EVERY_S) >= _LOGGED_EVERY_S:
            self._logged[reason] = now
            _log.warning("Refused (%s, %d so far) from %s %s", reason, self.counts[reason], who, detail)


def problem(
    status: int, error: str, hint: str = "", headers: Mapping[str, str] | None = None
) -> JSONResponse:
    """An answer that says why not."""
    return JSONResponse(wrong(error, hint).model_dump(mode="json"), status, headers)


def wrong(error: str, hint: str = "", kind: str = "") -> Problem:
    """What a person needs of it, and no path."""
    return Problem(
        error=without_paths(error),
        hint=without_paths(hint),
        kind=kind,
        error_said=said(error),
        hint_said=said(hint),
    )


def told(error: KempelenError) -> Problem:
    """What a person needs of an error, and no path."""
    return wrong(error.message, error.hint, kind_of(error))


def kind_of(error: KempelenError) -> str:
    """``game`` of a `GameError`."""
    return type(error).__name__.removesuffix("Error").lower()


def what_is_wrong(errors: Sequence[Mapping[str, Any]]) -> str:
    """Where and what, of pydantic's findings, without what was sent."""
    found = [f"{_place(error['loc'])}{error['msg']}" for error in errors[:_SHOWN]]
    more = f"; and {len(errors) - _SHOWN} more" if len(errors) > _SHOWN else ""
    return "; ".join(found) + more


def findings(error: ValidationError) -> str:
    """As `what_is_wrong`."""
    return what_is_wrong(error.errors(include_url=False, include_context=False, include_input=False))


def _place(location: Sequence[object]) -> str:
    words = [str(word)[:40] for word in location if word != "body"]
    return f"{'.'.join(words)}: " if words else ""


def explain(app: FastAPI) -> None:
    """Make answers of what the application's routes raise."""

    @app.exception_handler(KempelenError)
    async def refused(_request: Request, error: KempelenError) -> JSONResponse:
        return JSONResponse(told(error).model_dump(mode="json"), 409)

    @app.exception_handler(RequestValidationError)
    async def invalid(_request: Request, error: RequestValidationError) -> JSONResponse:
        return problem(422, f"The request cannot be understood: {what_is_wrong(error.errors())}.")

    @app.exception_handler(HTTPException)
    async def http(_request: Request, error: HTTPException) -> JSONResponse:
        return problem(error.status_code, error.detail, headers=error.headers)

    @app.exception_handler(Exception)
    async def fault(_request: Request, _error: Exception) -> JSONResponse:
        return problem(500, FAULT)
