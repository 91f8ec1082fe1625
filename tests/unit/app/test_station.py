"""The station at a gantry in memory: what it does, and what it refuses, in each of its states."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path

import chess
import pytest
import pytest_asyncio

from kempelen.app.cast import GameRequest
from kempelen.app.station import Station
from kempelen.app.station_types import Change, GameOptions, Phase
from kempelen.core import events
from kempelen.core.errors import (
    BusyError,
    ConfigError,
    GameError,
    JournalError,
    KempelenError,
    LinkError,
    NotHomedError,
    StoppedError,
)
from kempelen.core.protocols import RobotPhase
from kempelen.game.clock import TimeControl
from kempelen.game.modes import Mode
from kempelen.testing.stations import MemoryStation

PLAY = GameRequest(Mode.PLAY)


@pytest_asyncio.fixture
async def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[MemoryStation]:
    async with MemoryStation(tmp_path, monkeypatch) as table:
        yield table


def remedies(table: MemoryStation) -> list[str | None]:
    return [fault.remedy for fault in table.station.faults]


async def mend(station: Station, remedy: str | None) -> None:
    """Press the button."""
    match remedy:
        case "recover":
            await station.recover()
        case "home":
            await station.home()
        case "resume_game":
            await station.resume_game()


# --- up and down --------------------------------------------------------------------------------------------


async def test_off_connected_homed_and_off_again(table: MemoryStation) -> None:
    station = table.station
    assert (station.phase, station.faults, station.robot.phase) == (Phase.OFF, (), RobotPhase.DISCONNECTED)
    await station.connect("gantry", "memory")
    assert (station.phase, remedies(table), station.busy) == (Phase.READY, ["home"], "")
    assert station.config.robot.port == "memory"
    await station.home()
    assert (station.robot.homed, station.faults, await station.truth()) == (True, (), None)
    await station.disconnect()
    assert (station.phase, station.session) == (Phase.OFF, None)
    assert {Change.STATION, Change.ROBOT} <= set(table.changes)


async def test_a_line_that_is_let_go_of_is_no_trouble_to_be_told(table: MemoryStation) -> None:
    station, shown = table.station, list[tuple[RobotPhase, str]]()
    await station.connect("gantry", "memory")
    session = station.require_session()
    station.listen(lambda _: shown.append((station.robot.phase, station.robot.message)))
    await station.begin(PLAY)
    assert "was closed" in session.robot.state.message
    assert (RobotPhase.DISCONNECTED, "") in shown
    assert not any("was closed" in message for _, message in shown)


REFUSED: dict[type[KempelenError], list[Callable[[Station], Awaitable[object]]]] = {
    LinkError: [
        lambda station: station.home(),
        lambda station: station.recover(),
        lambda station: station.calibration_begin(),
        lambda station: station.jog("me", (1, 0, 0), 10),
        lambda station: station.hand_carry((0, 0), (1, 1)),
    ],
    GameError: [
        lambda station: station.rematch(swapped=False),
        lambda station: station.pause(),
        lambda station: station.resume(),
        lambda station: station.finish(),
        lambda station: station.takeback(),
        lambda station: station.resign(),
        lambda station: station.offer_draw(),
        lambda station: station.bumped(),
        lambda station: station.swap_mode(PLAY),
        lambda station: station.move("e4"),
        lambda station: station.leave_game(),
        lambda station: station.answer("p1", "yes"),
        lambda station: station.calibration_touch("a1"),
        lambda station: station.calibration_by_camera(),
        lambda station: station.calibration_apply(),
        lambda station: station.calibration_cancel(),
        lambda station: station.record(on=True),
        lambda station: station.set_eye_parameter("gain", 1.0),
    ],
    JournalError: [lambda station: station.resume_game()],
    ConfigError: [
        lambda station: station.connect("crane", "memory"),
        lambda station: station.set_eyes(on=True),
        lambda station: station.set_speed(2),
        lambda station: station.begin(PLAY, GameOptions(move_time=-1)),
    ],
}


async def test_what_is_refused_without_a_robot(table: MemoryStation) -> None:
    for error, commands in REFUSED.items():
        for command in commands:
            with pytest.raises(error) as refused:
                await command(table.station)
            assert refused.value.hint
    await table.station.stop()
    assert (table.station.phase, table.station.unfinished) == (Phase.OFF, None)
    assert await table.station.record(on=False) == ""


async def test_a_robot_that_does_not_answer_is_a_fault(
    table: MemoryStation, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise LinkError("Nobody is there.")

    with monkeypatch.context() as patched:
        patched.setattr("kempelen.app.table_session.make_robot", broken)
        with pytest.raises(LinkError):
            await table.station.connect("gantry", "memory")
    assert (table.station.phase, remedies(table)) == (Phase.OFF, ["connect"])
    await table.station.connect("gantry", "memory")
    table.rig.unplug()
    await table.until(lambda: remedies(table) == ["connect"])
    await table.station.connect("gantry", "memory")
    assert remedies(table) == ["home"]


async def test_one_thing_at_a_time(table: MemoryStation) -> None:
    station = table.station
    await station.connect("gantry", "memory")
    homing = asyncio.create_task(station.home())
    await table.until(lambda: station.busy)
    for command in (station.home, lambda: station.begin(PLAY), lambda: station.jog("me", (1, 0, 0), 10)):
        with pytest.raises(BusyError, match="Homing"):
            await command()
    homing.cancel()  # whoever asked has gone
    await asyncio.gather(homing, return_exceptions=True)
    await table.until(lambda: station.robot.homed and not station.busy)


async def test_closing_breaks_off_homing(table: MemoryStation) -> None:
    await table.station.connect("gantry", "memory")
    homing = asyncio.create_task(table.station.home())
    await table.until(lambda: table.station.robot.phase is RobotPhase.HOMING)
    await table.station.aclose()
    with pytest.raises(StoppedError):
        await homing
    assert table.station.phase is Phase.OFF


# --- games --------------------------------------------------------------------------------------------------


async def test_a_game_from_its_beginning_to_its_end_and_the_next_one(table: MemoryStation) -> None:
    station = table.station
    number = await station.begin(PLAY, GameOptions(level="full", clock=TimeControl(600, 5)))
    assert (number, station.phase, table.live.arbiter.game) == (1, Phase.PLAYING, 1)
    with pytest.raises(GameError, match="being played"):
        await station.begin(PLAY)
    await table.asked()
    with pytest.raises(GameError, match="chosen after 3 half-moves, and 0"):
        await station.move("e2e4", 3)
    assert (await station.move("e2e4", 0)).uci() == "e2e4"
    with pytest.raises(GameError, match="not your turn"):
        await station.move("d2d4")
    await table.asked()
    assert station.clock is not None
    assert station.clock.white > 600
    with pytest.raises(KempelenError, match="illegal|no legal"):
        await station.move("e4e6")
    await station.resign()
    await table.until(lambda: station.phase is Phase.READY)
    assert (station.report and station.report.result, station.faults, station.unfinished) == ("0-1", (), None)
    assert table.live.board.move_stack[0].uci() == "e2e4"
    assert any(isinstance(event, events.GameOver) for event in table.seen)
    assert await station.begin(PLAY) == 2
    assert [station.report, station.clock, station.again] == [None, None, False]


async def test_a_rematch_has_the_same_clock_and_the_other_colour(table: MemoryStation) -> None:
    station = table.station
    await station.begin(PLAY, GameOptions(level="full", clock=TimeControl(600, 5)))
    with pytest.raises(GameError, match="being played"):
        await station.rematch(swapped=True)
    await station.resign()
    await table.until(lambda: station.again)
    for swapped, people in ((True, (chess.BLACK,)), (False, (chess.BLACK,)), (True, (chess.WHITE,))):
        await station.rematch(swapped=swapped)
        assert table.live.arbiter.pairing.people == people
        assert station.clock is not None
        await station.resign()
        await table.until(lambda: station.again)
    assert table.live.arbiter.game == 4


async def test_the_robot_sets_the_board_up_again(table: MemoryStation) -> None:
    station = table.station
    await station.begin(PLAY)
    await table.asked()
    await station.move("e4")
    await table.until(lambda: len(table.live.board.move_stack) >= 2)
    with pytest.raises(GameError, match="being played"):
        await station.set_up(chess.STARTING_FEN, "last")
    await station.resign()
    await table.until(lambda: station.report is not None)
    asked = station.again
    assert await station.set_up(chess.STARTING_FEN, "last") == 2
    await table.until(lambda: station.report is not None)
    report = station.report
    assert report is not None
    assert (report.game, report.plies, report.interventions) == (2, 0, 0)
    assert report.transfers >= 2
    state = table.live.arbiter.state
    assert state.layout.board_part() == chess.Board().piece_map()
    assert station.again == asked  # what can be played again is the game, not this
    with pytest.raises(JournalError, match="has no game 9"):
        await station.set_up(chess.STARTING_FEN, "9")


async def test_left_in_a_pause_and_resumed(table: MemoryStation) -> None:
    station = table.station
    await station.begin(PLAY)
    await table.asked()
    await station.move("e4")
    await table.until(lambda: table.live.arbiter.moving)
    await station.pause()
    with pytest.raises(GameError, match="A move is in hand"):
        await station.jog("me", (1, 0, 0), 10)
    with pytest.raises(GameError, match="at work"):
        await station.home()
    await station.leave_game()
    assert (station.phase, station.live, station.unfinished) == (Phase.READY, None, 1)
    assert await station.resume_game() == 1
    await table.asked()
    assert station.live is not None
    assert station.live.board.ply() == 2
    await station.takeback()
    assert station.live.board.ply() == 0
    await station.swap_mode(GameRequest(Mode.PLAY, person_plays=chess.BLACK))
    assert await station.offer_draw() is False


async def test_a_game_that_cannot_be_set_up_leaves_the_table_as_it_was(table: MemoryStation) -> None:
    station = table.station
    await station.connect("gantry", "memory")
    with pytest.raises(KempelenError):
        await station.begin(PLAY, GameOptions(engine="/nowhere/engine"))
    assert (station.phase, station.live, remedies(table)) == (Phase.READY, None, ["home"])
    with pytest.raises(ConfigError, match="move_time"):
        await station.begin(PLAY, GameOptions(move_time=-1))
    with pytest.raises(JournalError):
        await station.resume_game(7)
    assert station.phase is Phase.READY


# --- e-stop -------------------------------------------------------------------------------------------------


async def test_an_e_stop_ends_the_game_and_its_faults_lead_back_to_it(table: MemoryStation) -> None:
    station = table.station
    await station.begin(PLAY)
    await table.asked()
    await station.move("e4")
    await table.until(lambda: station.robot.phase is RobotPhase.MOVING)
    stopping = asyncio.create_task(station.stop())
    sent = len(table.rig.coupling.sent)
    await asyncio.sleep(0)  # one turn of the loop: it is on the wire
    assert b"\x18" in table.rig.coupling.sent[sent:]
    await stopping
    await table.until(lambda: station.phase is Phase.READY)
    taken: list[str | None] = []
    while (offered := remedies(table)) and len(taken) < 5:
        taken += offered
        await mend(station, offered[0])
    assert taken[-2:] == ["home", "resume_game"]
    await table.asked()
    assert table.live.board.ply() == 2


async def test_an_e_stop_while_a_game_is_set_up_keeps_it_from_beginning(table: MemoryStation) -> None:
    station = table.station
    await station.connect("gantry", "memory")
    beginning = asyncio.create_task(station.begin(PLAY))
    await table.until(lambda: station.phase is Phase.STARTING)
    await station.stop()
    with pytest.raises(StoppedError):
        await beginning
    assert (station.live, station.unfinished) == (None, None)


# --- jogging ------------------------------------------------------------------------------------------------


async def test_jogging_belongs_to_one_client_and_stops_when_it_goes_away(table: MemoryStation) -> None:
    station = table.station
    await station.connect("gantry", "memory")
    with pytest.raises(NotHomedError):
        await station.jog("anna", (1, 0, 0), 20)
    await station.home()
    await station.jog("anna", (-1, 0, 0), 20)
    await table.until(lambda: station.robot.phase is RobotPhase.JOGGING)
    with pytest.raises(BusyError, match="Somebody else"):
        await station.jog("ben", (0, -1, 0), 20)
    await station.jog_stop("ben")
    await station.owner_left("ben")
    phases = [station.robot.phase]
    await station.owner_left("anna")
    phases.append(station.robot.phase)
    await station.jog("ben", (0, -1, 0), 20)
    await station.jog_stop("ben")
    phases.append(station.robot.phase)
    assert phases == [RobotPhase.JOGGING, RobotPhase.IDLE, RobotPhase.IDLE]


async def test_jogging_in_a_paused_game_and_on_from_there(table: MemoryStation) -> None:
    station = table.station
    await station.begin(PLAY)
    await table.asked()
    with pytest.raises(GameError, match="Pause it first"):
        await station.jog("anna", (0, 0, -1), 50)
    await station.pause()
    await station.jog("anna", (0, 0, -1), 50)
    await table.until(lambda: station.robot.phase is RobotPhase.JOGGING)
    await station.resume()
    assert station.robot.reported_position is not None
    assert station.robot.reported_position[2] == pytest.approx(table.rig.space.upper[2])
    await station.move("e4")
    await table.asked()


# --- prompts ------------------------------------------------------------------------------------------------


async def test_the_person_at_the_table_is_asked_in_a_prompt(table: MemoryStation) -> None:
    station = table.station
    fen = "4k3/P7/8/8/8/8/8/4K3 w - - 0 1"
    await station.begin(GameRequest(Mode.PLAY, fen), GameOptions(hands="person"))
    await table.asked()
    await station.move("e1e2")
    await table.until(lambda: station.prompts)
    (prompt,) = station.prompts
    assert (prompt.kind, str(prompt.place), prompt.text) == ("do", "e2", "Move the white king from e1 to e2.")
    assert Change.PROMPTS in table.changes
    with pytest.raises(GameError, match="not open"):
        await station.answer("p99", "done")
    await station.answer(prompt.id, "done")
    await table.until(lambda: table.live.board.ply() >= 1)
    assert station.prompts == ()


async def test_closing_does_not_wait_for_a_person_who_is_asked(table: MemoryStation) -> None:
    station = table.station
    await station.begin(PLAY, GameOptions(hands="person"))
    await table.asked()
    await station.move("e2e4")
    await table.until(lambda: station.prompts)
    measuring = asyncio.create_task(station.calibration_begin())
    await table.until(lambda: table.live.arbiter.paused)
    await station.aclose()
    with pytest.raises(StoppedError):
        await measuring
    assert (station.prompts, station.unfinished) == ((), 1)
