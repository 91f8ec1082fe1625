"""An engine at a node: each question answered once, thoughts told, a lost node named."""

import asyncio
import random
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Self

import chess
import pytest

from kempelen.core.errors import EngineError
from kempelen.core.protocols import EngineChoice, OnThinking, Thinking
from kempelen.nodes import engine_node
from kempelen.nodes.engine_node import EngineNode
from kempelen.nodes.local_link import LocalLink, LocalNet, Weather
from kempelen.nodes.messages import key_of
from kempelen.nodes.remote_engine import EngineWaits, RemoteEngine
from kempelen.nodes.thoughts import Think, Thought

QUICK = EngineWaits(answer=0.1, again=0.01, found=0.3, lost=0.6)


class ToyEngine:
    """Moves when it is told to."""

    name = "toy"

    def __init__(self) -> None:
        self.boards: list[str] = []
        self.move = "e2e4"
        self.seconds: float | None = None
        self.go = asyncio.Event()
        self.go.set()
        self.fault: EngineError | None = None
        self.given_up = 0

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *exc: object) -> None:
        pass

    async def choose(
        self, board: chess.Board, *, seconds: float | None = None, on_thinking: OnThinking | None = None
    ) -> EngineChoice:
        self.boards.append(board.fen())
        self.seconds = seconds
        line = (chess.Move.from_uci(self.move),)
        if on_thinking:
            on_thinking(Thinking(depth=7, centipawns=20, line=line))
        try:
            await self.go.wait()
        except asyncio.CancelledError:
            self.given_up += 1
            raise
        if self.fault is not None:
            raise self.fault
        return EngineChoice(chess.Move.from_uci(self.move), Thinking(depth=9, line=line), offers_draw=True)


class Room:
    """A net with an engine's node."""

    def __init__(self, stack: AsyncExitStack, weather: Weather | None) -> None:
        self.net = LocalNet(weather)
        self.engine = ToyEngine()
        self._stack = stack
        self.node: EngineNode

    async def open(self) -> AsyncExitStack:
        """Closing what it returns ends the node."""
        own = await self._stack.enter_async_context(AsyncExitStack())
        link = await own.enter_async_context(self.net.join())
        self.node = await own.enter_async_context(EngineNode(self.engine, link, "deep"))
        return own

    async def remote(self, name: str = "deep", waits: EngineWaits = QUICK) -> RemoteEngine:
        return await self._stack.enter_async_context(RemoteEngine(self.net.join(), name, waits=waits))

    async def link(self) -> LocalLink:
        return await self._stack.enter_async_context(self.net.join())

    async def thinking(self, remote: RemoteEngine) -> asyncio.Task[EngineChoice]:
        """Its choice of the first move, for which the engine thinks until it may go."""
        self.engine.go.clear()
        choosing = asyncio.create_task(remote.choose(chess.Board()))
        await until(lambda: bool(self.engine.boards))
        return choosing


@asynccontextmanager
async def room(weather: Weather | None = None) -> AsyncIterator[Room]:
    async with AsyncExitStack() as stack:
        yield Room(stack, weather)


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(5):
        while not condition():  # noqa: ASYNC110 - what is waited for has no event of its own
            await asyncio.sleep(0.001)


async def test_a_move_comes_back_with_the_game_so_far_and_the_thoughts() -> None:
    async with room() as made:
        await made.open()
        remote = await made.remote()
        assert remote.name == "toy"
        board = chess.Board()
        for san in ("e4", "e5"):
            board.push_san(san)
        made.engine.move = "g1f3"
        thoughts = list[Thinking]()
        made.engine.go.clear()
        choosing = asyncio.create_task(remote.choose(board, seconds=0.5, on_thinking=thoughts.append))
        await until(lambda: bool(thoughts))
        made.engine.go.set()
        choice = await choosing
        assert choice == EngineChoice(
            chess.Move.from_uci("g1f3"),
            Thinking(depth=9, line=(chess.Move.from_uci("g1f3"),)),
            offers_draw=True,
        )
        assert thoughts[0] == Thinking(depth=7, centipawns=20, line=(chess.Move.from_uci("g1f3"),))
        assert (made.engine.boards, made.engine.seconds) == ([board.fen()], 0.5)


@pytest.mark.parametrize("seed", range(4))
async def test_in_foul_weather_each_position_is_thought_about_once(seed: int) -> None:
    weather = Weather(random.Random(seed), loss=0.3, twice=0.4, delay=(0.0, 0.01))
    async with room(weather) as made:
        await made.open()
        remote = await made.remote(waits=EngineWaits(answer=0.05, again=0.01, found=5, lost=5))
        board = chess.Board()
        for uci in ("e2e4", "e7e5", "g1f3", "b8c6"):
            made.engine.move = uci
            board.push((await remote.choose(board)).move)
        assert [move.uci() for move in board.move_stack] == ["e2e4", "e7e5", "g1f3", "b8c6"]
        assert len(made.engine.boards) == len(set(made.engine.boards)) == 4


async def test_a_cut_link_is_waited_out() -> None:
    async with room() as made:
        await made.open()
        remote = await made.remote()
        choosing = await made.thinking(remote)
        made.net.weather.cut = True
        made.engine.go.set()
        await until(lambda: not made.node.searching)
        made.net.weather.cut = False
        assert (await choosing).move == chess.Move.from_uci("e2e4")
        assert len(made.engine.boards) == 1


async def test_a_node_that_was_started_again_is_asked_anew() -> None:
    async with room() as made:
        first = await made.open()
        remote = await made.remote()
        choosing = await made.thinking(remote)
        await first.aclose()
        made.engine.go.set()
        await made.open()
        assert (await choosing).move == chess.Move.from_uci("e2e4")
        assert len(made.engine.boards) == 2


async def test_a_lost_node_is_an_engine_error_with_the_way_on() -> None:
    async with room() as made:
        await made.open()
        remote = await made.remote()
        choosing = await made.thinking(remote)
        made.net.weather.cut = True
        with pytest.raises(EngineError, match="engine node deep has named no move") as raised:
            await choosing
        assert "kempelen resume --engine" in raised.value.hint
        made.net.weather.cut = False


async def test_a_search_that_is_not_wanted_any_more_ends_at_the_node() -> None:
    async with room() as made:
        await made.open()
        remote = await made.remote()
        choosing = await made.thinking(remote)
        choosing.cancel()
        await asyncio.gather(choosing, return_exceptions=True)
        await until(lambda: made.engine.given_up == 1)


async def test_a_search_that_nobody_asks_after_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_node, "_UNWANTED_S", 0.05)
    monkeypatch.setattr(engine_node, "_LOOK_S", 0.01)
    async with room() as made:
        await made.open()
        remote = await made.remote()
        choosing = await made.thinking(remote)
        made.net.weather.cut = True
        await until(lambda: made.engine.given_up == 1)
        made.net.weather.cut = False
        made.engine.go.set()
        assert (await choosing).move == chess.Move.from_uci("e2e4")


async def test_what_the_engine_refuses_is_raised_here() -> None:
    async with room() as made:
        await made.open()
        remote = await made.remote()
        made.engine.fault = EngineError("It named no move.", hint="Try another one.")
        with pytest.raises(EngineError, match="It named no move") as raised:
            await remote.choose(chess.Board())
        assert raised.value.hint == "Try another one."


async def test_an_illegal_move_is_never_taken() -> None:
    async with room() as made:
        await made.open()
        remote = await made.remote()
        made.engine.move = "e2e5"
        with pytest.raises(EngineError, match="'e2e5' is no legal move"):
            await remote.choose(chess.Board())


async def test_an_older_question_that_comes_late_does_not_disturb_the_newer_one() -> None:
    async with room() as made:
        await made.open()
        link = await made.link()

        async def ask(number: int) -> Thought:
            question = Think(client="0123456789", number=number).pack()
            return Thought.unpack(await link.ask(key_of("deep", "engine", "think"), question, seconds=2))

        assert (await ask(2)).status == "done"
        late = await ask(1)
        assert late.trouble is not None
        assert "overtaken by question 2" in late.trouble.message
        assert len(made.engine.boards) == 1


@pytest.mark.parametrize(
    "content",
    [
        b"", b"\xff", b"{}", b'{"client":"0123456789","number":1,"moves":["e2e5"]}',
        b'{"client":"0123456789","number":1,"start":"nonsense"}',
    ],
    ids=["empty", "binary", "nothing", "illegal", "position"],
)  # fmt: skip
async def test_damaged_questions_are_refused_and_nothing_is_thought(content: bytes) -> None:
    async with room() as made:
        await made.open()
        link = await made.link()
        thought = Thought.unpack(await link.ask(key_of("deep", "engine", "think"), content, seconds=1))
        assert thought.status == "failed"
        assert thought.trouble is not None
        assert made.engine.boards == []


async def test_a_node_that_is_not_there_is_named_with_those_that_are() -> None:
    async with room() as made:
        await made.open()
        with pytest.raises(EngineError, match="No engine node named shallow answers") as raised:
            await made.remote("shallow")
        assert "Nodes with an engine: deep." in raised.value.hint


async def test_a_node_of_another_protocol_is_named() -> None:
    async with room() as made:
        await (await made.link()).stand(key_of("old", "engine", protocol=99))
        with pytest.raises(EngineError, match="speaks protocol 99, this program protocol 1"):
            await made.remote("old")
