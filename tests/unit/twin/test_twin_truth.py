"""What the side door tells a view: attitudes, the hand while it is out, and whether anything moves."""

import asyncio
from pathlib import Path

import chess

from kempelen.core.table import Table, start_layout
from kempelen.twin.client import TwinControl, TwinProcess
from kempelen.twin.spec import TwinSpec


async def test_a_view_beside_the_virtual_person(tmp_path: Path) -> None:
    table = Table()
    layout = start_layout(table, chess.Board("8/8/8/8/8/8/4P3/4K2k w - - 0 1"))
    spec = TwinSpec.of(table, layout, control=tmp_path / "door", speed=0.0, seed=1)
    async with TwinProcess(spec) as twin, twin.control.beside() as view:
        await view.ask("settle")
        before = await view.ask("truth")
        assert before["resting"]
        assert before["hand"] is None
        assert all(len(piece["q"]) == 4 for piece in before["pieces"])
        x, y, _ = table.centre(next(iter(layout)))
        hands = await _watch_a_carry(twin.control, view, (float(x), float(y)))
        assert hands
        assert min(hand[2] for hand in hands) >= 0
        assert (await view.ask("truth"))["hand"] is None


async def _watch_a_carry(
    control: TwinControl, view: TwinControl, source: tuple[float, float]
) -> list[list[float]]:
    errand = asyncio.ensure_future(control.ask("carry", **{"from": source, "to": (60.0, 60.0)}))
    seen = []
    while not errand.done():
        truth = await view.ask("truth")
        if truth["hand"] is not None:
            assert not truth["resting"]
            seen.append(truth["hand"])
    await errand
    return seen
