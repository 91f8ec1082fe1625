"""Games on the reed board in physics: a virtual hand lifts and sets pieces, their magnets close switches."""

import asyncio
from pathlib import Path
from typing import Any

import chess
import pytest

from kempelen.app.cast import GameRequest
from kempelen.app.people import VirtualPerson
from kempelen.core.places import Place
from kempelen.game.board_person import BoardPerson
from kempelen.game.modes import Mode
from kempelen.testing.live import Stage

pytestmark = pytest.mark.physics

FORCED = "kn6/3Q4/5p1p/2p2P1P/2P1p3/1R2P3/PP2BPP1/4K2R w K - 0 1"
"""After a capture on b8 Black can only take back, and after castling only go to a8: no engine spoils it."""
TWO_VICTIMS = "k7/8/8/3p3p/8/8/5PPP/3Q2K1 w - - 0 1"


def felt(
    folder: Path, fen: str = chess.STARTING_FEN, sensor: str = "reed", person: chess.Color = chess.WHITE
) -> Stage:
    request = GameRequest(Mode.PLAY, fen, person_plays=person)
    return Stage(folder, request, sensor__kind=sensor, play__hands="person")


async def by_hand(stage: Stage, source: str, target: str, **manner: object) -> None:
    """The hand takes what stands on a square to another one, and says nothing."""
    table = stage.live.session.table
    where: dict[str, Any] = {
        "from": table.centre(Place(source))[:2].tolist(), "to": table.centre(Place(target))[:2].tolist()
    }  # fmt: skip
    await stage.control.ask("carry", **where, **manner)


async def taken_off(stage: Stage, square: str) -> None:
    """The hand puts what stands there beside the board."""
    table = stage.live.session.table
    x, y = table.centre(Place(square))[:2].tolist()
    away = (table.robot_from_board @ [4 * table.square, -1.2 * table.square, 0.0])[:2].tolist()
    await stage.control.ask("carry", **{"from": [x, y], "to": away})


async def shows(stage: Stage, *squares: str) -> None:
    """Until these squares are lit, and no others."""
    async with asyncio.timeout(30):
        while (await stage.control.ask("reed"))["lit"] != list(squares):
            pass


async def ends_well(stage: Stage) -> None:
    await stage.arbiter.resign(chess.WHITE)
    report = await stage.report()
    assert await stage.wrong() == []
    assert (report.interventions, report.disagreements) == (0, [])


async def test_captures_and_castling_are_felt(tmp_path: Path) -> None:
    async with felt(tmp_path, FORCED) as stage:
        stage.play()
        await stage.type("Rxb8+")
        await stage.cue("1. Rxb8+ by hand")
        await stage.cue("1... Kxb8")
        await stage.type("O-O")
        await stage.cue("2. O-O by hand")
        await stage.cue("2... Ka8")
        person = stage.live.cast.person
        assert isinstance(person, BoardPerson)
        await ends_well(stage)
        assert person.answered == 0


async def test_only_the_order_tells_which_of_two_was_taken(tmp_path: Path) -> None:
    """Both pawns' squares stay occupied; the hand touches nothing but the queen's victim, and slides home."""
    async with felt(tmp_path, TWO_VICTIMS) as stage:
        stage.play()
        await stage.wanted()
        await taken_off(stage, "h5")
        await by_hand(stage, "d1", "h5", slide=True)
        await stage.cue("1. Qxh5 by hand")
        await stage.arbiter.resign(chess.WHITE)
        await stage.report()


async def test_what_stands_wrong_is_told_and_lit_and_waited_for(tmp_path: Path) -> None:
    """Before the robot begins, and after an impossible move; nothing is believed meanwhile."""
    async with felt(tmp_path, person=chess.BLACK) as stage:
        assert isinstance(stage.live.person, VirtualPerson)
        await by_hand(stage, "e2", "e3")
        stage.play()
        await stage.cue("E2 is empty, a white piece stands on e3.")
        await shows(stage, "e2", "e3")
        assert (await stage.control.ask("reed"))["sounds"] == ["warn"]
        assert not stage.live.board.move_stack
        await by_hand(stage, "e3", "e2")
        await stage.cue("1. ")
        await stage.wanted()
        await by_hand(stage, "b8", "b5")
        await stage.cue("That is no legal move: the knight cannot go from b8 to b5")
        await shows(stage, "b5", "b8")
        await by_hand(stage, "b5", "b8")
        await by_hand(stage, "b8", "c6")
        await stage.cue("1... Nc6 by hand")
        await shows(stage)
        await stage.arbiter.resign(chess.BLACK)
        await stage.report()
        assert await stage.wrong() == []


async def test_damaged_bytes_and_a_stuck_switch(tmp_path: Path) -> None:
    """Lines are lost and asked for again; the switch of e2 does not open, which is asked once and named."""
    async with felt(tmp_path) as stage:
        stage.play()
        await stage.wanted()
        await stage.control.ask("reed", damage=0.002, loss=0.02)
        await stage.type("d4")
        await stage.cue("1. d4 by hand")
        await stage.cue("1... ")
        await stage.wanted()
        await stage.control.ask("reed", stuck_closed=["e2"])
        await stage.type("e3")
        await stage.cue("2. e3")
        await stage.cue("The switch of e2 is stuck closed")
        await stage.arbiter.resign(chess.WHITE)
        await stage.report()
        reed = stage.live.require_eyes().reed
        assert reed is not None
        assert reed.board.damaged > 0
        assert [fault.kind for fault in reed.reading.faults.named] == ["stuck closed"]


@pytest.mark.soak
async def test_camera_and_reed_board_together_and_each_alone(tmp_path: Path) -> None:
    """The board's cable is pulled in mid-game: the camera goes on alone, until the board is back."""
    async with felt(tmp_path, sensor="camera,reed") as stage:
        stage.play()
        await stage.type("e4")
        await stage.cue("1. e4 by hand")
        await stage.cue("1... ")
        await stage.wanted()
        await stage.control.ask("reed", unplug=True)
        await stage.cue("The reed board is left out")
        await stage.type("d4")
        await stage.cue("2. d4 by hand")
        await stage.cue("2... ")
        await stage.control.ask("reed", unplug=False)
        await stage.cue("The reed board counts again")
        await stage.type(next(iter(stage.live.board.legal_moves)).uci())
        await stage.cue("3. ")
        await stage.arbiter.resign(chess.WHITE)
        report = await stage.report()
        assert await stage.wrong() == []
        assert report.disagreements == []
