"""What a person is asked or told, as a list of prompts."""

import asyncio
from types import SimpleNamespace
from typing import Any, cast

import chess
import pytest

from kempelen.app.live_game import LiveGame
from kempelen.app.people import Question
from kempelen.app.prompts import Prompts
from kempelen.core import events
from kempelen.core.errors import GameError
from kempelen.core.places import Place
from kempelen.game.players import PersonPlayer

KNIGHT = chess.Piece.from_symbol("N")
ASKED = events.OperatorAsked("Put the white knight back on f3.", KNIGHT, Place("f3"))
UNSURE = events.SensorUnsure("Which piece was it?", ("e7e8q", "e7e8n"))


class Desk:
    """Prompts of a game that need not be.

    Args:
        twin: Whether the virtual person does what is asked.
    """

    def __init__(self, *, twin: bool = True) -> None:
        self.person = PersonPlayer()
        game: Any = SimpleNamespace(
            session=SimpleNamespace(control=object() if twin else None),
            arbiter=SimpleNamespace(pairing=SimpleNamespace(people=(chess.WHITE,))),
            cast=SimpleNamespace(person=self.person),
        )
        self.game: LiveGame | None = cast("LiveGame", game)
        self.changes = 0
        self.prompts = Prompts(lambda: self.game, self._changed)

    def _changed(self) -> None:
        self.changes += 1

    @property
    def kinds(self) -> list[str]:
        return [prompt.kind for prompt in self.prompts.open]


@pytest.mark.parametrize(("answer", "told"), [("yes", "yes"), ("J", "yes"), (" no ", "no"), ("ne", "no")])
async def test_a_yes_or_no(answer: str, told: str) -> None:
    desk = Desk(twin=False)
    asking = asyncio.ensure_future(desk.prompts.ask(Question("In the gripper?", "yes_no", KNIGHT)))
    await asyncio.sleep(0)
    (prompt,) = desk.prompts.open
    assert (prompt.kind, prompt.text, prompt.piece) == ("yes_no", "In the gripper?", KNIGHT)
    with pytest.raises(GameError, match="neither yes nor no"):
        desk.prompts.answer(prompt.id, "perhaps")
    desk.prompts.answer(prompt.id, answer)
    desk.prompts.answer(prompt.id, answer)  # somebody else, at the same time
    assert (await asking, desk.prompts.open, desk.changes) == (told, (), 2)


async def test_a_question_that_is_dropped_is_open_no_more() -> None:
    desk = Desk(twin=False)
    asking = asyncio.ensure_future(desk.prompts.ask(Question("Stand a queen on left1.")))
    await asyncio.sleep(0)
    desk.prompts.clear()
    assert desk.kinds == ["do"]  # it ends with whoever asks
    asking.cancel()
    await asyncio.gather(asking, return_exceptions=True)
    assert desk.prompts.open == ()


def test_what_the_virtual_person_does_is_told_until_it_is_done() -> None:
    desk = Desk()
    desk.prompts.hear(ASKED)
    (prompt,) = desk.prompts.open
    assert (prompt.kind, prompt.text, prompt.place) == ("advice", ASKED.text, Place("f3"))
    with pytest.raises(GameError, match="nothing to answer"):
        desk.prompts.answer(prompt.id, "done")
    desk.prompts.hear(events.OperatorAnswered(ASKED.text))
    assert desk.prompts.open == ()


async def test_at_a_real_table_the_same_is_asked_and_not_told_twice() -> None:
    desk = Desk(twin=False)
    desk.prompts.hear(ASKED)
    assert desk.kinds == []
    asking = asyncio.ensure_future(desk.prompts.ask(Question(ASKED.text)))
    await asyncio.sleep(0)
    (prompt,) = desk.prompts.open
    assert (prompt.kind, prompt.piece, prompt.place) == ("do", KNIGHT, Place("f3"))
    desk.prompts.answer(prompt.id, "done")
    assert await asking == "done"


async def test_a_doubt_of_the_eyes_is_answered_by_a_move() -> None:
    desk = Desk()
    desk.prompts.hear(UNSURE)
    (prompt,) = desk.prompts.open
    assert (prompt.kind, prompt.candidates) == ("which_move", ("e7e8q", "e7e8n"))
    desk.prompts.hear(UNSURE)
    assert [again.id for again in desk.prompts.open] == [prompt.id]  # the same one, said again
    board = chess.Board("8/4P2k/8/8/8/8/8/4K3 w - - 0 1")
    proposing = asyncio.ensure_future(desk.person.propose(board, lambda _: None))
    await desk.person.wanted.wait()
    desk.prompts.answer(prompt.id, "e7e8n")
    assert str(getattr(await proposing, "move", None)) == "e7e8n"
    desk.prompts.hear(events.SensorUnsure(""))
    assert desk.prompts.open == ()


def test_advice_goes_when_the_board_is_right_or_the_move_is_made() -> None:
    desk = Desk()
    desk.prompts.hear(events.BoardDiffers("Put the knight back on g1.", KNIGHT, Place("g1")))
    (prompt,) = desk.prompts.open
    assert (prompt.kind, prompt.piece, prompt.place) == ("advice", KNIGHT, Place("g1"))
    desk.prompts.hear(UNSURE)  # the eyes say one thing at a time
    assert desk.kinds == ["which_move"]
    desk.prompts.hear(events.BoardDiffers(""))
    assert desk.kinds == []
    desk.prompts.hear(events.BoardDiffers("Put the knight back on g1."))
    desk.prompts.hear(events.MoveProposed(1, chess.WHITE, "e4", "e2e4", ()))
    assert desk.prompts.open == ()


async def test_a_draw_that_is_offered_to_a_person() -> None:
    desk = Desk()
    desk.prompts.hear(events.DrawOffered(chess.WHITE))
    assert desk.kinds == []  # by the person, to the engine
    answering = asyncio.ensure_future(desk.person.answer_draw(chess.Board()))
    await desk.person.wanted.wait()
    desk.prompts.hear(events.DrawOffered(chess.BLACK))
    (prompt,) = desk.prompts.open
    assert (prompt.kind, prompt.text) == ("draw", "Black offers a draw. Agree?")
    desk.prompts.answer(prompt.id, "no")
    assert await answering is False
    desk.prompts.hear(events.DrawDeclined(chess.BLACK))
    assert desk.prompts.open == ()


def test_nothing_is_open_after_the_game() -> None:
    desk = Desk()
    desk.prompts.hear(events.DrawOffered(chess.BLACK))
    (prompt,) = desk.prompts.open
    desk.game = None
    with pytest.raises(GameError, match="no game any more"):
        desk.prompts.answer(prompt.id, "yes")
    desk.prompts.hear(events.GameOver("1-0", "checkmate"))
    assert desk.prompts.open == ()
