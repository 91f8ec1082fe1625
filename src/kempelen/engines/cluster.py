"""One engine out of many: voters on this machine or on a Ray cluster search a position and elect a move."""

import asyncio
import secrets
from collections.abc import Mapping
from typing import Any, Self

import chess

from kempelen.core.errors import ConfigError, EngineError
from kempelen.core.protocols import EngineChoice, OnThinking
from kempelen.engines import ray_link
from kempelen.engines.program import Habits
from kempelen.engines.voter import Voter
from kempelen.engines.voting import Effort, Vote, elected, thinking_of
from kempelen.engines.wire import OptionValue

NAME = "cluster"
_SEARCHED = 0.9  # part of the move's time that the voters search; the rest is for the way there and back
_WORKER_S = 30.0  # s for the first voter to start


class ClusterEngine:
    """Voters in processes of Ray (implements `kempelen.core.protocols.Engine`).

    The vote is taken among those that have answered when the time of the move is over. A voter that is lost
    costs its voice; Ray starts it again. Where none answers, all are asked again, as often as they may
    restart.

    Args:
        address: ``ray://HOST:PORT``; empty for this machine alone.
        engine: Which program votes, as for `Shelf.find` on the voters' machines; empty for the best at hand.
        habits: Time, memory and number of voters; its options go to each of them.
        nodes: For each voter and move, instead of time.
    """

    def __init__(
        self, address: str = "", engine: str = "", habits: Habits | None = None, nodes: int | None = None
    ) -> None:
        self._address = address
        self._engine = engine
        self._habits = habits or Habits()
        self._nodes = nodes
        self._voters: list[Any] = []
        self._ray: Any = None
        self._game = secrets.token_hex(8)
        self.name = f"{engine or 'the best at hand'}, {self._habits.voters} voters"

    async def __aenter__(self) -> Self:
        """Join the cluster and start the voters.

        Raises:
            ConfigError: Ray is not installed.
            EngineError: The cluster does not answer, or no voter starts.
        """
        self._ray = await ray_link.join(self._address, self._habits.voters)
        try:
            self._start()
            name = await self._first_ready()
        except BaseException:
            await self.__aexit__()
            raise
        self.name = f"{name}, {len(self._voters)} voters (full strength)"
        return self

    async def __aexit__(self, *exc: object) -> None:
        """End the voters; on this machine no process is left behind."""
        voters, self._voters = self._voters, []
        await self._farewell(voters)
        for voter in voters:
            self._ray.kill(voter)
        if self._ray is not None:
            self._ray = None
            await ray_link.leave(self._address)

    @property
    def options(self) -> Mapping[str, str]:
        """None of its own: what is set goes to every voter."""
        return {}

    def new_game(self) -> None:
        """What comes next is another game."""
        self._game = secrets.token_hex(8)

    async def choose(
        self, board: chess.Board, *, seconds: float | None = None, on_thinking: OnThinking | None = None
    ) -> EngineChoice:
        """The move that the voters elect; cancelled, they stop.

        Raises:
            EngineError: There is no legal move to choose, or no voter answered in all attempts.
            ConfigError: ``seconds`` is out of range.
        """
        limit = self._habits.seconds_for(board, seconds)
        faults: list[str] = []
        for _ in range(self._habits.patience.restarts + 1):
            ballot = _Ballot(board, on_thinking)
            faults = await self._poll(board, limit, ballot)
            if vote := elected(ballot.votes, board):
                return EngineChoice(chess.Move.from_uci(vote.move), thinking_of(vote))
        raise EngineError(
            f"None of {len(self._voters)} voters named a move at {board.fen()}: {'; '.join(faults)[:300]}.",
            hint="The game is kept. Look at the cluster, or name another engine (--engine), and resume.",
        )

    async def _poll(self, board: chess.Board, seconds: float, ballot: "_Ballot") -> list[str]:
        """Collect votes until all are in or the time is over; without any, until the first."""
        grace = self._habits.patience.grace
        effort = Effort(nodes=self._nodes) if self._nodes else Effort(seconds=_SEARCHED * seconds)
        moves = [move.uci() for move in board.move_stack]
        start = board.root().fen()
        refs = [voter.vote.remote(start, moves, self._game, effort) for voter in self._voters]
        tasks = [asyncio.ensure_future(ballot.take(ref)) for ref in refs]
        try:
            patience = grace if self._nodes else seconds
            _, waiting = await asyncio.wait(tasks, timeout=patience)
            while waiting and not ballot.votes and patience < seconds + grace:
                patience += grace
                _, waiting = await asyncio.wait(tasks, timeout=grace, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._drop(refs, tasks)
            await asyncio.gather(*tasks, return_exceptions=True)
        return ballot.faults or ["none answered in time"]

    def _drop(self, refs: list[Any], tasks: "list[asyncio.Task[None]]") -> None:
        """Who comes too late is told to stop: the next search shall not stand in a queue behind it."""
        for ref, task in zip(refs, tasks, strict=True):
            if not task.done():
                task.cancel()
                self._ray.cancel(ref)

    def _start(self) -> None:
        options: dict[str, OptionValue] = {"Threads": 1, "Hash": self._habits.hash_mb, **self._habits.options}
        actor = self._ray.remote(Voter).options(
            num_cpus=1, max_restarts=-1, max_task_retries=0, max_concurrency=1
        )
        self._voters = [actor.remote(number, self._engine, options) for number in range(self._habits.voters)]

    async def _first_ready(self) -> str:
        tasks = [asyncio.ensure_future(_result(voter.ready.remote())) for voter in self._voters]
        try:
            done, _ = await asyncio.wait(tasks, timeout=_WORKER_S)
            named = [task.result() for task in done if task.exception() is None]
            if named:
                return str(named[0])
            why = [str(task.exception()).strip().splitlines()[-1] for task in done]
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        raise EngineError(
            f"No voter has started within {_WORKER_S:g} s: {(why or ['no worker is free'])[0][:200]}.",
            hint="Kempelen, a UCI engine and a free processor are needed on each machine of the cluster.",
        )

    async def _farewell(self, voters: list[Any]) -> None:
        """Let each end its engine first: a killed worker cannot."""
        tasks = [asyncio.ensure_future(_result(voter.close.remote())) for voter in voters]
        if tasks:
            await asyncio.wait(tasks, timeout=self._habits.patience.farewell + 1.0)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


class _Ballot:
    """The votes of one position as they come in."""

    def __init__(self, board: chess.Board, on_thinking: OnThinking | None) -> None:
        self._board = board
        self._on_thinking = on_thinking
        self.votes: list[Vote] = []
        self.faults: list[str] = []

    async def take(self, ref: Any) -> None:
        """Wait for one vote; a lost voter is a fault, nothing more."""
        try:
            self.votes.append(await _result(ref))
        except Exception as error:  # noqa: BLE001 - whatever ends a worker of Ray costs one voice
            self.faults.append(f"{type(error).__name__}: {str(error).strip().splitlines()[-1:]}")
            return
        leading = elected(self.votes, self._board)
        if leading and self._on_thinking:
            self._on_thinking(thinking_of(leading))


async def _result(ref: Any) -> Any:
    return await ref


def parse_cluster(engine: str) -> str | None:
    """The address in ``cluster`` (empty: this machine) or ``cluster:ray://HOST``; None for another engine.

    Raises:
        ConfigError: What follows is no address of Ray.
    """
    name, colon, address = engine.partition(":")
    if name != NAME:
        return None
    if (colon and not address.startswith("ray://")) or address == "ray://":
        raise ConfigError(
            f"'{engine[:80]}' names no cluster.", hint="Write cluster, or cluster:ray://HOST:10001"
        )
    has_port = address.removeprefix("ray://").count(":") > 0
    return address if has_port or not address else f"{address}:10001"
