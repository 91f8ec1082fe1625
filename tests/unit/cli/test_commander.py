"""What is typed during a game becomes moves, answers and orders."""

import asyncio
from collections.abc import AsyncIterator, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import chess
import pytest

from kempelen.app.cast import GameRequest
from kempelen.app.live_game import LiveGame
from kempelen.app.people import Answers, Question
from kempelen.cli.commands import HELP, Commander, LeaveError
from kempelen.cli.plain import END_OF_INPUT
from kempelen.core.errors import GameError, OperatorNeededError
from kempelen.game.modes import Mode
from kempelen.game.players import PersonPlayer


@dataclass
class Arbiter:
    """Writes down its orders."""

    people: tuple[bool, ...] = (True,)
    paused: bool = False
    orders: list[tuple[Any, ...]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.pairing = SimpleNamespace(people=self.people)
        self.state = SimpleNamespace(board=chess.Board(), ended=None)
        self.left: dict[bool, float] = {}
        self.clock = SimpleNamespace(left=self.left.get)

    def __getattr__(self, name: str) -> Any:
        async def order(*arguments: Any) -> None:
            self.orders.append((name, *arguments))
            if name == "finish_move":
                raise GameError("The game is not paused.", hint="Pause it first.")

        return order


class Desk:
    """A commander with everything around it.

    Args:
        people: The sides that persons play.
        patient: As for `Commander`.
    """

    def __init__(self, people: tuple[bool, ...] = (True,), *, patient: bool = False) -> None:
        self.arbiter = Arbiter(people)
        self.person = PersonPlayer()
        self.said: list[str] = []
        self.swapped: list[GameRequest] = []
        self.speeds: list[str] = []
        self.answers = Answers(self.said.append)
        game = SimpleNamespace(
            arbiter=self.arbiter,
            cast=SimpleNamespace(person=self.person),
            swap_mode=self._swap,
            set_speed=self._speed,
        )
        self.commander = Commander(cast("LiveGame", game), self.answers, self.said.append, patient=patient)

    async def _swap(self, request: GameRequest) -> None:
        self.swapped.append(request)

    async def _speed(self, text: str) -> None:
        self.speeds.append(text)

    async def type(self, *lines: str) -> None:
        """All lines, then leave."""
        with pytest.raises(LeaveError):
            await self.commander.obey(typed([*lines, "", "quit"]))

    async def asked(self) -> "asyncio.Task[Any]":
        """The person is asked for a move."""
        asking = asyncio.ensure_future(self.person.propose(self.arbiter.state.board.copy(), lambda _: None))
        await self.person.wanted.wait()
        return asking


async def typed(lines: Iterable[str]) -> AsyncIterator[str]:
    for line in lines:
        yield line
        for _ in range(5):  # let what was ordered be done
            await asyncio.sleep(0)


@pytest.mark.parametrize(
    ("line", "order"),
    [
        ("pause", ("pause",)),
        ("Resume", ("resume",)),
        ("takeback", ("takeback", None)),
        ("takeback 3", ("takeback", 3)),
        ("resign", ("resign", chess.WHITE)),
        ("draw", ("offer_draw", chess.WHITE)),
        ("stop", ("stop",)),
    ],
)
async def test_orders(line: str, order: tuple[Any, ...]) -> None:
    desk = Desk()
    await desk.type(line)
    assert desk.arbiter.orders == [order]
    assert desk.said == []


async def test_refusals_are_said() -> None:
    desk = Desk(people=())
    await desk.type("finish", "resign", "takeback soon", "Nf3", "mode chess", "help")
    assert desk.said == [
        "The game is not paused. Pause it first.",
        "You play neither side. Take the side to move with: mode play",
        "'soon' is no number of half-moves. Say `takeback` or `takeback 2`.",
        "It is not Person's turn, so 'Nf3' cannot be played. Wait until the other side has moved.",
        "Say `mode play`, `mode watch` or `mode replay [FILE.pgn [GAME]]`.",
        HELP,
    ]


async def test_a_person_alone_speaks_for_its_own_colour_and_two_for_the_side_to_move() -> None:
    black = Desk(people=(False,))
    await black.type("resign")
    assert black.arbiter.orders == [("resign", chess.BLACK)]
    both = Desk(people=(True, False))
    await both.type("resign")
    assert both.arbiter.orders == [("resign", chess.WHITE)]


async def test_a_move_is_submitted_and_a_wrong_one_explained() -> None:
    desk = Desk()
    asking = await desk.asked()
    await desk.type("Ke2", "nf3")
    assert "'Ke2' is illegal" in desk.said[0]
    assert (await asking).move == chess.Move.from_uci("g1f3")


async def test_modes_and_speeds(tmp_path: Path) -> None:
    file = tmp_path / "My Games.pgn"
    file.write_text('1. e4 *\n\n[Event "two"]\n\n1. d4 *\n')
    desk = Desk()
    await desk.type("mode play", "mode watch", "mode replay", f"mode replay {file} 2", f"mode replay {file}")
    assert [request.mode for request in desk.swapped] == [Mode.PLAY, Mode.WATCH, *[Mode.REPLAY] * 3]
    assert desk.swapped[0].person_plays is chess.WHITE
    firsts = [request.score and request.score.moves[0].uci() for request in desk.swapped[2:]]
    assert firsts == [None, "d2d4", "e2e4"]
    await desk.type("speed 20", "speed")
    assert desk.speeds == ["20", ""]


async def test_a_question_takes_the_next_line_even_an_empty_one() -> None:
    desk = Desk()
    for line in ("", "pause"):
        question = asyncio.ensure_future(desk.answers.ask(Question("Is it there?")))
        await desk.answers.wanted.wait()
        assert desk.commander.prompt() == "Your answer: "
        await desk.type(line)
        assert await question == line
    assert desk.said == ["Is it there? Press Enter when it is done."] * 2
    assert desk.arbiter.orders == []


@pytest.mark.parametrize(("line", "agreed"), [("yes", True), ("Y", True), ("no", False), ("pause", False)])
async def test_a_draw_offer_is_answered(line: str, agreed: bool) -> None:
    desk = Desk()
    offer = asyncio.ensure_future(desk.person.answer_draw(chess.Board()))
    await desk.person.wanted.wait()
    assert desk.commander.prompt() == "A draw is offered. Agree (y/n)? "
    await desk.type(line)
    assert await offer is agreed


async def test_the_prompt_says_what_is_wanted() -> None:
    desk = Desk()
    assert desk.commander.prompt() == "(help, pause, quit) > "
    asking = await desk.asked()
    assert desk.commander.prompt() == "Your move, White: "
    desk.arbiter.left[chess.WHITE] = 275.9
    assert desk.commander.prompt() == "Your move, White (4:35): "
    desk.arbiter.left.clear()
    desk.arbiter.paused = True
    assert desk.commander.prompt() == "Paused (resume, finish). Your move, White: "
    asking.cancel()
    await asyncio.gather(asking, return_exceptions=True)
    assert desk.commander.prompt() == "Paused (resume, finish) > "
    desk.arbiter.state.ended = "1-0"
    assert desk.commander.prompt() == ""


async def test_a_script_waits_for_its_turn() -> None:
    desk = Desk(patient=True)
    obeying = asyncio.ensure_future(desk.commander.obey(typed(["pause", "e4", "e5", END_OF_INPUT])))
    asking = await desk.asked()
    assert (await asking).move == chess.Move.from_uci("e2e4")
    assert desk.arbiter.orders == [("pause",)]
    assert not obeying.done()
    desk.arbiter.state.board.push_san("e4")
    asking = await desk.asked()
    assert (await asking).move == chess.Move.from_uci("e7e5")
    last = await desk.asked()
    with pytest.raises(OperatorNeededError, match="Standard input has ended.*Black is to move"):
        await obeying
    last.cancel()
    await asyncio.gather(last, return_exceptions=True)


async def test_a_turn_that_was_over_at_once_takes_no_line_of_a_script() -> None:
    """A move seen on the board ends a turn whenever it likes."""
    desk = Desk(patient=True)
    obeying = asyncio.ensure_future(desk.commander.obey(typed(["Nf3"])))
    for _ in range(5):
        await asyncio.sleep(0)
    desk.person.wanted.set()
    desk.person.wanted.clear()
    for _ in range(5):
        await asyncio.sleep(0)
    assert desk.said == []
    assert (await (await desk.asked())).move == chess.Move.from_uci("g1f3")
    await obeying


async def test_a_question_that_nobody_can_answer_ends_the_game() -> None:
    desk = Desk()
    question = asyncio.ensure_future(desk.answers.ask(Question("Is the king in the gripper?", "yes_no")))
    with pytest.raises(OperatorNeededError, match="Is the king in the gripper"):
        await desk.commander.obey(typed([END_OF_INPUT]))
    question.cancel()
    await asyncio.gather(question, return_exceptions=True)


def test_every_word_completes() -> None:
    words = Desk().commander.words
    assert {"pause", "resume", "finish", "mode watch", "quit", "help", "speed", "stop"} <= set(words)
