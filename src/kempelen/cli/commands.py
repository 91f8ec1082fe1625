"""What can be typed during a game: moves, answers and commands."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping

import chess

from kempelen.app.cast import GameRequest
from kempelen.app.live_game import LiveGame
from kempelen.app.people import YES, Answers
from kempelen.cli.plain import END_OF_INPUT
from kempelen.core.errors import KempelenError
from kempelen.game.modes import Mode

HELP = (
    "A move: Nf3, e2e4, 5254, O-O, e8=N. Commands: pause, resume, finish (complete the move at hand), "
    "takeback [half-moves], draw, resign, mode play|watch, stop (emergency), quit, help."
)


class LeaveError(Exception):
    """The person wants to leave; the game stays resumable."""


class Commander:
    """Turns typed lines into moves, answers and orders to the arbiter.

    Args:
        game: The running game.
        answers: Questions that wait for a line.
        say: Shows a sentence.
    """

    def __init__(self, game: LiveGame, answers: Answers, say: Callable[[str], None]) -> None:
        self._game = game
        self._answers = answers
        self._say = say
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def _orders(self) -> Mapping[str, Callable[[list[str]], Awaitable[object]]]:
        arbiter = self._game.arbiter
        return {
            "pause": lambda _: arbiter.pause(),
            "resume": lambda _: arbiter.resume(),
            "finish": lambda _: arbiter.finish_move(),
            "takeback": lambda words: arbiter.takeback(_count(words)),
            "resign": lambda _: arbiter.resign(self._colour),
            "draw": lambda _: arbiter.offer_draw(self._colour),
            "mode": self._mode,
            "stop": lambda _: arbiter.stop(),
            "help": self._help,
        }

    @property
    def words(self) -> list[str]:
        """All command words, for completion."""
        return sorted([*self._orders, "quit"])

    @property
    def _colour(self) -> chess.Color:
        people = self._game.arbiter.pairing.people
        return people[0] if len(people) == 1 else self._game.arbiter.state.board.turn

    async def obey(self, lines: AsyncIterator[str]) -> None:
        """Until the input ends.

        Raises:
            LeaveError: the person left, or a person's move is wanted and the input has ended.
        """
        try:
            async for line in lines:
                if line in {"quit", "exit"}:
                    raise LeaveError
                if line == END_OF_INPUT:
                    await self._no_more_input()
                elif line:
                    self._take(line)
        finally:
            for task in self._tasks:
                task.cancel()

    async def _no_more_input(self) -> None:
        """The moves typed so far are still played; when the next one is wanted, nobody can give it."""
        person = self._game.cast.person
        while not (person.to_move or person.offered_draw or self._answers.waiting):
            await person.wanted.wait()
        raise LeaveError

    def _take(self, line: str) -> None:
        if self._answers.waiting:
            self._answers.answer(line)
            return
        if self._game.cast.person.offered_draw:
            self._game.cast.person.answer(agree=line.lower() in YES)
            return
        word, *rest = line.lower().split()
        order = self._orders.get(word)
        task = asyncio.ensure_future(self._guarded(order(rest) if order else self._move(line)))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _guarded(self, action: Awaitable[object]) -> None:
        try:
            await action
        except KempelenError as error:
            self._say(str(error))

    async def _move(self, line: str) -> None:
        self._game.cast.person.submit(line)

    async def _mode(self, words: list[str]) -> None:
        try:
            mode = Mode(words[0])
        except (IndexError, ValueError):
            self._say("Say `mode play` or `mode watch`.")
            return
        await self._game.swap_mode(GameRequest(mode=mode, person_plays=self._game.arbiter.state.board.turn))

    async def _help(self, _words: list[str]) -> None:
        self._say(HELP)


def _count(words: list[str]) -> int | None:
    return int(words[0]) if words and words[0].isdigit() else None
