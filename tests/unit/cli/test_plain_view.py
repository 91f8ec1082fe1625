"""Lines instead of a picture; typed lines from whatever standard input is."""

import asyncio
import io
import os
from collections.abc import AsyncIterator, Iterable
from pathlib import Path

import chess
from rich.console import Console

from kempelen.cli.plain import END_OF_INPUT, PlainView, typed_lines
from kempelen.core import events
from kempelen.core.protocols import Thinking


async def stream(items: Iterable[events.Event]) -> AsyncIterator[events.Event]:
    for item in items:
        yield item


async def shown(*items: events.Event, people: tuple[bool, ...] = (), length: int | None = None) -> list[str]:
    out = io.StringIO()
    view = PlainView(Console(file=out, width=40), lambda: people, lambda: length)
    await view.show(stream(items))
    return out.getvalue().splitlines()


TURN = events.TurnBegan(chess.WHITE, "Ada", chess.STARTING_FEN)
THOUGHT = events.EngineThinking(chess.WHITE, Thinking(depth=7, centipawns=20))
E4 = events.MoveProposed(1, chess.WHITE, "e4", "e2e4", ())


async def test_a_person_is_asked_and_an_engine_is_quoted() -> None:
    assert await shown(TURN, people=(True,)) == ["Your move, White."]
    assert await shown(TURN, THOUGHT, E4) == ["1. e4  (depth 7, +0.20)"]


async def test_a_replay_tells_how_far_it_is() -> None:
    assert await shown(TURN, E4, length=46) == ["1. e4  (half-move 1 of 46)"]


async def test_an_event_is_one_line_however_narrow_the_output() -> None:
    long = events.OperatorAsked("Stand a white queen on the slot left13 of the tray, please, at once.")
    assert await shown(long) == [f"Please: {long.text}"]


async def test_lines_from_a_pipe_as_they_come() -> None:
    reading, writing = os.pipe()
    lines = typed_lines(reading)
    try:
        os.write(writing, b"  e4 \nd")
        assert await anext(lines) == "e4"
        waiting = asyncio.ensure_future(anext(lines))
        await asyncio.sleep(0)
        assert not waiting.done()
        os.write(writing, "5\nmode pläy".encode())
        assert await waiting == "d5"
        os.close(writing)
        assert [line async for line in lines] == ["mode pläy", END_OF_INPUT]
    finally:
        os.close(reading)


async def test_lines_from_a_file(tmp_path: Path) -> None:
    file = tmp_path / "moves"
    file.write_bytes(b"e4\n\nd4\xff\n")
    descriptor = os.open(file, os.O_RDONLY)
    try:
        assert [line async for line in typed_lines(descriptor)] == ["e4", "", "d4�", END_OF_INPUT]
    finally:
        os.close(descriptor)


async def test_an_input_that_is_closed_has_ended() -> None:
    assert [line async for line in typed_lines(-1)] == [END_OF_INPUT]
    descriptor = os.open(os.devnull, os.O_RDONLY)
    assert [line async for line in typed_lines(descriptor)] == [END_OF_INPUT]
    os.close(descriptor)
