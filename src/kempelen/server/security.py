"""What every request must pass before anything else looks at it, and what every answer carries.

* Host: an address, ``localhost`` or a name of this machine. A page on another site that has its own name lead
  here (DNS rebinding) is told from ours by that name.
* Origin: whatever a page asks for with side effects, and every WebSocket, must come from a page of ours.
  Programs that are no browsers send none, and have no cookies of somebody else either.
* JSON alone, so that no form of another site can be sent here.
* Size: by what is announced, and again by what comes.
"""

import asyncio
from contextlib import suppress
from ipaddress import ip_address
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from kempelen.server.problems import Problem, Tally, wrong

CSP = (
    "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; worker-src 'self'; object-src 'none'; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'"
)
HEADERS = {
    "Content-Security-Policy": CSP,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": (
        "camera=(), microphone=(), geolocation=(), payment=(), usb=(), serial=(), "
        "gamepad=(self), fullscreen=(self), xr-spatial-tracking=(self)"
    ),
}
SMALL = 64 * 1024
LARGE = 4 * 1024 * 1024
"""A PGN of 2 MB, as JSON."""
_WITH_PGN = frozenset({"/api/pgn", "/api/commands"})
_SAFE = frozenset({"GET", "HEAD", "OPTIONS"})
_DRAINED = 16 * 1024 * 1024
_DRAIN_S = 2.0
_Refusal = tuple[int, str, str]
"""Status, what is wrong, what to do."""


class Guard:
    """ASGI middleware.

    Args:
        app: What is guarded.
        names: Host names that lead here.
        tally: Counts what is refused.
    """

    def __init__(self, app: ASGIApp, names: frozenset[str], tally: Tally) -> None:
        self._app = app
        self._names = frozenset({"localhost", *(name.lower().rstrip(".") for name in names)})
        self._tally = tally

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        refusal = self._refusal(scope, headers)
        if refusal is not None:
            await self._refuse(scope, receive, send, refusal)
        elif scope["type"] == "websocket":
            await self._app(scope, receive, send)
        else:
            exchange = _Exchange(receive, send, scope["path"])
            await self._app(scope, exchange.receive, exchange.send)

    def _refusal(self, scope: Scope, headers: Headers) -> _Refusal | None:
        method = scope.get("method", "GET")
        if not self._is_host(headers.getlist("host")):
            return 421, "This server does not go by that name.", "Use the address that it has printed."
        if (scope["type"] == "websocket" or method not in _SAFE) and not _is_same_origin(headers):
            return 403, "This request comes from a page of another site.", "Open the server's own page."
        if method in _SAFE:
            return None
        return _body_refusal(scope["path"], headers)

    def _is_host(self, hosts: list[str]) -> bool:
        if len(hosts) != 1:
            return False
        try:
            parts = urlsplit(f"//{hosts[0]}")
            name = (parts.hostname or "").rstrip(".")
            parts.port  # noqa: B018 - raises where it is none
        except ValueError:
            return False
        if parts.username is not None or parts.path or not name:
            return False
        return name in self._names or _is_address(name)

    async def _refuse(self, scope: Scope, receive: Receive, send: Send, refusal: _Refusal) -> None:
        client, (status, error, hint) = scope.get("client"), refusal
        self._tally.refused(str(status), client[0] if client else "nowhere", f"on {scope['path'][:60]!r}")
        if scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008, "reason": error})
            return
        await _refuse(_Exchange(receive, send, scope["path"]), receive, status, wrong(error, hint))


def _limit(path: str) -> int:
    return LARGE if path in _WITH_PGN else SMALL


def _too_large(limit: int) -> _Refusal:
    return 413, f"This is too large: at most {limit // 1024} kB are taken.", "Send less."


def _body_refusal(path: str, headers: Headers) -> _Refusal | None:
    limit = _limit(path)
    length = headers.get("content-length")
    if length is not None and not (length.isascii() and length.isdigit()):
        return 400, "The length of the request is no number.", ""
    if length is not None and int(length) > limit:
        return _too_large(limit)
    has_body = length not in {None, "0"} or "transfer-encoding" in headers
    kind = headers.get("content-type", "").partition(";")[0].strip().lower()
    if has_body and kind != "application/json":
        return 415, "Only JSON is understood here.", "Send it as application/json."
    return None


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True


def _is_same_origin(headers: Headers) -> bool:
    if headers.get("sec-fetch-site", "same-origin") not in {"same-origin", "none"}:
        return False
    origins = headers.getlist("origin")
    if not origins:
        return True
    origin = urlsplit(origins[0])
    same = origin.netloc.lower() == headers["host"].lower()
    return len(origins) == 1 and origin.scheme in {"http", "https"} and same


class _Exchange:
    """A request that comes in, no more of it than is allowed, and its answer with all headers."""

    def __init__(self, receive: Receive, send: Send, path: str) -> None:
        self._receive = receive
        self._send = send
        self._path = path
        self._limit = _limit(path)
        self._came = 0

    async def receive(self) -> Message:
        """Raises: HTTPException: more came than is allowed."""
        message = await self._receive()
        self._came += len(message.get("body", b""))
        if self._came > self._limit:
            raise HTTPException(413, _too_large(self._limit)[1])
        return message

    async def send(self, message: Message) -> None:
        """The answer; one to too large a request ends only when that was dropped."""
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers.update(HEADERS)
            if self._path.startswith("/api"):
                headers.setdefault("Cache-Control", "no-store")
        elif self._came > self._limit and not message.get("more_body", False):
            await self._send({**message, "more_body": True})
            await _drain(self._receive)
            message = {"type": "http.response.body", "body": b""}
        await self._send(message)


async def _refuse(exchange: _Exchange, receive: Receive, status: int, why: Problem) -> None:
    """Answer at once; then take, and drop, what is still being sent, for a moment.

    A connection that is closed with unread data in it is reset, and the answer lost with it.
    """
    body = why.model_dump_json().encode()
    headers = {"content-type": "application/json", "content-length": str(len(body)), "connection": "close"}
    raw = [(name.encode(), value.encode()) for name, value in headers.items()]
    await exchange.send({"type": "http.response.start", "status": status, "headers": raw})
    await exchange.send({"type": "http.response.body", "body": body, "more_body": True})
    await _drain(receive)
    await exchange.send({"type": "http.response.body", "body": b""})


async def _drain(receive: Receive) -> None:
    """What is still being sent, for two seconds at most."""
    dropped = 0
    with suppress(TimeoutError):
        async with asyncio.timeout(_DRAIN_S):
            while dropped < _DRAINED:
                message = await receive()
                dropped += len(message.get("body", b""))
                if not message.get("more_body", False):
                    return
