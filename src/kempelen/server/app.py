"""The ASGI application: routes, what guards them, and what runs beside them."""

import asyncio
import secrets
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any

from fastapi import APIRouter, FastAPI

from kempelen import __version__
from kempelen.app.station import Station
from kempelen.server import (
    page,
    routes,
    routes_about,
    routes_eyes,
    routes_logs,
    routes_ports,
    routes_scene,
    routes_session,
    routes_table,
    socket,
)
from kempelen.server.bridge import Bridge
from kempelen.server.describe import describe
from kempelen.server.desk import Desk
from kempelen.server.feeds import feeds, kept_up
from kempelen.server.house import House, Settings
from kempelen.server.problems import explain
from kempelen.server.security import Guard

ROUTES: Sequence[APIRouter] = (
    routes.router,
    routes_session.router,
    routes_about.router,
    routes_eyes.router,
    routes_logs.router,
    routes_ports.router,
    routes_scene.router,
    routes_table.router,
    socket.router,
    page.router,  # last: it takes every address
)


def create_app(station: Station, settings: Settings | None = None) -> FastAPI:
    """Everything over HTTP for one station, which is entered and left by whoever calls.

    Args:
        station: What is shown and commanded.
        settings: How the server is reached.
    """
    house = House(station, settings or Settings(), secrets.token_hex(8))
    app = FastAPI(
        title="Kempelen", version=__version__, summary="A chess robot: its table and its games.",
        lifespan=_alive, docs_url=None, redoc_url=None, openapi_url="/api/openapi.json",
    )  # fmt: skip
    app.state.house = house
    app.state.desk = Desk(station, house.hub.line)
    for router in ROUTES:
        app.include_router(router)
    explain(app)
    app.add_middleware(Guard, names=house.settings.names, tally=house.tally)
    _describe(app)
    return app


def _describe(app: FastAPI) -> None:
    plain = app.openapi

    def described() -> dict[str, Any]:
        if app.openapi_schema is None:
            app.openapi_schema = describe(plain())
        return app.openapi_schema

    app.openapi = described  # type: ignore[method-assign]  # FastAPI's documented way


@asynccontextmanager
async def _alive(app: FastAPI) -> AsyncIterator[None]:
    """What runs as long as the application does."""
    house: House = app.state.house
    async with AsyncExitStack() as stack:
        stack.enter_context(app.state.desk)
        stack.push_async_callback(house.dispatcher.close)
        stack.enter_context(Bridge(house.station, house.hub))
        tasks = [asyncio.create_task(kept_up(feed), name=type(feed).__name__) for feed in feeds(house)]
        stack.push_async_callback(_end, tasks)
        yield


async def _end(tasks: Sequence[asyncio.Task[None]]) -> None:
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
