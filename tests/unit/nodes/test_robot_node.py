"""One arbiter at a time, no command late or twice, at rest when the arbiter is lost."""

import asyncio
import random
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import replace
from typing import Self

import numpy as np
import pytest

from kempelen.core.errors import BusyError, LinkError, NotHomedError, StoppedError
from kempelen.core.protocols import Action, Follow, RobotPhase, RobotState
from kempelen.core.table import WorkSpace
from kempelen.nodes.local_link import LocalLink, LocalNet, Weather
from kempelen.nodes.messages import Call, Outcome, Take, Taken, key_of
from kempelen.nodes.remote_robot import RemoteRobot, Waits
from kempelen.nodes.robot_node import Patience, RobotNode

WAY = [Follow(np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]), 1.0)]
QUICK = Waits(answer=0.05, news=0.02, beat=0.01, valid=0.5, found=0.3, lost=0.5)
SHORT = Patience(rest=0.05, forfeit=0.15, look=0.005)


class ToyRobot:
    """A robot whose groups end when they are told to."""

    name = "toy"
    space = WorkSpace()

    def __init__(self) -> None:
        self.state = RobotState(RobotPhase.IDLE, homed=True, reported_position=(0.0, 0.0, 0.0))
        self.done: list[str] = []
        self.groups: list[Sequence[Action]] = []
        self.arrive = asyncio.Event()
        self._running: asyncio.Future[None] | None = None
        self._changed = asyncio.Event()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *exc: object) -> None:
        pass

    async def watch(self) -> AsyncIterator[RobotState]:
        while True:
            yield self.state
            await self._changed.wait()
            self._changed.clear()

    def _be(self, phase: RobotPhase) -> None:
        self.state = replace(self.state, phase=phase)
        self._changed.set()

    async def run(self, group: Sequence[Action]) -> None:
        self.groups.append(group)
        self._be(RobotPhase.MOVING)
        self._running = asyncio.ensure_future(self._arrived())
        try:
            await self._running
        except asyncio.CancelledError:
            raise StoppedError("It was cancelled.") from None
        finally:
            self._be(RobotPhase.IDLE)

    async def _arrived(self) -> None:
        await self.arrive.wait()
        self.arrive.clear()

    async def home(self) -> None:
        self.done.append("home")

    async def retract(self) -> None:
        raise NotHomedError("It is not homed.", hint="Home it first.")

    async def hold(self) -> None:
        self.done.append("hold")
        self._be(RobotPhase.HELD)

    async def resume(self) -> None:
        self.done.append("resume")
        self._be(RobotPhase.MOVING)

    async def cancel(self) -> None:
        self.done.append("cancel")
        if self._running is not None:
            self._running.cancel()

    async def stop(self) -> None:
        self.done.append("stop")
        await self.cancel()

    async def recover(self) -> None:
        self.done.append("recover")

    async def jog(self, direction: tuple[float, float, float], speed: float) -> None:
        self.done.append(f"jog {direction} {speed}")

    async def jog_stop(self) -> None:
        self.done.append("jog_stop")


class Hall:
    """A net with a robot node, and arbiters that come to it."""

    def __init__(self, net: LocalNet, stack: AsyncExitStack) -> None:
        self.net = net
        self.robot = ToyRobot()
        self._stack = stack
        self.node: RobotNode

    async def open(self, patience: Patience = SHORT) -> None:
        link = await self.link()
        self.node = await self._stack.enter_async_context(
            RobotNode(self.robot, link, "one", patience=patience)
        )

    async def link(self) -> LocalLink:
        return await self._stack.enter_async_context(self.net.join())

    async def arbiter(self, who: str = "me", waits: Waits = QUICK) -> RemoteRobot:
        remote = RemoteRobot(await self.link(), "one", who=who, waits=waits)
        return await self._stack.enter_async_context(remote)


@asynccontextmanager
async def hall(weather: Weather | None = None) -> AsyncIterator[Hall]:
    async with AsyncExitStack() as stack:
        made = Hall(LocalNet(weather), stack)
        await made.open()
        yield made


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(5):
        while not condition():  # noqa: ASYNC110 - what is waited for has no event of its own
            await asyncio.sleep(0.001)


async def test_a_group_goes_there_and_ends_when_the_robot_has_ended() -> None:
    async with hall() as made:
        remote = await made.arbiter()
        assert (remote.name, remote.space) == ("toy", made.robot.space)
        running = asyncio.create_task(remote.run(WAY))
        await until(lambda: remote.state.phase is RobotPhase.MOVING)
        assert not running.done()
        made.robot.arrive.set()
        await running
        (sent,) = made.robot.groups
        (way,) = sent
        assert isinstance(way, Follow)
        assert way.vertices.tolist() == WAY[0].vertices.tolist()


async def test_what_the_robot_refuses_is_raised_here() -> None:
    async with hall() as made:
        remote = await made.arbiter()
        with pytest.raises(NotHomedError, match="It is not homed") as raised:
            await remote.retract()
        assert raised.value.hint == "Home it first."


async def test_cut_off_in_mid_motion_it_rests_and_goes_on_when_healed() -> None:
    async with hall() as made:
        remote = await made.arbiter()
        running = asyncio.create_task(remote.run(WAY))
        await until(lambda: made.robot.state.phase is RobotPhase.MOVING)
        made.net.weather.cut = True
        await until(lambda: made.robot.done == ["hold"])
        assert made.robot.state.phase is RobotPhase.HELD
        await until(lambda: "cut" in remote.state.message)
        made.net.weather.cut = False
        await until(lambda: made.robot.done == ["hold", "resume"])
        made.robot.arrive.set()
        await running
        assert len(made.robot.groups) == 1


async def test_an_end_that_was_not_heard_of_is_asked_after() -> None:
    async with hall() as made:
        remote = await made.arbiter()
        running = asyncio.create_task(remote.run(WAY))
        await until(lambda: made.robot.state.phase is RobotPhase.MOVING)
        made.net.weather.cut = True
        made.robot.arrive.set()
        await until(lambda: made.robot.state.phase is RobotPhase.IDLE)
        made.net.weather.cut = False
        await running
        assert len(made.robot.groups) == 1


async def test_a_link_that_stays_cut_is_an_error_in_the_end() -> None:
    async with hall() as made:
        remote = await made.arbiter()
        running = asyncio.create_task(remote.run(WAY))
        await until(lambda: made.robot.state.phase is RobotPhase.MOVING)
        made.net.weather.cut = True
        with pytest.raises(LinkError, match="has not answered for"):
            await running
        assert made.robot.state.phase is RobotPhase.HELD
        made.net.weather.cut = False


@pytest.mark.parametrize("seed", range(5))
async def test_in_foul_weather_every_group_is_carried_out_once_and_in_order(seed: int) -> None:
    weather = Weather(random.Random(seed), loss=0.3, twice=0.3, delay=(0.0, 0.005))
    async with hall(weather) as made:
        remote = await made.arbiter(waits=replace(QUICK, found=5.0, lost=5.0, answer=0.02))
        for number in range(8):
            made.robot.arrive.set()
            await remote.run([Follow(np.array([[0.0, 0.0, 0.0], [float(number), 0.0, 0.0]]), 0.1)])
        driven = [group[0].vertices[1, 0] for group in made.robot.groups if isinstance(group[0], Follow)]
        assert driven == list(range(8))


async def test_a_second_arbiter_is_told_who_leads_and_gets_the_robot_when_that_one_is_lost() -> None:
    async with hall() as made:
        first = await made.arbiter("Anna at desk")
        with pytest.raises(BusyError, match="led by Anna at desk"):
            await made.arbiter("Ben at door")
        running = asyncio.create_task(first.run(WAY))
        await until(lambda: made.robot.state.phase is RobotPhase.MOVING)
        made.net.weather.cut = True
        with pytest.raises(LinkError):
            await running
        made.net.weather.cut = False
        second = await made.arbiter("Ben at door")
        assert made.robot.done == ["hold", "cancel"]
        assert second.state.memory_kept
        with pytest.raises(LinkError):
            await first.home()
        await second.home()


async def test_a_program_that_leaves_frees_the_robot_at_once() -> None:
    async with hall() as made:
        async with RemoteRobot(await made.link(), "one", waits=QUICK) as first:
            running = asyncio.create_task(first.run(WAY))
            await until(lambda: made.robot.state.phase is RobotPhase.MOVING)
        with pytest.raises((StoppedError, LinkError)):
            await running
        assert made.robot.done == ["cancel"]
        await made.arbiter()


async def test_a_robot_that_was_held_between_two_groups_is_not_left_so_to_the_next_arbiter() -> None:
    async with hall() as made:
        async with RemoteRobot(await made.link(), "one", waits=QUICK) as first:
            await first.hold()
            assert made.robot.state.phase is RobotPhase.HELD
        assert made.robot.done == ["hold", "resume"]


async def test_held_by_the_node_as_its_group_ended_it_is_not_left_so_to_the_next_arbiter() -> None:
    """The group may end at the very instant at which the node holds the robot for a silent arbiter."""
    async with hall() as made:
        first = await made.arbiter("Anna")
        running = asyncio.create_task(first.run(WAY))
        await until(lambda: made.robot.state.phase is RobotPhase.MOVING)
        made.net.weather.cut = True
        await until(lambda: made.robot.done == ["hold"])
        made.robot.arrive.set()
        await until(lambda: made.robot.state.phase is RobotPhase.IDLE)
        with pytest.raises(LinkError):
            await running
        made.net.weather.cut = False
        await made.arbiter("Ben")
        assert made.robot.done == ["hold", "resume"]


async def test_a_node_that_was_started_again_knows_nobody() -> None:
    async with AsyncExitStack() as stack:
        made = Hall(LocalNet(), stack)
        async with AsyncExitStack() as first:
            link = await first.enter_async_context(made.net.join())
            await first.enter_async_context(RobotNode(made.robot, link, "one", patience=SHORT))
            remote = await made.arbiter()
        await made.open()
        with pytest.raises(LinkError, match="its node was started again"):
            await remote.home()
        assert made.robot.done == []


@pytest.mark.parametrize("hours", [-5.0, 0.0, 7.5, 24 * 400.0])
async def test_clocks_that_differ_make_no_command_late_or_valid_for_longer(hours: float) -> None:
    """Times are of the node's clock: what the other machine believes the time to be does not matter."""
    ahead = 3600 * hours
    loop = asyncio.get_running_loop()
    async with AsyncExitStack() as stack:
        made = Hall(LocalNet(), stack)
        link = await made.link()
        node = RobotNode(made.robot, link, "one", patience=SHORT, clock=lambda: loop.time() + ahead)
        await stack.enter_async_context(node)
        remote = await made.arbiter(waits=replace(QUICK, valid=0.2, lost=3.0))
        await remote.home()
        assert made.robot.done == ["home"]
        late = made.net.weather.delay = (0.25, 0.25)
        homing = asyncio.create_task(remote.home())
        await asyncio.sleep(late[0] + 0.1)
        assert made.robot.done == ["home"]  # it came later than it may
        made.net.weather.delay = (0.0, 0.0)
        await homing
        assert made.robot.done == ["home", "home"]


async def test_of_two_arbiters_at_once_one_gets_the_robot() -> None:
    async with hall() as made:
        arbiters = [made.arbiter(name) for name in ("Anna", "Ben", "Cleo")]
        came = await asyncio.gather(*arbiters, return_exceptions=True)
        (leader,) = [one for one in came if isinstance(one, RemoteRobot)]
        assert [type(one) for one in came].count(BusyError) == 2
        await leader.home()
        assert made.robot.done == ["home"]


# --- commands as they arrive ------------------------------------------------------------------------------


class Sender:
    """Commands by hand."""

    def __init__(self, link: LocalLink) -> None:
        self._link = link
        self.lease = ""
        self.clock = 0.0

    async def take(self) -> None:
        content = await self._link.ask(
            key_of("one", "robot", "take"), Take(client="0123456789", who="hand").pack(), seconds=1
        )
        taken = Taken.unpack(content)
        self.lease, self.clock = taken.lease, taken.clock

    async def send(self, number: int, deed: str, *, valid: float = 10.0) -> Outcome:
        fields = {"lease": self.lease, "number": number, "valid_until": self.clock + valid, "deed": deed}
        return await self.raw(Call.model_validate(fields).pack())

    async def raw(self, content: bytes) -> Outcome:
        return Outcome.unpack(await self._link.ask(key_of("one", "robot", "do"), content, seconds=1))


@asynccontextmanager
async def by_hand() -> AsyncIterator[tuple[Hall, Sender]]:
    async with hall() as made:
        sender = Sender(await made.link())
        await sender.take()
        yield made, sender


async def test_a_late_command_is_not_carried_out() -> None:
    async with by_hand() as (made, sender):
        outcome = await sender.send(1, "home", valid=-0.01)
        assert (outcome.status, outcome.late) == ("refused", True)
        assert outcome.trouble is not None
        assert "too late; nothing was done" in outcome.trouble.message
        assert (await sender.send(1, "home")).status == "done"
        assert made.robot.done == ["home"]


async def test_a_replayed_command_is_answered_and_not_repeated() -> None:
    async with by_hand() as (made, sender):
        for _ in range(3):
            assert (await sender.send(1, "home")).status == "done"
        await sender.send(2, "stop")
        assert (await sender.send(2, "stop")).status == "done"
        assert made.robot.done == ["home", "stop", "cancel"]


async def test_what_was_cancelled_before_it_came_never_begins() -> None:
    async with by_hand() as (made, sender):
        await sender.send(2, "cancel")
        outcome = await sender.send(1, "run")
        assert outcome.status == "refused"
        assert outcome.trouble is not None
        assert "overtaken by command 2" in outcome.trouble.message
        assert made.robot.groups == []


async def test_a_command_with_another_lease_is_refused_but_for_the_emergency_stop() -> None:
    async with by_hand() as (made, sender):
        sender.lease = "somebody else's"
        assert (await sender.send(1, "home")).status == "refused"
        assert (await sender.send(2, "stop")).status == "done"
        assert made.robot.done == ["stop", "cancel"]


@pytest.mark.parametrize(
    "content",
    [b"", b"\xff\x00", b"{}", b'{"lease":"x","number":-1}', b'["do"]', b'{"do": NaN}'],
    ids=["empty", "binary", "nothing", "negative", "list", "nan"],
)
async def test_damaged_commands_are_refused_and_nothing_moves(content: bytes) -> None:
    async with by_hand() as (made, sender):
        outcome = await sender.raw(content)
        assert outcome.status == "refused"
        assert outcome.trouble is not None
        assert "is no Call" in outcome.trouble.message
        assert (made.robot.done, made.robot.groups) == ([], [])


# --- who is there -----------------------------------------------------------------------------------------


async def test_a_table_that_is_not_there_is_named_with_those_that_are() -> None:
    async with hall() as made:
        with pytest.raises(LinkError, match="No robot node at table two answers") as raised:
            async with RemoteRobot(await made.link(), "two", waits=QUICK):
                pass
        assert "Nodes with a robot: one." in str(raised.value.hint)


async def test_a_node_of_another_protocol_is_named() -> None:
    async with hall() as made:
        old = await made.link()
        await old.stand(key_of("three", "robot", protocol=99))
        with pytest.raises(LinkError, match="speaks protocol 99, this program protocol 1"):
            async with RemoteRobot(await made.link(), "three", waits=QUICK):
                pass
