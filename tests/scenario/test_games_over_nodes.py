"""One game, three places for its robot: in this process, in another one, in another network namespace.

The link is cut, delayed, reordered and healed while a piece is being carried. What people read, the journal
and the true table are the same as if nothing had happened.
"""

import asyncio
import contextlib
import random
import shutil
import subprocess
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import chess
import pytest

from kempelen.app.narrate import sentence
from kempelen.core import events
from kempelen.core.protocols import Checkpoint
from kempelen.core.table import Table, start_layout
from kempelen.game.arbiter import Arbiter
from kempelen.game.journal import Journal
from kempelen.game.modes import Pairing
from kempelen.game.opening import new_game
from kempelen.game.pgn import GameScore
from kempelen.nodes.link import Link
from kempelen.nodes.local_link import LocalNet, Weather
from kempelen.nodes.remote_robot import RemoteRobot, Waits
from kempelen.nodes.robot_node import Patience, RobotNode
from kempelen.nodes.zenoh_link import Network, ZenohLink
from kempelen.robots.hand import CartesianHand
from kempelen.testing.elsewhere import Elsewhere, free_endpoint
from kempelen.testing.foul_links import Foul, Wire, Yonder
from kempelen.testing.node_process import told_of
from kempelen.twin.light import LightRobot, LightTable

FEN = "r3k2r/8/8/3p4/4P3/8/5P2/R3K2R w KQkq - 0 1"
MOVES = ("exd5", "O-O", "O-O-O", "Rxf2")
CARRIES = 8  # a victim and a pawn, king and rook twice, a victim and a rook
AT = 2  # the carry in whose middle the link fails: the pawn's, whose victim has just gone
PACE, SLOW, REST_S, BEAT_S = 20.0, 1.0, 0.12, 0.03


class Told(Protocol):
    """What became of the robot's table; and its pace from now on."""

    async def __call__(self, pace: float | None = None) -> dict[str, Any]:
        """Look, and set."""
        ...


Fault = Callable[[Told], Awaitable[None]]


@dataclass
class Place:
    """Where the robot is: a way there, and what has become of its table."""

    link: Link
    told: Told


@dataclass
class Played:
    """What came of the game."""

    trace: list[str] = field(default_factory=list)
    moves: list[str] = field(default_factory=list)
    truth: dict[str, Any] = field(default_factory=dict)


def score() -> GameScore:
    board = chess.Board(FEN)
    return GameScore({}, FEN, tuple(board.push_san(san) for san in MOVES))


async def fair(_told: Told) -> None:
    """Nothing happens."""


async def play(place: Place, folder: Path, fault: Fault = fair) -> Played:
    """The whole game; the fault comes in the middle of a carry."""
    played, carries, faults = Played(), 0, list[asyncio.Task[None]]()
    gripped = asyncio.Event()  # of that carry: before, it may hold its piece already while the grip ends

    async def in_mid_move(told: Told) -> None:
        await told(SLOW)
        await gripped.wait()
        await until_it_is("moving", told)
        await fault(told)
        await told(PACE)

    def hear(event: events.Event) -> None:
        nonlocal carries
        if isinstance(event, events.CheckpointReached | events.MoveCommitted):
            played.trace.append(sentence(event))
        if isinstance(event, events.CheckpointReached) and event.checkpoint is Checkpoint.GRIPPING:
            carries += 1
            if carries == AT:
                faults.append(asyncio.ensure_future(in_mid_move(place.told)))
        elif isinstance(event, events.CheckpointReached) and carries == AT:
            gripped.set()

    table = Table()
    async with asyncio.timeout(120), RemoteRobot(place.link, "one", waits=Waits(beat=BEAT_S)) as robot:
        pairing = Pairing.replay(score())
        with Journal(folder / "journal.sqlite3") as journal:
            log = new_game(journal, pairing, table, start_fen=FEN)
            arbiter = Arbiter(log, CartesianHand(robot, table), pairing, table)
            arbiter.events.listen(hear)
            await arbiter.run()
            await asyncio.gather(*faults)
    with Journal(folder / "journal.sqlite3") as journal:
        state = journal.state(1)
    board = chess.Board(FEN)
    played.moves = [board.san_and_push(move) for move in state.board.move_stack]
    played.truth = await place.told()
    standing = {str(spot): piece.symbol() for spot, piece in state.layout.items()}
    assert played.truth["pieces"] == standing
    return played


@asynccontextmanager
async def in_this_process(weather: Weather) -> AsyncIterator[Place]:
    table, net = Table(), LocalNet(weather)
    world = LightTable(table, start_layout(table, chess.Board(FEN)))
    async with AsyncExitStack() as stack:
        link = await stack.enter_async_context(net.join())
        robot = await stack.enter_async_context(LightRobot(table, world, pace=PACE))
        await stack.enter_async_context(RobotNode(robot, link, "one", patience=Patience(rest=REST_S)))

        async def told(pace: float | None = None) -> dict[str, Any]:
            robot.pace = pace or robot.pace
            return told_of(world, robot)

        yield Place(await stack.enter_async_context(net.join()), told)


@asynccontextmanager
async def in_another_process(
    endpoint: str, *before: str, via: str = "", weather: Weather | None = None
) -> AsyncIterator[Place]:
    """``before``: words before its command; ``via``: another endpoint that leads there."""
    wanted = {"listen": [endpoint], "pace": PACE, "fen": FEN, "patience": {"rest": REST_S}}
    async with Elsewhere(before, **wanted) as there:
        own = free_endpoint()
        network = Network(connect=(via or endpoint,), listen=(own,), discover=False)
        async with ZenohLink(network) as link:
            yield Place(Foul(link, weather or Weather()), there.told)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Played:
    """The game on a fair day."""

    async def run() -> Played:
        async with in_this_process(Weather()) as place:
            return await play(place, tmp_path_factory.mktemp("fair"))

    return asyncio.run(run())


def test_the_game_itself(undisturbed: Played) -> None:
    assert undisturbed.moves == list(MOVES)
    assert undisturbed.truth["faults"] == []
    assert undisturbed.truth["carried"] == CARRIES
    assert undisturbed.truth["held"] == ""


async def until_it_is(phase: str, told: Told) -> None:
    """With a piece in its gripper."""
    async with asyncio.timeout(20):
        while (truth := await told())["phase"] != phase or not truth["held"]:  # noqa: ASYNC110 - elsewhere
            await asyncio.sleep(0.005)


async def held_with_its_piece(told: Told) -> None:
    """The robot comes to rest by itself, and keeps what it holds."""
    await until_it_is("held", told)


def foul_for_a_while(kind: str, weather: Weather) -> Fault:
    """A fault that passes."""

    async def fault(_told: Told) -> None:
        match kind:
            case "delayed":
                weather.delay = (0.2, 0.4)
            case "reordered":
                weather.delay = (0.0, 0.4)
            case _:
                weather.loss, weather.twice = 0.4, 0.4
        await asyncio.sleep(1.0)
        weather.delay, weather.loss, weather.twice = (0.0, 0.0), 0.0, 0.0

    return fault


KINDS = ["delayed", "reordered", "lost and repeated"]


# --- in this process --------------------------------------------------------------------------------------


async def test_in_one_process_with_the_link_cut(undisturbed: Played, tmp_path: Path) -> None:
    weather = Weather()

    async def fault(told: Told) -> None:
        weather.cut = True
        await held_with_its_piece(told)
        weather.cut = False

    async with in_this_process(weather) as place:
        assert await play(place, tmp_path, fault) == undisturbed


@pytest.mark.soak
@pytest.mark.parametrize("kind", KINDS)
async def test_in_one_process_in_foul_weather(kind: str, undisturbed: Played, tmp_path: Path) -> None:
    weather = Weather(random.Random(kind))
    async with in_this_process(weather) as place:
        assert await play(place, tmp_path, foul_for_a_while(kind, weather)) == undisturbed


# --- in separate processes --------------------------------------------------------------------------------


async def test_as_separate_processes(undisturbed: Played, tmp_path: Path) -> None:
    endpoint = free_endpoint()
    wire = Wire(endpoint)

    async def fault(told: Told) -> None:
        wire.cut()
        await held_with_its_piece(told)
        wire.heal()

    async with wire as via, in_another_process(endpoint, via=via) as place:
        assert await play(place, tmp_path, fault) == undisturbed


@pytest.mark.soak
@pytest.mark.parametrize("kind", KINDS)
async def test_as_separate_processes_in_foul_weather(kind: str, undisturbed: Played, tmp_path: Path) -> None:
    weather = Weather(random.Random(kind))
    async with in_another_process(free_endpoint(), weather=weather) as place:
        assert await play(place, tmp_path, foul_for_a_while(kind, weather)) == undisturbed


# --- in separate network namespaces -----------------------------------------------------------------------


@pytest.fixture
def yonder() -> Iterator[Yonder]:
    """A namespace of its own, where this user may make one."""
    if shutil.which("ip") is None:
        pytest.skip("there is no ip command (iproute2)")
    made = Yonder()
    try:
        made.make()
    except subprocess.CalledProcessError as error:
        made.remove()
        pytest.skip(f"network namespaces need the right to make them: {error.stderr.decode().strip()}")
    try:
        yield made
    finally:
        made.remove()


@asynccontextmanager
async def in_another_namespace(yonder: Yonder, weather: Weather | None = None) -> AsyncIterator[Place]:
    endpoint, enter = f"tcp/{yonder.address}:7447", ("ip", "netns", "exec", yonder.name)
    async with in_another_process(endpoint, *enter, weather=weather) as place:
        yield place


async def test_in_separate_network_namespaces(yonder: Yonder, undisturbed: Played, tmp_path: Path) -> None:
    async def fault(told: Told) -> None:
        yonder.cut()
        await held_with_its_piece(told)
        yonder.heal()

    async with in_another_namespace(yonder) as place:
        assert await play(place, tmp_path, fault) == undisturbed


@pytest.mark.soak
@pytest.mark.parametrize(
    "weather",
    [
        ("delay", "150ms", "50ms"),
        ("delay", "60ms", "reorder", "40%", "50%"),
        ("loss", "20%"),
        ("duplicate", "60%"),
    ],
    ids=["delayed", "reordered", "lossy", "doubled"],
)
async def test_in_namespaces_with_packets_in_foul_weather(
    weather: tuple[str, ...], yonder: Yonder, undisturbed: Played, tmp_path: Path
) -> None:
    try:
        yonder.weather(*weather)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("tc netem is not there (iproute2, sch_netem)")
    yonder.weather()

    async def fault(_told: Told) -> None:
        yonder.weather(*weather)
        await asyncio.sleep(3.0)
        yonder.weather()

    async with in_another_namespace(yonder) as place:
        assert await play(place, tmp_path, fault) == undisturbed


@pytest.mark.soak
@pytest.mark.parametrize("kind", KINDS)
async def test_in_namespaces_in_foul_weather(
    kind: str, yonder: Yonder, undisturbed: Played, tmp_path: Path
) -> None:
    weather = Weather(random.Random(kind))
    async with in_another_namespace(yonder, weather) as place:
        assert await play(place, tmp_path, foul_for_a_while(kind, weather)) == undisturbed


@pytest.mark.soak
async def test_a_cable_that_is_cut_for_long_is_joined_again(
    yonder: Yonder, undisturbed: Played, tmp_path: Path
) -> None:
    """Longer than the network's own patience: the connection is made anew."""

    async def fault(told: Told) -> None:
        yonder.cut()
        with contextlib.suppress(TimeoutError):
            await held_with_its_piece(told)
        await asyncio.sleep(8.0)
        yonder.heal()

    async with in_another_namespace(yonder) as place:
        assert await play(place, tmp_path, fault) == undisturbed
