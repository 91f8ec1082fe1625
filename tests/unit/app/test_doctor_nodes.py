"""Nodes that a configuration names are looked for; nothing else of theirs is."""

from functools import partial

import pytest

from kempelen.app import doctor, doctor_nodes
from kempelen.app.cameras import parse_camera
from kempelen.app.config import Config, load_config
from kempelen.app.doctor import examine_machine
from kempelen.app.doctor_nodes import examine_nodes
from kempelen.app.doctor_rows import Check, Status, ok
from kempelen.core.errors import ConfigError, EngineError, LinkError
from kempelen.nodes.link import Link
from kempelen.nodes.local_link import LocalNet
from kempelen.nodes.messages import key_of
from kempelen.nodes.presence import Presence

AT_NODES = {
    "robot.port": "node:one",
    "sensor.kind": "reed",
    "sensor.port": "node:two",
    "engine.path": "node:deep",
}


async def rows(config: Config) -> dict[str, Check]:
    return {row.name: row async for row in examine_nodes(config, seconds=0.05)}


async def test_what_is_there_and_what_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    net = LocalNet()

    def joined(_: Config) -> Link:
        return net.join()

    monkeypatch.setattr(doctor_nodes, "link_of", joined)
    async with net.join() as link:
        await link.stand(key_of("one", "robot"))
        await link.stand(key_of("two", "board", protocol=99))
        found = await rows(load_config(None, AT_NODES))
    assert found["robot node"].status is Status.OK
    assert "speaks protocol 99" in found["board node"].found
    assert "kempelen node engine --name deep" in found["engine node"].todo
    assert "camera node" not in found


async def test_what_is_elsewhere_is_not_looked_for_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor_nodes, "link_of", lambda _: LocalNet().join())
    monkeypatch.setattr(doctor, "examine_nodes", partial(examine_nodes, seconds=0.05))

    async def passed() -> Check:
        return ok("probe", "as ever")

    monkeypatch.setattr(doctor, "examine_physics", passed)
    monkeypatch.setattr(doctor, "examine_rendering", passed)
    names = [row.name async for row in examine_machine(load_config(None, AT_NODES))]
    assert {"robot node", "board node", "engine node"} <= set(names)
    assert not {"robot", "engine", "reed board"} & set(names)


async def test_without_nodes_no_network_is_joined() -> None:
    assert await rows(Config()) == {}


async def test_a_name_that_is_none() -> None:
    found = await rows(load_config(None, {"robot.port": "node:A B"}))
    assert "is no name for a table" in found["robot node"].found


def test_whose_absence_is_told_by_its_own_error() -> None:
    assert isinstance(Presence("robot", "one", (), ()).absence(3), LinkError)
    assert isinstance(Presence("engine", "deep", (), ()).absence(3), EngineError)


def test_pictures_of_a_node_stay_there() -> None:
    with pytest.raises(ConfigError, match="stay on its machine"):
        parse_camera("node:hall-3")
