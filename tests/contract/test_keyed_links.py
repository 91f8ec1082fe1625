"""Links with keys, over real sockets: who may do what, and what the others are told."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

import pytest

from kempelen.app.node_keys import make_keys
from kempelen.core.errors import LinkError
from kempelen.core.protocols import RobotPhase
from kempelen.nodes.remote_robot import RemoteRobot
from kempelen.nodes.zenoh_link import Network, ZenohLink
from kempelen.testing.elsewhere import Elsewhere, free_endpoint

STATUS, NEWS, DO = "kempelen/1/one/status", "kempelen/1/one/robot/news", "kempelen/1/one/robot/do"


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a hall with a robot, an arbiter and a view, and of another hall's arbiter."""
    folder = tmp_path_factory.mktemp("keys")
    for role in ("robot", "arbiter", "view"):
        make_keys(folder, role, role)
    make_keys(folder / "other", "arbiter", "arbiter")
    return folder


def link(keys: Path | None, *connect: str, listen: str = "") -> ZenohLink:
    own = listen or free_endpoint("tls" if keys else "tcp")
    return ZenohLink(Network(connect=connect, listen=(own,), discover=False, keys=keys))


async def test_a_robot_in_another_process_is_led_with_keys(keys: Path) -> None:
    endpoint = free_endpoint("tls")
    async with Elsewhere(listen=[endpoint], keys=str(keys / "robot"), pace=1000):
        async with link(keys / "arbiter", endpoint) as there, RemoteRobot(there, "one") as robot:
            await robot.home()
            assert robot.state.phase is RobotPhase.IDLE
        with pytest.raises(LinkError, match="of another authority"):
            async with link(keys / "other" / "arbiter", endpoint):
                pass
        with pytest.raises(LinkError, match="wants to know who asks"):
            async with link(None, endpoint.replace("tls", "tcp")):
                pass


@asynccontextmanager
async def hall(keys: Path) -> AsyncIterator[tuple[ZenohLink, ZenohLink, ZenohLink]]:
    """Robot, arbiter and view, each of which reaches the others."""
    robots, arbiters = free_endpoint("tls"), free_endpoint("tls")
    async with AsyncExitStack() as stack:
        robot = await stack.enter_async_context(link(keys / "robot", listen=robots))
        arbiter = await stack.enter_async_context(link(keys / "arbiter", robots, listen=arbiters))
        view = await stack.enter_async_context(link(keys / "view", robots, arbiters))
        yield robot, arbiter, view


async def test_a_view_hears_of_status_and_may_do_nothing_else(keys: Path) -> None:
    async with hall(keys) as (robot, arbiter, view):
        asked, heard = list[bytes](), asyncio.Queue[tuple[str, bytes]]()
        told = list[tuple[str, bytes]]()
        seen = asyncio.Queue[tuple[str, bool]]()

        async def answer(question: bytes) -> bytes:
            asked.append(question)
            return b"done"

        await robot.answer(DO, answer)
        await robot.stand("kempelen/1/one/robot")
        await arbiter.stand("kempelen/1/one/arbiter")
        await arbiter.listen(STATUS, lambda key, news: told.append((key, news)))
        await arbiter.listen(NEWS, lambda key, news: told.append((key, news)))
        await view.listen("kempelen/1/*/status", lambda key, news: heard.put_nowait((key, news)))
        await view.listen(NEWS, lambda key, news: heard.put_nowait((key, news)))
        await view.watch("kempelen/*/*/arbiter", lambda key, here: seen.put_nowait((key, here)))
        async with asyncio.timeout(10):
            assert await seen.get() == ("kempelen/1/one/arbiter", True)
            assert await arbiter.ask(DO, b"from the arbiter", seconds=5) == b"done"
            with pytest.raises(LinkError):
                await view.ask(DO, b"from the view", seconds=0.3)
            assert await view.standing("kempelen/*/*/robot") == []
            await view.tell(STATUS, b"forged")
            await robot.tell(NEWS, b"not for views")
            while (STATUS, b"true") not in told:  # declarations spread by and by
                await arbiter.tell(STATUS, b"true")
                await asyncio.sleep(0.01)
            got = {await heard.get(), await heard.get()}
            while not heard.empty():
                got.add(heard.get_nowait())
        assert got == {(STATUS, b"forged"), (STATUS, b"true")}  # its own forgery reaches itself alone
        assert asked == [b"from the arbiter"]
        assert (STATUS, b"forged") not in told
        assert (NEWS, b"not for views") in told


async def test_a_robot_may_not_speak_for_an_arbiter(keys: Path) -> None:
    async with hall(keys) as (robot, arbiter, view):
        heard = asyncio.Queue[bytes]()
        await view.listen(STATUS, lambda _, news: heard.put_nowait(news))
        async with asyncio.timeout(10):
            news = b""
            while not news:
                await robot.tell(STATUS, b"forged")
                await arbiter.tell(STATUS, b"true")
                await asyncio.sleep(0.01)
                news = heard.get_nowait() if heard.qsize() else b""
        assert news == b"true"


@pytest.mark.parametrize(
    ("keys_there", "endpoint", "message"),
    [(False, "tls/127.0.0.1:1", "wants to know who asks"), (True, "tcp/127.0.0.1:1", "is not encrypted")],
)
async def test_endpoints_that_do_not_go_with_the_keys(
    keys: Path, keys_there: bool, endpoint: str, message: str
) -> None:
    with pytest.raises(LinkError, match=message):
        async with link(keys / "view" if keys_there else None, endpoint):
            pass


async def test_nobody_at_an_endpoint_is_no_error_yet() -> None:
    async with link(None, free_endpoint()) as alone:
        assert await alone.standing("kempelen/*/*/robot") == []
