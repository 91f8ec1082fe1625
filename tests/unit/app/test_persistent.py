"""Work that begins anew after a fault, and the watching of the board among it."""

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kempelen.app.config import load_config
from kempelen.app.eyes import GameEyes
from kempelen.app.persistent import persistent
from kempelen.core import events
from kempelen.core.senses import Observation
from kempelen.core.words import parts_of
from kempelen.testing.eyes import ScriptedSensor


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kempelen.app.persistent.AGAIN_S", 0)


async def test_it_begins_anew_and_each_fault_is_told() -> None:
    faults: list[Exception] = []
    tries = iter([ValueError("one"), KeyError("two"), None])

    async def work() -> None:
        await asyncio.sleep(0)
        if error := next(tries):
            raise error

    await persistent(work, faults.append)
    assert [type(fault) for fault in faults] == [ValueError, KeyError]


async def test_whoever_cancels_it_ends_it() -> None:
    async def work() -> None:
        await asyncio.Event().wait()

    task = asyncio.create_task(persistent(work, lambda _: None))
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task


class ScriptedEyes(GameEyes):
    """Sees the board, and nothing else."""

    async def _open_eye(self, session: Any) -> None:
        del session

    def _together(self) -> Any:
        return ScriptedSensor([Observation(np.zeros((64, 3)), 0.0)])


async def test_a_fault_does_not_end_the_watching_of_the_board(tmp_path: Path) -> None:
    """It happens where what was seen is told; the game would wait for ever."""
    said: list[events.SensorChanged] = []
    well = asyncio.Event()

    def tell(event: Any) -> None:
        said.append(event)
        if len(said) == 1:
            raise ValueError("a fault of whoever hears it")
        if len(said) > 2:
            well.set()

    config = load_config(None, {"data.dir": str(tmp_path)})
    session: Any = SimpleNamespace(table=config.build_table())
    async with await ScriptedEyes(config, tell).open(session) as eyes:
        async with asyncio.timeout(10):
            await well.wait()
        assert [part.code for part in parts_of(said[1].message)] == ["eyes_fault"]
        assert (said[2].message, eyes.trouble) == ("", "")
