"""The side door's near end: answers belong to their questions."""

import asyncio
import json
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio

from kempelen.core.errors import TwinError
from kempelen.twin.client import TwinControl


class Door:
    """The far end of a side door: requests that came, and a way to answer them."""

    def __init__(self) -> None:
        self.came: asyncio.Queue[int] = asyncio.Queue()
        self.over = asyncio.Event()
        self._writer: asyncio.StreamWriter | None = None

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writer = writer
        while line := await reader.readline():
            self.came.put_nowait(json.loads(line)["id"])
        writer.close()
        await writer.wait_closed()
        self.over.set()

    def answer(self, number: int, *, ok: bool = True, **more: object) -> None:
        assert self._writer is not None
        self._writer.write(json.dumps({"id": number, "ok": ok, **more}).encode() + b"\n")

    def hang_up(self) -> None:
        assert self._writer is not None
        self._writer.close()


@pytest_asyncio.fixture
async def door(tmp_path: Path) -> AsyncIterator[Door]:
    far = Door()
    server = await asyncio.start_unix_server(far.serve, tmp_path / "door")
    yield far
    await far.over.wait()
    server.close()
    await server.wait_closed()


async def test_the_answer_to_a_cancelled_question_is_passed_over(door: Door, tmp_path: Path) -> None:
    async with TwinControl(tmp_path / "door") as control:
        first = asyncio.ensure_future(control.ask("settle"))
        number = await door.came.get()
        first.cancel()
        await asyncio.gather(first, return_exceptions=True)
        second = asyncio.ensure_future(control.ask("stats"))
        door.answer(number, what="late")
        door.answer(await door.came.get(), what="right")
        assert (await second)["what"] == "right"


async def test_a_refusal_and_an_end(door: Door, tmp_path: Path) -> None:
    async with TwinControl(tmp_path / "door") as control:
        asking = asyncio.ensure_future(control.ask("carry"))
        door.answer(await door.came.get(), ok=False, error="no such piece")
        with pytest.raises(TwinError, match="refused 'carry': no such piece"):
            await asking
        asking = asyncio.ensure_future(control.ask("truth"))
        await door.came.get()
        door.hang_up()
        with pytest.raises(TwinError, match="ended before it answered 'truth'"):
            await asking


async def test_nobody_at_the_door(tmp_path: Path) -> None:
    with pytest.raises(TwinError, match="No twin answers at .*nowhere: No such file"):
        await TwinControl(tmp_path / "nowhere").__aenter__()
