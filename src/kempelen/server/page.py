"""The built page: its files, and its first page for every address that is the page's own."""

from pathlib import Path

from fastapi import APIRouter, Request
from starlette.responses import FileResponse, HTMLResponse, RedirectResponse, Response

from kempelen.server.house import House, address, house_of
from kempelen.server.problems import problem
from kempelen.server.routes_session import set_cookie

router = APIRouter(include_in_schema=False)

_FOREVER = "public, max-age=31536000, immutable"
_CHECK = "no-cache"
_MISSING = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Kempelen</title></head>
<body><h1>Kempelen is running</h1>
<p>Its web page was not built. Build it with <code>make page</code>, then start again.</p>
<p>Everything else works: <code>kempelen remote status</code>.</p></body></html>
"""


@router.get("/{path:path}")
def page(request: Request, path: str) -> Response:
    """A file of the page, or the page itself; a one-time token in the address becomes a session first."""
    house = house_of(request)
    if (token := request.query_params.get("token")) is not None:
        return _let_in(request, house, token)
    if path == "api" or path.startswith("api/"):
        return problem(404, "There is nothing at this address.", "GET /api/openapi.json tells what there is.")
    found = _file(house.settings.page, path)
    if found is None and path.startswith("assets/"):  # of a page that was open before an update
        return problem(404, "This part of the page is not there any more.", "Load the page anew.")
    return found or _first(house.settings.page)


def _let_in(request: Request, house: House, token: str) -> Response:
    """The token leaves the address: nobody finds it in a history or over a shoulder."""
    session = None
    if house.entries.take(address(request)):
        session = house.sessions.redeem(token)
    target = request.url.path if request.url.path.startswith("/") else "/"
    target = "/" + target.lstrip("/\\")  # never another site
    if session is None:
        house.tally.refused("link", address(request))
        return RedirectResponse(f"{target}?link=used", 303, headers={"Cache-Control": "no-store"})
    response = RedirectResponse(target, 303, headers={"Cache-Control": "no-store"})
    set_cookie(response, session, house)
    return response


def _file(directory: Path, path: str) -> Response | None:
    """A file of the built page; None for all that is none, hidden ones and what lies outside of it."""
    parts = path.split("/")
    if not path or "\0" in path or any(part in {"", ".", ".."} or part.startswith(".") for part in parts):
        return None
    file = directory.joinpath(*parts)
    try:
        if not file.resolve().is_relative_to(directory.resolve()) or not file.is_file():
            return None
    except OSError:  # a name that is too long
        return None
    lasting = parts[0] == "assets"
    return FileResponse(file, headers={"Cache-Control": _FOREVER if lasting else _CHECK})


def _first(directory: Path) -> Response:
    index = directory / "index.html"
    if not index.is_file():
        return HTMLResponse(_MISSING, 503)
    return FileResponse(index, headers={"Cache-Control": _CHECK})
