"""Tables of a hall as they are seen from afar: the newest news, who is there, what has gone."""

import asyncio
from collections.abc import Iterator
from contextlib import AsyncExitStack

import pytest

from kempelen.app.table_status import TableStatus, status_after
from kempelen.core import events
from kempelen.core.protocols import RobotPhase, RobotState
from kempelen.nodes.local_link import LocalNet
from kempelen.nodes.messages import key_of
from kempelen.nodes.status import HallView, Status, stand_for, tell


@pytest.fixture
def clock() -> Iterator[float]:
    return iter(float(second) for second in range(1000))


async def settled() -> None:
    for _ in range(5):
        await asyncio.sleep(0)


async def test_a_view_sees_the_newest_news_of_every_table(clock: Iterator[float]) -> None:
    net, changed = LocalNet(), list[str]()
    async with net.join() as link, net.join() as looker:
        view = HallView(looker, changed.append, clock=lambda: next(clock))
        await view.open()
        await stand_for(link, "two")
        for count in (1, 3, 2):
            await tell(link, Status(table="two", program="a", count=count, doing=f"{count}"))
        await tell(link, Status(table="one", program="b", count=1, doing="alone"))
        await settled()
        seen = view.tables
        assert list(seen) == ["one", "two"]
        assert seen["two"].status is not None
        assert (seen["two"].status.doing, seen["two"].here, seen["two"].heard) == ("3", True, 1.0)
        assert not seen["one"].here
        assert changed == ["two", "two", "two", "one"]


async def test_a_program_that_was_started_again_counts_anew() -> None:
    net = LocalNet()
    async with net.join() as link, net.join() as looker:
        view = HallView(looker)
        await view.open()
        await tell(link, Status(table="one", program="before", count=9, doing="before"))
        await settled()
        await tell(link, Status(table="one", program="after", count=1, doing="after"))
        await settled()
        status = view.tables["one"].status
        assert status is not None
        assert status.doing == "after"


async def test_a_table_that_leaves_stays_in_the_list_as_gone() -> None:
    net = LocalNet()
    async with net.join() as looker:
        view = HallView(looker)
        await view.open()
        async with net.join() as link:
            await stand_for(link, "one")
            assert view.tables["one"].here
        assert not view.tables["one"].here


@pytest.mark.parametrize("content", [b"", b"\xff", b"[]", b'{"table":"one","x":1}', b'{"table":7}'])
async def test_damaged_news_is_passed_over(content: bytes) -> None:
    net = LocalNet()
    async with net.join() as link, net.join() as looker:
        view = HallView(looker)
        await view.open()
        await link.tell(key_of("one", "status"), content)
        await settled()
        assert view.tables == {}


async def test_a_table_tells_at_once_what_happens_and_then_that_it_is_there() -> None:
    net, told = LocalNet(), asyncio.Queue[Status]()
    async with AsyncExitStack() as stack:
        link, looker = [await stack.enter_async_context(net.join()) for _ in range(2)]
        await looker.listen(key_of("*", "status"), lambda _, news: told.put_nowait(Status.unpack(news)))
        table = await stack.enter_async_context(TableStatus(link, "one", soon=0.0))
        async with asyncio.timeout(5):
            assert (await told.get()).doing == "no game"
            table.hear(events.RobotChanged(RobotState(RobotPhase.MOVING)))
            table.hear(events.OperatorAsked("Bring a queen."))
            news = await told.get()
            assert (news.robot, news.trouble, news.table) == ("moving", "Bring a queen.", "one")
            table.hear(events.Resumed())
            later = await told.get()
        assert later.count > news.count
        assert later.program == news.program != ""


def test_moves_questions_and_the_end_change_the_status() -> None:
    assert status_after(events.OperatorAnswered("done")) == {"trouble": ""}
    long = status_after(events.OperatorAsked("x" * 1000))["trouble"]
    assert len(str(long)) == 300
    assert status_after(events.Paused()) == {"paused": True, "doing": "paused"}
