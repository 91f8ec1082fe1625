"""The WebSocket: a snapshot, then what changed; commands and their answers."""

import asyncio
import contextlib
import itertools
from collections.abc import Coroutine
from typing import Any

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from pydantic import TypeAdapter, ValidationError

from kempelen.server.commands import AnyCommand, EStop, Jog, JogStop
from kempelen.server.house import House, house_of
from kempelen.server.hub import Client
from kempelen.server.messages import Ask, Follow, Refused, Replied, Up
from kempelen.server.problems import findings
from kempelen.server.security import LARGE, SMALL
from kempelen.server.sessions import Visitor, allows

ABORT = "kempelen.abort"
"""Extension of the ASGI scope: closes the connection without waiting for what was not taken."""
_MOST_SOCKETS = 1000
_POLICY = 1008
_BUSY = 1013
_UP: TypeAdapter[Follow | Ask] = TypeAdapter(Up)
_numbers = itertools.count(1)

router = APIRouter()


@router.websocket("/api/ws")
async def live(websocket: WebSocket) -> None:
    """One page, as long as it is there."""
    house = house_of(websocket)
    if house.hub.clients >= _MOST_SOCKETS:
        await websocket.close(_BUSY, "Too many pages are open.")
        return
    await websocket.accept()
    await _Socket(house, websocket, house.visitor(websocket)).serve()


class _Socket:
    """A page's socket.

    Args:
        house: The server.
        websocket: Accepted.
        visitor: Who it is; stays so as long as the socket is open.
    """

    def __init__(self, house: House, websocket: WebSocket, visitor: Visitor) -> None:
        self._house = house
        self._websocket = websocket
        self._visitor = visitor
        self._name = f"socket {next(_numbers)}"
        self._tasks: set[asyncio.Task[None]] = set()
        self._client: Client

    async def serve(self) -> None:
        """Until it is closed, takes nothing any more, or sends too much that cannot be understood."""
        hub = self._house.hub
        self._client = hub.join(self._visitor.role)
        sending, hearing = asyncio.ensure_future(self._send()), asyncio.ensure_future(self._hear())
        try:
            await asyncio.wait({sending, hearing}, return_when=asyncio.FIRST_COMPLETED)
        finally:  # nothing is waited for here: this may be cancelled more than once
            hub.leave(self._client)
            self._house.dispatcher.gone(self._name)
            for task in (sending, hearing, *self._tasks):
                task.cancel()
        await asyncio.wait((sending, hearing, *self._tasks))
        await self._close(hearing)

    async def _close(self, hearing: asyncio.Task[int | None]) -> None:
        """Politely where it still listens; and for certain."""
        code = None if hearing.cancelled() or hearing.exception() else hearing.result()
        if code is not None:
            with contextlib.suppress(RuntimeError, WebSocketDisconnect, TimeoutError):
                async with asyncio.timeout(1.0):
                    await self._websocket.close(code, "Too much that cannot be understood.")
                return
        if (abort := self._websocket.scope.get("extensions", {}).get(ABORT)) is not None:
            abort()

    # --- down -----------------------------------------------------------------------------------------------

    async def _send(self) -> None:
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while True:
                message = await self._client.next()
                try:
                    async with asyncio.timeout(self._house.settings.send_s):
                        await self._websocket.send_text(message)
                except TimeoutError:
                    self._house.tally.refused("takes nothing", self._visitor.role, self._name)
                    return

    # --- up -------------------------------------------------------------------------------------------------

    async def _hear(self) -> int | None:
        """Returns the code to close with, None where the other side has gone."""
        while True:
            message = await self._websocket.receive()
            if message["type"] == "websocket.disconnect":
                return None
            text = message.get("text")
            if (refused := self._take(text)) is not None:
                self._client.post(refused.model_dump_json())
                if not self._house.garbage.take(self._name):
                    return _POLICY

    def _take(self, text: str | None) -> Refused | None:
        """Do what a message says, or say why not."""
        if text is None:
            return self._refuse("bytes", "Messages are JSON in text frames.")
        if len(text) > (LARGE if allows(self._visitor.role, "operator") else SMALL):
            return self._refuse("size", "The message is too large.")
        try:
            message = _UP.validate_json(text)
        except ValidationError as error:
            return self._refuse("message", f"The message cannot be understood: {findings(error)}.")
        urgent = isinstance(message, Ask) and isinstance(message.command, EStop | Jog | JogStop)
        if not urgent and not self._house.messages.take(self._name):
            return self._refuse("rate", "Too many messages.", "Wait a second.")
        if isinstance(message, Follow):
            self._client.follow(message.topics, wire=message.wire)
        else:
            self._start(self._obey(message.command))
        return None

    def _refuse(self, reason: str, error: str, hint: str = "") -> Refused:
        self._house.tally.refused(reason, self._visitor.role, self._name)
        return Refused(error=error, hint=hint)

    def _start(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _obey(self, command: AnyCommand) -> None:
        reply = await self._house.dispatcher.obey(command, self._visitor, self._name)
        self._client.post(Replied(reply=reply).model_dump_json())
