"""Topics to clients: the newest values, never a queue."""

import asyncio
import json
from typing import Any

from kempelen.server.hub import SAID_KEPT, Client, Hub
from kempelen.server.messages import Delta, Say, Snapshot, WireLine
from kempelen.server.topics import PieceView, PromptView, RobotView, SceneView, StationView


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


def say(number: int) -> Say:
    return Say(kind="note", text=f"sentence {number}", at=0.0)


async def next_of(client: Client) -> dict[str, Any]:
    async with asyncio.timeout(5):
        message: dict[str, Any] = json.loads(await client.next())
    model = Snapshot if message["type"] == "snapshot" else Delta
    model.model_validate(message)
    return message


async def maybe(client: Client) -> str | None:
    """Its next message, if there is one."""
    task = asyncio.ensure_future(client.next())
    for _ in range(5):
        await asyncio.sleep(0)
    if task.done():
        return task.result()
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    return None


async def has_nothing(client: Client) -> bool:
    return await maybe(client) is None


def hub_at(clock: Clock | None = None) -> Hub:
    return Hub("epoch", clock=clock or Clock(), beat=0.0)


async def test_a_client_that_follows_gets_a_snapshot_then_what_changed() -> None:
    hub = hub_at()
    hub.put("station", StationView(phase="ready"))
    client = hub.join("spectator")
    assert await has_nothing(client)  # it follows nothing yet
    client.follow(["station", "robot"])
    snapshot = await next_of(client)
    assert snapshot["topics"]["station"]["phase"] == "ready"
    assert snapshot["topics"]["robot"] is None
    hub.put("station", StationView(phase="playing"))
    delta = await next_of(client)
    assert delta["changed"] == ["station"]
    assert delta["topics"]["station"]["phase"] == "playing"
    assert delta["sequence"] == snapshot["sequence"] + 1
    assert await has_nothing(client)


async def test_what_has_not_changed_is_not_told() -> None:
    hub = hub_at()
    client = hub.join("spectator")
    client.follow(["station"])
    hub.put("station", StationView())
    await next_of(client)
    hub.put("station", StationView())
    hub.put("robot", RobotView())  # not followed
    assert await has_nothing(client)


async def test_a_slow_client_skips_values_and_keeps_the_time_of_the_oldest() -> None:
    clock = Clock()
    hub = hub_at(clock)
    client = hub.join("spectator")
    client.follow(["robot", "station"])
    await next_of(client)
    for number in range(50):
        clock.now = 200.0 + number
        hub.put("robot", RobotView(position=(float(number), 0.0, 0.0)))
    hub.put("station", StationView(phase="ready"))
    delta = await next_of(client)
    assert delta["topics"]["robot"]["position"] == [49.0, 0.0, 0.0]
    assert delta["changed"] == ["station", "robot"]
    assert delta["moved_at"] == 200.0
    assert await has_nothing(client)


async def test_topics_that_flow_wait_for_the_beat() -> None:
    hub = Hub("epoch", clock=Clock(), beat=3600.0)
    client = hub.join("spectator")
    client.follow(["robot", "station"])
    await next_of(client)
    hub.put("robot", RobotView(phase="idle"))
    assert await has_nothing(client)
    hub.put("station", StationView(phase="ready"))  # does not, and takes the other one along
    assert (await next_of(client))["changed"] == ["station", "robot"]
    hub.leave(client)  # the last one: nothing is due any more


async def test_one_that_lags_behind_what_was_said_begins_anew() -> None:
    hub = hub_at()
    client = hub.join("spectator")
    client.follow(["station"])
    await next_of(client)
    for number in range(3):
        hub.say(say(number))
    told = await next_of(client)
    assert [line["text"] for line in told["said"]] == ["sentence 0", "sentence 1", "sentence 2"]
    for number in range(SAID_KEPT + 1):
        hub.say(say(number))
    again = await next_of(client)
    assert again["type"] == "snapshot"
    assert again["said"][-1]["text"] == f"sentence {SAID_KEPT}"
    assert await has_nothing(client)


async def test_a_value_that_says_only_what_changed_comes_whole_to_who_missed_one() -> None:
    def scene(*numbers: int, whole: bool = False) -> SceneView:
        pieces = tuple(PieceView(id=number, letter="P", at=(0.0, 0.0, 0.0)) for number in numbers)
        return SceneView(tool=None, closed=False, hand=None, pieces=pieces, whole=whole)

    hub = hub_at()
    quick, slow = hub.join("spectator"), hub.join("spectator")
    for client in (quick, slow):
        client.follow(["scene"])
        await next_of(client)
    hub.put("scene", scene(1), whole=scene(1, 2, 3, whole=True))
    assert [piece["id"] for piece in (await next_of(quick))["topics"]["scene"]["pieces"]] == [1]
    hub.put("scene", scene(2), whole=scene(1, 2, 3, whole=True))
    assert [piece["id"] for piece in (await next_of(quick))["topics"]["scene"]["pieces"]] == [2]
    assert [piece["id"] for piece in (await next_of(slow))["topics"]["scene"]["pieces"]] == [1, 2, 3]


async def test_values_are_written_once_for_all() -> None:
    hub = hub_at()
    clients = [hub.join("spectator") for _ in range(3)]
    for client in clients:
        client.follow(["prompts"])
        await next_of(client)
    hub.put("prompts", (PromptView(id="1", kind="do", text="<b>put it back</b>"),))
    messages = [await client.next() for client in clients]
    assert messages[0] is messages[1] is messages[2]
    assert json.loads(messages[0])["topics"]["prompts"][0]["text"] == "<b>put it back</b>"


async def test_roles_see_what_is_theirs() -> None:
    hub = hub_at()
    operator, spectator = hub.join("operator"), hub.join("spectator")
    for client in (operator, spectator):
        client.follow(["clients", "station"], wire=True)
    assert (await next_of(operator))["topics"]["clients"] == {"operators": 1, "players": 0, "spectators": 1}
    assert (await next_of(spectator))["topics"]["clients"] is None
    hub.line(WireLine(number=1, at=0.0, way="out", text="$H"))
    await asyncio.sleep(0)
    assert [line["text"] for line in (await next_of(operator))["wire"]] == ["$H"]
    assert await has_nothing(spectator)


async def test_answers_to_a_client_that_takes_none_are_bounded() -> None:
    hub = hub_at()
    client = hub.join("spectator")
    for number in range(1000):
        client.post(json.dumps(number))
    got = []
    while (message := await maybe(client)) is not None:
        got.append(json.loads(message))
    assert got[-1] == 999
    assert len(got) < 100


async def test_whoever_has_left_is_forgotten() -> None:
    hub = hub_at()
    client = hub.join("spectator")
    client.follow(["station"])
    await next_of(client)
    assert hub.followed("station")
    hub.leave(client)
    assert not hub.followed("station")
    assert hub.clients == 0
    hub.put("station", StationView(phase="ready"))
    assert await has_nothing(client)
