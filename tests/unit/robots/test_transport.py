"""Ports: what cannot be opened and why, what DTR is told, who else may have it."""

import asyncio
import os
import socket
import termios
from collections.abc import Iterator
from pathlib import Path

import pytest
import serialx

from kempelen.core.errors import ConfigError, LinkError
from kempelen.robots import transport as transports
from kempelen.robots.transport import PortInfo, list_ports, open_port


@pytest.fixture
def terminal() -> Iterator[tuple[int, str]]:
    """A pseudo-terminal: the descriptor of its far end, and its path."""
    master, slave = os.openpty()
    attributes = termios.tcgetattr(slave)
    attributes[2] |= termios.HUPCL
    termios.tcsetattr(slave, termios.TCSANOW, attributes)
    yield master, os.ttyname(slave)
    os.close(slave)
    os.close(master)


async def test_bytes_go_both_ways(terminal: tuple[int, str]) -> None:
    far, path = terminal
    port = await open_port(path)
    port.write(b"?\x85\xff\n")
    await asyncio.sleep(0)
    assert os.read(far, 100) == b"?\x85\xff\n"
    os.write(far, b"ok\r\n")
    assert await port.read() == b"ok\r\n"
    await port.close()
    await port.close()


async def test_dtr_stays_up_when_this_process_dies(terminal: tuple[int, str]) -> None:
    """The kernel lowers DTR at the last close only while HUPCL is set, however the process ends."""
    far, path = terminal
    port = await open_port(path)
    assert not termios.tcgetattr(far)[2] & termios.HUPCL
    await port.close()
    assert not termios.tcgetattr(far)[2] & termios.HUPCL


async def test_whether_a_reset_is_to_be_expected(
    terminal: tuple[int, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, path = terminal
    port = await open_port(path)
    assert not port.resets  # nothing behind a pseudo-terminal has a boot loader
    await port.close()
    monkeypatch.setattr(transports, "_PSEUDO_TERMINALS", range(0))
    port = await open_port(path)
    assert not port.resets  # the last user left DTR up
    await port.close()
    fresh, other = os.openpty()
    attributes = termios.tcgetattr(other)
    attributes[2] |= termios.HUPCL
    termios.tcsetattr(other, termios.TCSANOW, attributes)
    port = await open_port(os.ttyname(other))
    assert port.resets
    await port.close()
    os.close(fresh)
    os.close(other)


async def test_a_second_program_is_refused(terminal: tuple[int, str]) -> None:
    _, path = terminal
    port = await open_port(path)
    with pytest.raises(LinkError, match="already in use"):
        await open_port(path)
    await port.close()
    again = await open_port(path)
    await again.close()


async def test_unplugged() -> None:
    far, slave = os.openpty()
    path = os.ttyname(slave)
    os.close(slave)
    port = await open_port(path)
    os.close(far)
    with pytest.raises(LinkError, match="is lost"):
        await port.read()
    with pytest.raises(LinkError, match="is lost"):
        port.write(b"?")
    await port.close()


@pytest.mark.parametrize(
    ("port", "words"),
    [
        ("/dev/ttyNOWHERE7", "does not exist"),
        ("/dev/null", "is not a serial device"),
        ("/tmp", "is a directory"),  # noqa: S108 - any directory
        ("socket://127.0.0.1:1", "nobody listens there"),
    ],
)
async def test_ports_that_cannot_be_opened(port: str, words: str) -> None:
    with pytest.raises(LinkError, match=words) as refused:
        await open_port(port)
    assert port in refused.value.message
    assert refused.value.hint


async def test_a_file_is_no_port(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("x")
    with pytest.raises(LinkError, match="is not a serial device"):
        await open_port(str(path))
    assert path.read_text() == "x"


@pytest.mark.parametrize("port", ["", "http://example.org", "socket://nowhere", "socket://127.0.0.1"])
async def test_texts_that_name_no_port(port: str) -> None:
    with pytest.raises(ConfigError):
        await open_port(port)


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (13, "may not be opened by this user"),
        (16, "already in use"),
        (5, "nobody at its other end"),
        (71, "cannot be opened"),
    ],
)
async def test_the_systems_refusals_are_explained(
    monkeypatch: pytest.MonkeyPatch, number: int, words: str
) -> None:
    def refuse(*_args: object) -> int:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(LinkError, match=words) as refused:
        await open_port("/dev/ttyUSB0")
    assert number != 13 or "dialout" in refused.value.hint


async def test_a_host_that_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    async def hang(*_args: object, **_options: object) -> None:
        raise TimeoutError

    monkeypatch.setattr(serialx, "create_serial_connection", hang)
    with pytest.raises(LinkError, match="did not answer within"):
        await open_port("socket://192.0.2.1:23")


async def test_over_a_socket(unused_port: socket.socket) -> None:
    host, number = unused_port.getsockname()
    port = await open_port(f"tcp://{host}:{number}")
    far, _ = unused_port.accept()
    assert not port.resets
    port.write(b"?")
    far.setblocking(True)
    assert far.recv(10) == b"?"
    far.close()
    with pytest.raises(LinkError, match="perhaps another program is connected"):
        await port.read()
    await port.close()


@pytest.fixture
def unused_port() -> Iterator[socket.socket]:
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen(1)
        yield server


def test_writing_before_opening_is_an_error() -> None:
    with pytest.raises(LinkError, match="not open"):
        transports.PortTransport("/dev/ttyX", resets=False).write(b"?")


def test_the_list_of_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    info = serialx.SerialPortInfo(
        device="/dev/null", resolved_device="/dev/null", vid=1, pid=2, serial_number=None,
        manufacturer="Arduino", product="Uno", bcd_device=None, interface_description=None,
        interface_num=None,
    )  # fmt: skip
    monkeypatch.setattr(serialx, "list_serial_ports", lambda: [info])
    assert list_ports() == [
        PortInfo("/dev/null", "Arduino Uno", usable=os.access("/dev/null", os.R_OK | os.W_OK))
    ]
    monkeypatch.undo()
    assert isinstance(list_ports(), list)
