"""Runs a station and its server in one event loop, until it is told to end."""

import asyncio
import contextlib
import errno
import signal
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.http11 import Request

from kempelen.app.config import Config
from kempelen.app.station import Station
from kempelen.app.table_status import ToldStatus
from kempelen.core.errors import ConfigError, KempelenError
from kempelen.server.app import create_app
from kempelen.server.commands import Role
from kempelen.server.doorplate import Doorplate
from kempelen.server.house import House, Settings
from kempelen.server.routes_session import url_with_token
from kempelen.server.security import LARGE
from kempelen.server.sessions import FIRST_TOKEN_LASTS_S
from kempelen.server.socket import ABORT
from kempelen.server.tls import Certificate, addresses, certificate, host_names, is_loopback

PORT = 8420
_TRIES = 20
"""Ports that are tried one after the other where none was asked for."""
_LEAST_PASSWORD = 8
_SEND_BUFFER = 256 * 1024
"""Bytes that the system keeps for a client that does not take them."""
_PING_S, _PONG_S = 10.0, 15.0
_GRACE_S = 2
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@dataclass(frozen=True)
class ServeOptions:
    """How to serve.

    Attributes:
        port: None: `PORT`, or the next that is free; 0: any.
        tls: Whether to make a certificate and encrypt.
        passwords: What lets somebody in as this role.
        names: More host names that lead here.
        connect: Whether to connect the robot at once.
    """

    host: str = "127.0.0.1"
    port: int | None = None
    tls: bool = False
    passwords: dict[Role, str] = field(default_factory=dict)
    names: frozenset[str] = frozenset()
    connect: bool = True


@dataclass(frozen=True)
class Opened:
    """A server that answers.

    Attributes:
        url: For the operator; works once.
        origin: The page without a token.
        others: Addresses for other machines; empty on loopback.
        fingerprint: Of the certificate; empty without one.
        exposed: Whether passwords go over a network in the clear.
    """

    url: str
    origin: str
    others: tuple[str, ...]
    fingerprint: str
    exposed: bool


async def serve(config: Config, options: ServeOptions, opened: Callable[[Opened], None]) -> int | None:
    """Serve until SIGINT, SIGTERM or SIGHUP; then the robot is at rest and the game kept.

    Args:
        config: Of the station.
        options: How to serve.
        opened: Called once when it answers.

    Returns:
        Number of the game that was going on when it ended, and can be gone on with; None for none.

    Raises:
        ConfigError: the port or the options cannot be used, or another server has this data directory.
    """
    _require_passwords(options)
    with Doorplate(config.data_dir) as plate, _listening(options) as listening:
        port = listening.getsockname()[1]
        made = _certificate(config.data_dir / "tls", options) if options.tls else None
        origin = f"{'https' if made else 'http'}://{_host(options.host)}:{port}"
        settings = Settings(
            origin=origin,
            secure=made is not None,
            names=frozenset() if is_loopback(options.host) else host_names() | options.names,
            sessions=config.data_dir / "sessions.json",
            passwords=options.passwords,
        )
        async with Station(config) as station, ToldStatus(config, station.events):
            app = create_app(station, settings)
            house: House = app.state.house
            server = _Server(_uvicorn(app, made))

            def answers() -> None:
                plate.put(origin, house.sessions.open("operator"), str(made.certificate) if made else "")
                opened(_told(house, options, origin, port, made))

            await _run(server, listening, partial(_connecting, station) if options.connect else None, answers)
            live = station.live
            return live.arbiter.game if live is not None and live.arbiter.state.ended is None else None


def _told(house: House, options: ServeOptions, origin: str, port: int, made: Certificate | None) -> Opened:
    lonely = is_loopback(options.host)
    scheme = "https" if made else "http"
    hosts = [] if lonely else [*addresses(), *sorted(host_names() - {"localhost"})]
    return Opened(
        url=url_with_token(house, "operator", FIRST_TOKEN_LASTS_S),
        origin=origin,
        others=tuple(f"{scheme}://{_bracketed(host)}:{port}" for host in hosts),
        fingerprint=made.fingerprint if made else "",
        exposed=not lonely and made is None,
    )


async def _run(server: "_Server", listening: socket.socket, beside: Any, answers: Callable[[], None]) -> None:
    """Until a signal; ``beside`` goes on beside it, and is ended with it."""
    loop = asyncio.get_running_loop()
    for number in _SIGNALS:
        loop.add_signal_handler(number, server.end)
    serving = asyncio.ensure_future(server.serve(sockets=[listening]))
    tasks: list[asyncio.Future[Any]] = [serving, asyncio.ensure_future(server.answers.wait())]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        if not server.started:
            raise ConfigError("The server could not start.", hint="What was printed before says why.")
        answers()
        if beside is not None:
            tasks.append(asyncio.ensure_future(beside()))
        await serving
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        for number in _SIGNALS:
            loop.remove_signal_handler(number)


async def _connecting(station: Station) -> None:
    """What is wrong is a fault that the station shows."""
    config = station.config
    with contextlib.suppress(KempelenError):
        await station.connect(config.robot.kind, config.robot.port)


# --- where it listens -----------------------------------------------------------------------------------


@contextlib.contextmanager
def _listening(options: ServeOptions) -> Iterator[socket.socket]:
    """Raises: ConfigError: it cannot listen there."""
    first = PORT if options.port is None else options.port
    tries = _TRIES if options.port is None else 1
    for port in range(first, first + tries):
        try:
            bound = _bound(options.host, port)
        except OSError as error:
            if error.errno != errno.EADDRINUSE or port == first + tries - 1:
                raise _not_listening(options, port, error) from None
            continue
        with contextlib.closing(bound):
            yield bound
        return


def _bound(host: str, port: int) -> socket.socket:
    family, kind, protocol, _, address = socket.getaddrinfo(
        host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    made = socket.socket(family, kind, protocol)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # after a restart at once
        made.bind(address)
        made.setblocking(False)  # noqa: FBT003 - the library's
    except BaseException:
        made.close()
        raise
    return made


def _not_listening(options: ServeOptions, port: int, error: OSError) -> ConfigError:
    if error.errno == errno.EADDRINUSE:
        hint = "Name another one: --port 0 takes any that is free."
        return ConfigError(f"Port {port} of {options.host} is in use by another program.", hint=hint)
    if isinstance(error, PermissionError):
        hint = "Ports below 1024 are the system's; name a higher one with --port."
        return ConfigError(f"This user may not listen on port {port}.", hint=hint)
    why = error.strerror or str(error)
    hint = "Name an address of this machine: --host 127.0.0.1, or --host 0.0.0.0 for all."
    return ConfigError(f"The server cannot listen on {options.host}: {why}.", hint=hint)


def _require_passwords(options: ServeOptions) -> None:
    for role, password in options.passwords.items():
        if len(password) < _LEAST_PASSWORD:
            raise ConfigError(
                f"The {role}'s password has {len(password)} characters.",
                hint=f"Use at least {_LEAST_PASSWORD}.",
            )
    if len(set(options.passwords.values())) < len(options.passwords):
        raise ConfigError("Operator and player have the same password.", hint="Give them different ones.")


def _certificate(directory: Path, options: ServeOptions) -> Certificate:
    names = {*host_names(), *options.names, "127.0.0.1", "::1", *addresses()}
    return certificate(directory, names)


def _host(host: str) -> str:
    """Where people find a server that listens everywhere."""
    if host in {"0.0.0.0", "::"}:  # noqa: S104 - compared, not bound
        found = addresses()
        return _bracketed(found[0]) if found else "127.0.0.1"
    return _bracketed(host)


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


# --- the protocol ---------------------------------------------------------------------------------------


def _uvicorn(app: FastAPI, made: Certificate | None) -> uvicorn.Config:
    return uvicorn.Config(
        app,
        http="h11",
        ws=_WebSocket,
        ws_max_size=LARGE,
        ws_per_message_deflate=False,  # the messages are small, and deflating costs 64 kB a client
        ws_ping_interval=_PING_S,
        ws_ping_timeout=_PONG_S,
        lifespan="on",
        log_config=None,
        access_log=False,  # addresses hold tokens
        proxy_headers=False,  # nobody is believed to be somebody else
        server_header=False,
        timeout_keep_alive=30,
        timeout_graceful_shutdown=_GRACE_S,
        ssl_certfile=str(made.certificate) if made else None,
        ssl_keyfile=str(made.key) if made else None,
    )


class _Server(uvicorn.Server):
    """Leaves the program's signals alone.

    Attributes:
        answers: Set when it does.
    """

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """They are ours."""
        yield

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.answers = asyncio.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to answer."""
        await super().startup(sockets)
        self.answers.set()

    def end(self) -> None:
        """As soon as may be."""
        self.should_exit = True


class _WebSocket(WebSocketsSansIOProtocol):
    """Bounds what is kept for a client that takes nothing, and can let go of it."""

    def handle_connect(self, event: Request) -> None:
        """The handshake."""
        made = self.transport.get_extra_info("socket")
        if made is not None:
            made.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
        super().handle_connect(event)
        if hasattr(self, "scope"):
            extensions: dict[str, Any] = self.scope["extensions"]
            extensions[ABORT] = self.transport.abort
