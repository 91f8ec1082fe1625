"""Links over eclipse-zenoh: no broker on one network, endpoints across networks, keys to be known by.

Zenoh calls back from threads of its own; everything here goes on in the loop that entered the link. Frames of
cameras never travel this way: its Python bindings copy them.
"""

import asyncio
import contextlib
import json
import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self
from weakref import WeakKeyDictionary

import zenoh

from kempelen.core.errors import LinkError
from kempelen.nodes.handshake import why_not
from kempelen.nodes.link import Answer, Changed, Hear
from kempelen.nodes.rules import access_control

_log = logging.getLogger(__name__)
_OPEN_S = 10.0
_LEASE_MS = 4000
"""Without a word for so long another program counts as gone."""
_STANDING_S = 1.0


@dataclass(frozen=True)
class Network:
    """How a program finds the others.

    Attributes:
        connect: Endpoints of others: ``tcp/10.0.0.5:7447``, or ``tls/...`` with keys.
        listen: Own endpoints; empty: any free port, where others find this program by themselves.
        discover: Whether others on the same network are looked for.
        keys: Folder with ``ca.pem``, ``node.pem`` and ``node.key``: all is encrypted, everybody is asked
            who they are, and may do what `kempelen.nodes.rules` says. None: nobody is asked.
    """

    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    discover: bool = True
    keys: Path | None = None

    def config(self) -> zenoh.Config:
        """In zenoh's own terms.

        Raises:
            LinkError: an endpoint cannot be read, or does not go with the keys.
        """
        self._check()
        wanted: dict[str, Any] = {
            "mode": "peer",
            "scouting": {"multicast": {"enabled": self.discover}, "gossip": {"enabled": True}},
            "connect": {"endpoints": list(self.connect)},
        }
        if self.listen or self.keys is not None:
            wanted["listen"] = {"endpoints": list(self.listen) or ["tls/0.0.0.0:0"]}
        wanted["transport"] = {"link": {"tx": {"lease": _LEASE_MS}}}
        if self.keys is not None:
            wanted["transport"]["link"] |= {"tls": self._certificates(self.keys), "protocols": ["tls"]}
            wanted["access_control"] = access_control()
        try:
            return zenoh.Config.from_json5(json.dumps(wanted))
        except zenoh.ZError as error:
            raise LinkError(
                f"The network's settings cannot be used: {_first_line(error)}.",
                hint="Endpoints look like tcp/192.168.1.20:7447 or tls/robot.local:7447.",
            ) from None

    def _check(self) -> None:
        for endpoint in (*self.connect, *self.listen):
            if self.keys is not None and not endpoint.startswith("tls/"):
                raise LinkError(
                    f"{endpoint} is not encrypted, but this machine has keys.",
                    hint=f"Write tls/{endpoint.partition('/')[2]}, or leave out --keys.",
                )
            if self.keys is None and endpoint.startswith("tls/"):
                raise LinkError(
                    f"{endpoint} wants to know who asks.",
                    hint="Name this machine's keys with --keys; make them with: kempelen node keys",
                )

    @staticmethod
    def _certificates(keys: Path) -> dict[str, Any]:
        files = {name: keys / name for name in ("ca.pem", "node.pem", "node.key")}
        for file in files.values():
            if not file.is_file():
                raise LinkError(f"There is no {file}.", hint="Make keys: kempelen node keys")
        certificate, key = str(files["node.pem"]), str(files["node.key"])
        return {
            "root_ca_certificate": str(files["ca.pem"]),
            "listen_certificate": certificate, "listen_private_key": key,
            "connect_certificate": certificate, "connect_private_key": key,
            "enable_mtls": True, "verify_name_on_connect": False, "close_link_on_expiration": True,
        }  # fmt: skip


class _Shared:
    """A session that all links of a program over the same network have in common."""

    def __init__(self) -> None:
        self.session: zenoh.Session | None = None
        self.users = 0
        self.busy = asyncio.Lock()


_shared: WeakKeyDictionary[asyncio.AbstractEventLoop, dict[Network, _Shared]] = WeakKeyDictionary()


class ZenohLink:
    """Implements `kempelen.nodes.link.Link`.

    Links of one program over the same network share a session: an endpoint can be listened to but once.

    Args:
        network: How to find the others.
    """

    def __init__(self, network: Network | None = None) -> None:
        self._network = network or Network()
        self._session: zenoh.Session | None = None
        self._loop: asyncio.AbstractEventLoop
        self._declared: list[Any] = []

    async def __aenter__(self) -> Self:
        """Join.

        Raises:
            LinkError: an endpoint or a certificate cannot be used.
        """
        self._loop = asyncio.get_running_loop()
        shared = _shared.setdefault(self._loop, {}).setdefault(self._network, _Shared())
        async with shared.busy:
            if shared.session is None:
                shared.session = await self._opened()
            shared.users += 1
            self._session = shared.session
        return self

    async def _opened(self) -> zenoh.Session:
        config = self._network.config()
        try:
            async with asyncio.timeout(_OPEN_S):
                session = await asyncio.to_thread(zenoh.open, config)
        except (zenoh.ZError, TimeoutError) as error:
            raise LinkError(
                f"The network cannot be joined: {_first_line(error)}.",
                hint="Check --connect and --listen, and that the keys are valid: kempelen node keys --show",
            ) from None
        try:
            await self._explain(session)
        except BaseException:
            await asyncio.to_thread(session.close)
            raise
        return session

    async def _explain(self, session: zenoh.Session) -> None:
        """Whoever is not reached yet may come, unless it is the keys."""
        reached = {link.dst for link in session.info.links()}
        missing = [endpoint for endpoint in self._network.connect if endpoint not in reached]
        if reason := await why_not(missing, self._network.keys):
            raise LinkError(
                f"{reason}.",
                hint="All machines need keys of one authority, still valid: kempelen node keys --show",
            )

    async def __aexit__(self, *exc: object) -> None:
        """Take back what was declared; leave, if nobody else of this program is there."""
        session, self._session = self._session, None
        if session is None:
            return
        declared, self._declared = self._declared, []
        shared = _shared[self._loop][self._network]
        async with shared.busy:
            await asyncio.to_thread(_undeclare, declared)
            shared.users -= 1
            if not shared.users:
                shared.session = None
                await asyncio.to_thread(session.close)

    @property
    def session(self) -> zenoh.Session:
        """Zenoh's own.

        Raises:
            LinkError: not joined.
        """
        if self._session is None:
            raise LinkError("The network was not joined, or was left.", hint="Join it first.")
        return self._session

    async def ask(self, key: str, question: bytes, *, seconds: float) -> bytes:
        """The answer of whoever answers for ``key``.

        Raises:
            LinkError: none came within ``seconds``, or nobody is there who would.
        """
        reply: asyncio.Future[bytes | None] = self._loop.create_future()

        def arrived(content: bytes | None) -> None:
            if not reply.done():
                reply.set_result(content)

        handler: Any = zenoh.handlers.Callback(
            lambda answer: self._call(arrived, answer.ok.payload.to_bytes()) if answer.ok else None,
            lambda: self._call(arrived, None),
        )
        self.session.get(key, handler, payload=question, timeout=seconds, express=True)
        try:
            async with asyncio.timeout(seconds):
                content = await reply
        except TimeoutError:
            content = None
        if content is None:
            raise LinkError(f"No answer from {key} within {seconds:.1f} s.")
        return content

    async def answer(self, key: str, answer: Answer) -> None:
        """Answer questions to ``key`` from now on."""

        def asked(query: zenoh.Query) -> None:
            with contextlib.suppress(RuntimeError):  # the loop has ended
                asyncio.run_coroutine_threadsafe(_answered(query, answer), self._loop)

        self._declared.append(self.session.declare_queryable(key, asked))

    async def tell(self, key: str, news: bytes) -> None:
        """Tell whoever listens."""
        self.session.put(key, news, express=True, congestion_control=zenoh.CongestionControl.DROP)

    async def listen(self, pattern: str, hear: Hear) -> None:
        """Hear what is told from now on."""

        def told(sample: zenoh.Sample) -> None:
            self._call(hear, str(sample.key_expr), sample.payload.to_bytes())

        self._declared.append(self.session.declare_subscriber(pattern, told))

    async def stand(self, key: str) -> None:
        """Be seen under ``key``."""
        self._declared.append(self.session.liveliness().declare_token(key))

    async def standing(self, pattern: str) -> list[str]:
        """Who is seen now."""
        session = self.session

        def looked() -> list[str]:
            replies = session.liveliness().get(pattern, timeout=_STANDING_S)
            return sorted({str(reply.ok.key_expr) for reply in replies if reply.ok})

        return await asyncio.to_thread(looked)

    async def watch(self, pattern: str, changed: Changed) -> None:
        """Be told who comes and goes."""

        def seen(sample: zenoh.Sample) -> None:
            self._call(changed, str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

        self._declared.append(self.session.liveliness().declare_subscriber(pattern, seen, history=True))

    def _call(self, what: Callable[..., None], *arguments: object) -> None:
        """From zenoh's thread into the loop."""
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(what, *arguments)


def _undeclare(declared: Iterable[Any]) -> None:
    for one in declared:
        with contextlib.suppress(zenoh.ZError):  # the session may have been closed under it
            one.undeclare()


async def _answered(query: zenoh.Query, answer: Answer) -> None:
    with query:
        question = query.payload.to_bytes() if query.payload else b""
        try:
            query.reply(query.key_expr, await answer(question), express=True)
        except zenoh.ZError as error:
            _log.warning("An answer could not be sent: %s", _first_line(error))


def _first_line(error: BaseException) -> str:
    return (str(error) or type(error).__name__).splitlines()[0].rstrip(".")
