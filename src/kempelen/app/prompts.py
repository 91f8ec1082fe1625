"""What a person is asked or told during a game, in one list: questions, doubts of the eyes, offers."""

import asyncio
import itertools
from collections.abc import Callable

from kempelen.app.live_game import LiveGame
from kempelen.app.people import NO, YES, Question
from kempelen.app.station_types import Prompt
from kempelen.core import events
from kempelen.core.errors import GameError
from kempelen.core.words import say

_BOARD, _DRAW, _BY_ITSELF = "board", "draw", "by itself"
_SETTLED_BY = (events.MoveProposed, events.MoveTakenBack, events.ModeSwapped, events.Resumed)


class Prompts:
    """Open prompts, the oldest first.

    Args:
        game: The game on the table, if there is one.
        changed: Called when the list is another one.
    """

    def __init__(self, game: Callable[[], LiveGame | None], changed: Callable[[], None]) -> None:
        self._game = game
        self._changed = changed
        self._numbers = itertools.count(1)
        self._open: dict[str, Prompt] = {}  # by what they are about: there is one offer, one doubt
        self._answers: dict[str, asyncio.Future[str]] = {}
        self._asked: events.OperatorAsked | None = None

    @property
    def open(self) -> tuple[Prompt, ...]:
        """Those that are open."""
        return tuple(self._open.values())

    async def ask(self, question: Question) -> str:
        """Put a question and wait for its answer: a `kempelen.app.people.Ask`."""
        asked = self._asked if self._asked is not None and self._asked.text == question.text else question
        prompt = Prompt(self._id(), question.kind, question.text, asked.place, asked.piece)
        self._answers[prompt.id] = asyncio.get_running_loop().create_future()
        self._put(prompt.id, prompt)
        try:
            return await self._answers[prompt.id]
        finally:
            del self._answers[prompt.id]
            self._drop(prompt.id)

    def answer(self, number: str, text: str) -> None:
        """Answer the prompt of that id.

        Raises:
            GameError: it is not open any more, needs no answer, or this is none.
            NotationError: the move cannot be read, or is illegal.
        """
        prompt = next((prompt for prompt in self.open if prompt.id == number), None)
        if prompt is None:
            raise GameError(
                say("prompt_closed", "This question is not open any more."),
                hint=say("look_at_open", "Look at those that are."),
            )
        match prompt.kind:
            case "advice":
                raise GameError(
                    say("goes_by_itself", "There is nothing to answer: it goes by itself."),
                    hint=say("wait_for_it", "Wait for it."),
                )
            case "do":
                self._settle(number, text)
            case "yes_no":
                self._settle(number, "yes" if _agrees(text) else "no")
            case "draw":
                self._person_game().cast.person.answer(agree=_agrees(text))
            case "which_move":
                self._person_game().cast.person.submit(text)

    def _settle(self, number: str, text: str) -> None:
        if not self._answers[number].done():
            self._answers[number].set_result(text)

    def _person_game(self) -> LiveGame:
        game = self._game()
        if game is None:
            raise GameError(
                say("game_gone", "There is no game any more."),
                hint=say("begin_or_resume", "Begin one, or resume it."),
            )
        return game

    def hear(self, event: events.Event) -> None:
        """Take what the game tells."""
        match event:
            case events.OperatorAsked():
                self._asked = (
                    event  # at a real table the same is asked in words, and knows no more than those
                )
                if self._goes_by_itself():
                    self._tell(_BY_ITSELF, Prompt("", "advice", event.text, event.place, event.piece))
            case events.OperatorAnswered():
                self._drop(_BY_ITSELF)
            case events.SensorUnsure():
                text, moves = event.question, event.candidates
                self._tell(_BOARD, Prompt("", "which_move", text, candidates=moves))
            case events.BoardDiffers():
                self._tell(_BOARD, Prompt("", "advice", event.advice, event.place, event.piece))
            case events.DrawOffered() if self._is_to_a_person(event):
                colour = "White" if event.colour else "Black"
                text = say("draw_offered", f"{colour} offers a draw. Agree?")
                self._tell(_DRAW, Prompt("", "draw", text))
            case events.DrawDeclined():
                self._drop(_DRAW)
            case _:
                self._hear_of_moves(event)

    def _hear_of_moves(self, event: events.Event) -> None:
        if isinstance(event, events.GameOver):
            self.clear()
        elif isinstance(event, _SETTLED_BY):
            self._drop(_BOARD)

    def _goes_by_itself(self) -> bool:
        """On the twin the virtual person does what is asked."""
        game = self._game()
        return game is not None and game.session.control is not None

    def _is_to_a_person(self, offer: events.DrawOffered) -> bool:
        game = self._game()
        return game is not None and (not offer.colour) in game.arbiter.pairing.people

    def clear(self) -> None:
        """Nothing is asked any more; whoever asks is cancelled by its own game."""
        asked = {number: prompt for number, prompt in self._open.items() if number in self._answers}
        if asked != self._open:
            self._open = asked
            self._changed()

    def _id(self) -> str:
        return f"p{next(self._numbers)}"

    def _tell(self, about: str, prompt: Prompt) -> None:
        """What is told again, without a word, is over."""
        if not prompt.text:
            self._drop(about)
            return
        old = self._open.get(about)
        same = old is not None and (old.text, old.candidates) == (prompt.text, prompt.candidates)
        if not same:
            new = Prompt(self._id(), prompt.kind, prompt.text, prompt.place, prompt.piece, prompt.candidates)
            self._put(about, new)

    def _put(self, about: str, prompt: Prompt) -> None:
        self._open[about] = prompt
        self._changed()

    def _drop(self, about: str) -> None:
        if self._open.pop(about, None) is not None:
            self._changed()


def _agrees(text: str) -> bool:
    word = text.strip().lower()
    if word in YES:
        return True
    if word in NO:
        return False
    raise GameError(
        say("not_yes_no", f"'{text[:24]}' is neither yes nor no.", text=text[:24]),
        hint=say("answer_yes_no", "Answer yes or no."),
    )
