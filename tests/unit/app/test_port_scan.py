import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from kempelen.app import port_scan
from kempelen.app.port_scan import FoundPort, scan_ports
from kempelen.core.errors import LinkError
from kempelen.robots.transport import PortInfo, Transport
from kempelen.testing.grbl import BANNER, report
from kempelen.testing.wires import ScriptedWire


@pytest.fixture
def device() -> Iterator[str]:
    """A device that is there; what answers at it is the wire's."""
    ends = os.openpty()
    yield os.ttyname(ends[1])
    for end in ends:
        os.close(end)


@pytest.fixture(autouse=True)
def _little_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(port_scan, "BOOT_S", 0.05)
    monkeypatch.setattr(port_scan, "QUIET_S", 0.05)


async def looked(device: str, wire: ScriptedWire, in_use: str = "", *, usable: bool = True) -> FoundPort:
    async def opened(_port: str) -> Transport:
        return wire.transport

    twin, found = await scan_ports(in_use, "", [PortInfo(device, "A board", usable)], opened)
    assert twin.port == twin.answer == "twin"
    return found


async def test_a_controller_that_runs_is_asked_for_its_state(device: str) -> None:
    wire = ScriptedWire().expect(b"?", report("Alarm"))
    found = await looked(device, wire)
    assert (found.port, found.description, found.answer) == (device, "A board", "grbl")
    assert found.said == "GRBL, Alarm."
    wire.assert_done()


async def test_a_controller_that_was_reset_says_its_name(device: str) -> None:
    wire = ScriptedWire(resets=True)
    wire.say(BANNER)
    assert (await looked(device, wire)).said == "GRBL 1.1h, just restarted."
    wire.assert_done()  # and was asked nothing


@pytest.mark.parametrize("resets", [True, False])
async def test_silence_is_told_after_a_while(device: str, resets: bool) -> None:
    found = await looked(device, ScriptedWire(resets=resets).expect(b"?"))
    assert found.answer == "silent"
    assert "switched on" in found.said


async def test_another_device_is_no_robot_however_much_it_says(device: str) -> None:
    wire = ScriptedWire().expect(b"?", b"Marlin ready\n" * 10_000)
    assert (await looked(device, wire)).answer == "foreign"


async def test_the_port_in_use_and_a_forbidden_one_are_not_touched(device: str) -> None:
    wire = ScriptedWire()
    assert (await looked(device, wire, in_use=device)).answer == "in use"
    forbidden = await looked(device, wire, usable=False)
    assert forbidden.answer == "forbidden"
    assert "usermod" in forbidden.said or "chmod" in forbidden.said
    wire.assert_done()


async def test_what_cannot_be_opened_is_told_with_the_reason(device: str) -> None:
    async def busy(_port: str) -> Transport:
        raise LinkError("It is already in use by another program.", hint="End that.")

    _, found = await scan_ports("", "", [PortInfo(device, "", usable=True)], busy)
    assert (found.answer, found.said) == ("absent", "It is already in use by another program. End that.")


async def test_an_address_is_looked_at_too(tmp_path: Path) -> None:
    _, found = await scan_ports("", str(tmp_path / "none"), [])
    assert found.answer == "absent"
    assert "there is no" in found.said
