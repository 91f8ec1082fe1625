import os
import socket
import termios
from collections.abc import Iterator
from pathlib import Path

import pytest

from kempelen.core.errors import TwinError
from kempelen.twin.wire import PtyWire, TcpWire, make_wire


@pytest.fixture
def pty_wire(tmp_path: Path) -> Iterator[PtyWire]:
    wire = PtyWire(tmp_path / "port")
    yield wire
    wire.close()


@pytest.fixture
def tcp_wire() -> Iterator[TcpWire]:
    wire = TcpWire(0)
    yield wire
    wire.close()


def open_host(wire: PtyWire) -> int:
    return os.open(wire.address, os.O_RDWR | os.O_NOCTTY)


def clear_hupcl(fd: int) -> None:
    attributes = termios.tcgetattr(fd)
    attributes[2] &= ~termios.HUPCL
    termios.tcsetattr(fd, termios.TCSANOW, attributes)


def test_bytes_cross_both_ways_unchanged(pty_wire: PtyWire) -> None:
    host = open_host(pty_wire)
    pty_wire.opened()
    every = bytes(range(256))
    os.write(host, every)
    assert pty_wire.read() == every
    pty_wire.write(every)
    assert os.read(host, 256) == every
    os.close(host)


def test_the_first_opening_raises_dtr(pty_wire: PtyWire) -> None:
    assert not pty_wire.opened()
    host = open_host(pty_wire)
    assert pty_wire.opened()
    assert not pty_wire.opened()
    os.close(host)


def test_reopening_raises_dtr_again_unless_hupcl_was_cleared(pty_wire: PtyWire) -> None:
    host = open_host(pty_wire)
    assert pty_wire.opened()
    os.close(host)
    assert not pty_wire.opened()
    host = open_host(pty_wire)
    assert pty_wire.opened(), "a plain close lowers DTR, so the next opening is an edge"
    clear_hupcl(host)
    os.close(host)
    assert not pty_wire.opened()
    host = open_host(pty_wire)
    assert not pty_wire.opened(), "with HUPCL cleared DTR stayed up"
    os.close(host)


def test_a_table_that_stayed_powered_sees_no_edge(pty_wire: PtyWire) -> None:
    pty_wire.keep_dtr()
    clearing = open_host(pty_wire)
    assert not pty_wire.opened()
    os.close(clearing)


def test_reading_with_nobody_there_is_empty_and_writing_is_lost(pty_wire: PtyWire) -> None:
    assert pty_wire.read() == b""
    assert pty_wire.filenos() == []
    pty_wire.write(b"lost")
    host = open_host(pty_wire)
    pty_wire.opened()
    pty_wire.write(b"kept")
    assert os.read(host, 16) == b"kept"
    os.close(host)


def test_a_dropped_link_hangs_up_and_offers_a_new_terminal_under_the_same_name(pty_wire: PtyWire) -> None:
    host = open_host(pty_wire)
    pty_wire.opened()
    pty_wire.drop()
    assert os.read(host, 1) == b"", "the host sees the end of the line"
    os.close(host)
    again = open_host(pty_wire)
    assert pty_wire.opened()
    os.close(again)


def test_tcp_carries_one_host_at_a_time(tcp_wire: TcpWire) -> None:
    port = int(tcp_wire.address.rpartition(":")[2])
    with socket.create_connection(("127.0.0.1", port)) as first:
        tcp_wire.opened()
        with socket.create_connection(("127.0.0.1", port)) as second:
            assert not tcp_wire.opened()
            second.settimeout(2)
            assert second.recv(1) == b"", "the second host is turned away"
        first.sendall(b"?")
        first.settimeout(2)
        while not (data := tcp_wire.read()):
            pass
        assert data == b"?"
        tcp_wire.write(b"ok\r\n")
        assert first.recv(16) == b"ok\r\n"
    while tcp_wire.filenos()[1:]:
        tcp_wire.read()
    assert tcp_wire.read() == b""


def test_a_host_that_hung_up_makes_room_for_the_next_at_once(tcp_wire: TcpWire) -> None:
    port = int(tcp_wire.address.rpartition(":")[2])
    with socket.create_connection(("127.0.0.1", port)):
        tcp_wire.opened()
    with socket.create_connection(("127.0.0.1", port)) as next_host:
        tcp_wire.opened()
        next_host.sendall(b"?")
        while not (data := tcp_wire.read()):
            pass
        assert data == b"?"


def test_a_taken_tcp_port_is_named(tcp_wire: TcpWire) -> None:
    port = int(tcp_wire.address.rpartition(":")[2])
    with pytest.raises(TwinError, match=rf"TCP port {port} .* cannot be used"):
        make_wire(f"tcp:{port}", "")
