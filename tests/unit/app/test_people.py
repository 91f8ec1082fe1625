"""Who lends a hand: the operator in words, the virtual person by deeds, and the journal of both."""

import asyncio
from typing import Any, cast

import chess
import pytest

from kempelen.app.people import Answers, Helpful, Operator, Question, VirtualPerson
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.table import Table
from kempelen.game.records import Helped, Record
from kempelen.twin.client import TwinControl

TABLE = Table()
QUEEN, ROOK = chess.Piece.from_symbol("Q"), chess.Piece.from_symbol("r")
A1, A8, SLOT = Place("a1"), Place("a8"), Place("left1")


class Asked:
    """Answers every question alike."""

    def __init__(self, answer: str = "") -> None:
        self.questions: list[str] = []
        self._answer = answer

    async def __call__(self, question: Question) -> str:
        self.questions.append(str(question))
        return self._answer


async def test_the_operator_is_told_what_to_do() -> None:
    asked = Asked()
    operator = Operator(asked)
    await operator.carry([Transfer(ROOK, A8, SLOT)])
    await operator.supply(QUEEN, SLOT, "The trays hold no white queen.")
    await operator.remove(ROOK, A8, "It is in the way.")
    await operator.put_right("Put the white queen back on a1.")
    assert asked.questions == [
        "Move the black rook from a8 to left1. Press Enter when it is done.",
        "The trays hold no white queen. Stand a white queen on left1. Press Enter when it is done.",
        "It is in the way. Take the black rook off a8. Press Enter when it is done.",
        "Put the white queen back on a1. Press Enter when it is done.",
    ]


@pytest.mark.parametrize(("answer", "holds"), [("y", True), (" Yes ", True), ("n", False), ("", False)])
async def test_only_a_yes_means_that_the_gripper_holds_it(answer: str, holds: bool) -> None:
    assert await Operator(Asked(answer)).is_holding(QUEEN) is holds


class Twin:
    """A twin's side door: where pieces stand, and what was asked."""

    def __init__(self, **places: str) -> None:
        self.places = {Place(name): symbol for name, symbol in places.items()}
        self.tool = [0.0, 0.0, 200.0]
        self.hanging: list[dict[str, Any]] = []
        self.deeds: list[tuple[str, dict[str, Any]]] = []

    def _piece(self, place: Place, symbol: str) -> dict[str, Any]:
        x, y, z = TABLE.centre(place)
        return {"kind": symbol.upper(), "white": symbol.isupper(), "x": x + 1.0, "y": y, "z": z}

    async def ask(self, op: str, **how: Any) -> dict[str, Any]:
        if op != "truth":
            self.deeds.append((op, how))
        standing = [self._piece(place, symbol) for place, symbol in self.places.items()]
        return {"pieces": standing + self.hanging, "tool": self.tool}


def at(place: Place) -> list[float]:
    x, y, _ = TABLE.centre(place)
    return [float(x), float(y)]


def person(twin: Twin, layout: dict[Place, chess.Piece] | None = None) -> VirtualPerson:
    return VirtualPerson(TABLE, cast("TwinControl", twin), lambda: Layout(layout or {}))


async def test_the_virtual_person_moves_what_has_not_moved_yet() -> None:
    twin = Twin(left1="r", a1="Q")
    await person(twin).carry([Transfer(ROOK, A8, SLOT), Transfer(QUEEN, A1, A8)])
    assert twin.deeds == [("carry", {"from": at(A1), "to": at(A8)})]  # the rook is there already


async def test_the_virtual_person_brings_and_takes_away_once() -> None:
    twin = Twin(a8="r")
    helper = person(twin)
    await helper.supply(QUEEN, SLOT, "")
    await helper.supply(ROOK, A8, "")
    await helper.remove(ROOK, A8, "")
    await helper.remove(QUEEN, A8, "")
    assert twin.deeds == [
        ("supply", {"kind": "Q", "white": True, "to": at(SLOT)}),
        ("remove", {"from": at(A8)}),
    ]


async def test_the_virtual_person_puts_a_stray_piece_right() -> None:
    twin = Twin(b3="Q", a8="r")
    await person(twin, {A1: QUEEN, A8: ROOK}).put_right("The white queen is not on a1.")
    x, y = at(Place("b3"))
    assert twin.deeds == [("carry", {"from": [x + 1.0, y], "to": at(A1)})]


async def test_the_virtual_person_does_not_rob_another_place() -> None:
    """Two black rooks are missing one: the one that stands right stays."""
    twin = Twin(a8="r")
    await person(twin, {A8: ROOK, A1: ROOK}).put_right("The rook is not on a1.")
    assert twin.deeds == []


async def test_the_virtual_person_sees_what_hangs_in_the_gripper() -> None:
    twin = Twin()
    twin.tool = [100.0, 50.0, 120.0]
    helper = person(twin)
    assert not await helper.is_holding(QUEEN)
    twin.hanging = [{"kind": "Q", "white": True, "x": 101.0, "y": 50.0, "z": 80.0}]
    assert await helper.is_holding(QUEEN)
    assert not await helper.is_holding(ROOK)
    twin.tool = [100.0, 50.0, 30.0]  # below its foot
    assert not await helper.is_holding(QUEEN)


async def test_every_help_but_a_players_own_move_is_written_down() -> None:
    written: list[Record] = []
    helpful = Helpful(Operator(Asked("y")), written.append)
    await helpful.carry([Transfer(QUEEN, A1, A8)])
    assert written == []
    await helpful.supply(QUEEN, SLOT, "")
    await helpful.remove(ROOK, A8, "")
    await helpful.put_right("Put it back.")
    assert await helpful.is_holding(QUEEN)
    assert [record.how for record in written if isinstance(record, Helped)] == [
        "brought the white queen to left1",
        "took the black rook off a8",
        "Put it back.",
        "saw the white queen in the gripper",
    ]


async def test_answers_wait_for_a_line_and_for_nothing_else() -> None:
    said: list[str] = []
    answers = Answers(said.append)
    answers.answer("nobody asked")
    asking = asyncio.ensure_future(answers.ask(Question("Ready?", "yes_no")))
    await answers.wanted.wait()
    assert (answers.waiting, answers.question, said) == (True, "Ready? (y/n)", ["Ready? (y/n)"])
    answers.answer("yes")
    answers.answer("no")  # too late
    assert await asking == "yes"
    assert (answers.waiting, answers.question, answers.wanted.is_set()) == (False, "", False)


async def test_a_question_that_is_dropped_waits_no_more() -> None:
    answers = Answers(lambda _: None)
    asking = asyncio.ensure_future(answers.ask(Question("Ready?", "yes_no")))
    await answers.wanted.wait()
    asking.cancel()
    await asyncio.gather(asking, return_exceptions=True)
    assert not answers.waiting
