"""What can be typed during a game: moves, answers and commands."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from pathlib import Path

import chess

from kempelen.app.cast import GameRequest
from kempelen.app.live_game import LiveGame
from kempelen.app.narrate import colour_name
from kempelen.app.people import YES, Answers
from kempelen.cli.plain import END_OF_INPUT
from kempelen.cli.showing import require_writable
from kempelen.cli.telling import assignment, told
from kempelen.core.errors import GameError, KempelenError, OperatorNeededError
from kempelen.game.modes import Mode, speaker
from kempelen.game.pgn import read_game

HELP = (
    "Moves: Nf3, e2e4, 5254, O-O, e8=N.\n"
    "pause stops the robot at once; resume goes on; finish completes the move. takeback [HALF-MOVES]. "
    "draw offers one, resign gives up. mode play|watch|replay [FILE.pgn [GAME]] changes who plays. "
    "bumped measures the board again by camera. eyes off plays without the camera, eyes on with it. "
    "look [FILE.png] shows what it sees; set NAME=VALUE overrides how. "
    "speed N|max (twin). stop is the emergency stop. quit or Ctrl-C leaves; the game is kept."
)

_LEAVING = frozenset({"quit", "exit"})
_AT_ONCE = frozenset({"pause", "resume", "finish", "mode", "speed", "stop", "help", "eyes", "look", "set"})


class LeaveError(Exception):
    """The person wants to leave; the game stays resumable."""


class Commander:
    """Turns typed lines into moves, answers and orders to the arbiter.

    Args:
        game: The running game.
        answers: Questions that wait for a line.
        say: Shows a sentence.
        patient: Whether moves, answers and what is said between moves wait until the person is asked, as
            in a script they must; a person at a keyboard is told at once that it is not its turn.
    """

    def __init__(
        self, game: LiveGame, answers: Answers, say: Callable[[str], None], *, patient: bool = False
    ) -> None:
        self._game = game
        self._patient = patient
        self._answers = answers
        self._say = say
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def _orders(self) -> Mapping[str, Callable[[Sequence[str]], Awaitable[object]]]:
        arbiter = self._game.arbiter
        return {
            "pause": lambda _: arbiter.pause(),
            "resume": lambda _: arbiter.resume(),
            "finish": lambda _: arbiter.finish_move(),
            "takeback": lambda words: arbiter.takeback(_count(words)),
            "resign": lambda _: arbiter.resign(self._colour()),
            "draw": lambda _: arbiter.offer_draw(self._colour()),
            "mode": self._mode,
            "speed": self._speed,
            "bumped": self._bumped,
            "eyes": self._eyes,
            "look": self._look,
            "set": self._set,
            "stop": lambda _: arbiter.stop(),
            "help": self._help,
        }

    @property
    def words(self) -> list[str]:
        """All command words, for completion."""
        return sorted([*self._orders, *(f"mode {mode.value}" for mode in Mode), "quit"])

    def prompt(self) -> str:
        """What is wanted of the person, before the input."""
        person, arbiter = self._game.cast.person, self._game.arbiter
        if self._answers.waiting:
            return "Your answer: "
        if person.offered_draw:
            return "A draw is offered. Agree (y/n)? "
        if arbiter.state.ended is not None:
            return ""
        paused = "Paused (resume, finish)" if arbiter.paused else ""
        if person.to_move:
            turn = arbiter.state.board.turn
            return f"{paused and f'{paused}. '}Your move, {colour_name(turn)}{self._left(turn)}: "
        return f"{paused or '(help, pause, quit)'} > "

    def _left(self, colour: chess.Color) -> str:
        """On a chess clock: `` (4:35)``."""
        left = self._game.arbiter.clock.left(colour)
        if left is None:
            return ""
        minutes, seconds = divmod(int(left), 60)
        return f" ({minutes}:{seconds:02d})"

    def _colour(self) -> chess.Color:
        arbiter = self._game.arbiter
        return speaker(arbiter.pairing.people, arbiter.state.board.turn)

    async def obey(self, lines: AsyncIterator[str]) -> None:
        """Until the input ends.

        Raises:
            LeaveError: the person left.
            OperatorNeededError: the input has ended, and a person is needed to go on.
        """
        try:
            async for line in lines:
                if line == END_OF_INPUT:
                    await self._no_more_input()
                if self._patient and not self._is_at_once(line):
                    await self._wanted()
                if line.lower() in _LEAVING:
                    raise LeaveError
                if line or self._answers.waiting:
                    self._take(line)
        finally:
            for task in self._tasks:
                task.cancel()

    async def _no_more_input(self) -> None:
        """What was typed so far is still done; when the next move is wanted, nobody can give it."""
        arbiter = self._game.arbiter
        while self._tasks and not arbiter.paused:
            await asyncio.wait(self._tasks, return_when=asyncio.FIRST_COMPLETED)
        if not arbiter.paused:
            await self._wanted()
        turn = colour_name(arbiter.state.board.turn)
        wish = "the game is paused." if arbiter.paused else f"{turn} is to move."
        wish = self._answers.question or wish
        raise OperatorNeededError(
            f"Standard input has ended, and only a person can go on: {wish}",
            hint="Resume with the keyboard or more lines as standard input.",
        )

    async def _wanted(self) -> None:
        """Until a move or an answer is waited for."""
        events = (self._game.cast.person.wanted, self._answers.wanted)
        while not any(event.is_set() for event in events):  # it may be over when its waiter comes to run
            waits = [asyncio.ensure_future(event.wait()) for event in events]
            try:
                await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for wait in waits:
                    wait.cancel()

    def _is_at_once(self, line: str) -> bool:
        word = line.lower().partition(" ")[0]
        if not self._game.arbiter.pairing.people and (word in self._orders or word in _LEAVING):
            return True
        return word in _AT_ONCE

    def _take(self, line: str) -> None:
        if self._answers.waiting:
            self._answers.answer(line)
            return
        if self._game.cast.person.offered_draw:
            self._game.cast.person.answer(agree=line.lower() in YES)
            return
        word, *rest = line.split()
        if (order := self._orders.get(word.lower())) is None:
            self._move(line)
            return
        task = asyncio.ensure_future(self._guarded(lambda: order(rest)))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _guarded(self, action: Callable[[], Awaitable[object]]) -> None:
        try:
            await action()
        except KempelenError as error:
            self._say(str(error))

    def _move(self, line: str) -> None:
        """At once: whose turn it is may be another's in a moment."""
        try:
            self._game.cast.person.submit(line)
        except KempelenError as error:
            self._say(str(error))

    async def _mode(self, words: Sequence[str]) -> None:
        try:
            mode = Mode(words[0].lower())
        except (IndexError, ValueError):
            self._say("Say `mode play`, `mode watch` or `mode replay [FILE.pgn [GAME]]`.")
            return
        request = GameRequest(mode=mode, person_plays=self._game.arbiter.state.board.turn)
        if mode is Mode.REPLAY:
            request = self._replay(words[1:])
        await self._game.swap_mode(request)

    def _replay(self, words: Sequence[str]) -> GameRequest:
        """The score that is named, or the one that the game began with."""
        if not words:
            return GameRequest(mode=Mode.REPLAY)
        *name, last = words
        number = int(last) if name and last.isdigit() else 1
        file = Path(" ".join(name if name and last.isdigit() else words)).expanduser()
        return GameRequest(mode=Mode.REPLAY, score=read_game(file, number))

    async def _speed(self, words: Sequence[str]) -> None:
        await self._game.set_speed(words[0] if words else "")

    async def _bumped(self, _words: Sequence[str]) -> None:
        self._say("Measuring the board: keep away from it.")
        self._say(await self._game.board_was_bumped())

    async def _eyes(self, words: Sequence[str]) -> None:
        if list(words) not in (["on"], ["off"]):
            self._say("Say `eyes off` or `eyes on`.")
            return
        self._game.require_eyes().switch(on=words[0] == "on")
        self._say(
            "The board is looked at again."
            if words[0] == "on"
            else "The board is not looked at any more: type your moves; nobody checks the robot's."
        )

    async def _look(self, words: Sequence[str]) -> None:
        eye = self._game.require_eyes().eye
        file = _file(words)
        await asyncio.to_thread(file.write_bytes, await eye.picture())
        self._say(f"{told(eye.latest)} View: {file}")

    async def _set(self, words: Sequence[str]) -> None:
        name, value = assignment(" ".join(words))
        await self._game.require_eyes().eye.set(name, value)
        self._say(f"{name} is {'what the reader takes' if value is None else f'{value:g}'} from now on.")

    async def _help(self, _words: Sequence[str]) -> None:
        self._say(HELP)


def _file(words: Sequence[str]) -> Path:
    """Where a picture is written to.

    Raises:
        ConfigError: nothing can be written there.
    """
    file = Path(" ".join(words) or "view.png").expanduser().absolute()
    require_writable(file)
    return file


def _count(words: Sequence[str]) -> int | None:
    """How many half-moves.

    Raises:
        GameError: not a number.
    """
    if not words:
        return None
    if not words[0].isdigit():
        raise GameError(f"'{words[0]}' is no number of half-moves.", hint="Say `takeback` or `takeback 2`.")
    return int(words[0])
