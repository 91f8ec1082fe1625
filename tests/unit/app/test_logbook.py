import logging
from collections.abc import Iterator

import pytest

from kempelen.app.discreet import without_secrets
from kempelen.app.logbook import Logbook, ProgramLog, WireLog, kept
from kempelen.robots.transport import WIRE


@pytest.fixture
def book() -> Iterator[Logbook]:
    with kept() as made:
        yield made


def told(way: str, data: bytes) -> None:
    logging.getLogger(WIRE).debug("%s %r", way, data)


def lines(book: Logbook) -> list[tuple[str, str]]:
    return [(line.way, line.text) for line in book.wire.ring.find(0, 100, "")]


def test_bytes_become_lines_however_they_are_cut(book: Logbook) -> None:
    told("out", b"$G\n$")
    told("in", b"[GC:G0 G5")
    told("out", b"?")
    told("in", b"4]\r\nok\r\n")
    told("out", b"$\n")
    assert lines(book) == [("out", "$G"), ("out", "?"), ("in", "[GC:G0 G54]"), ("in", "ok"), ("out", "$$")]


@pytest.mark.parametrize(
    ("byte", "text"),
    [(b"\x18", "<reset 0x18>"), (b"\x85", "<jog cancel 0x85>"), (b"!", "!"), (b"\x90", "<0x90>")],
)
def test_realtime_bytes_have_names(book: Logbook, byte: bytes, text: str) -> None:
    told("out", byte)
    assert lines(book) == [("out", text)]


def test_a_stop_is_shown_at_once_in_the_midst_of_a_line(book: Logbook) -> None:
    told("out", b"G1 X")
    told("out", b"!\x18")
    told("out", b"10\n")
    assert lines(book) == [("out", "!"), ("out", "<reset 0x18>"), ("out", "G1 X10")]


def test_noise_is_shown_and_fills_no_memory(book: Logbook) -> None:
    told("in", b"\xff\x00" + b"a" * 10_000)
    told("in", b"end\nok\n")
    (_, noise), ok = lines(book)
    assert noise == r"\xff\x00" + "a" * 398
    assert ok == ("in", "ok")
    told("in", b"\xff\x00\n")
    assert lines(book)[-1] == ("in", r"\xff\x00")


def test_what_is_new_and_matches_is_found_oldest_first(book: Logbook) -> None:
    told("in", b"one\nTwo\nthree\ntwofold\n")
    ring = book.wire.ring
    assert [line.number for line in ring.find(0, 10, "TWO")] == [2, 4]
    assert [line.text for line in ring.find(2, 10, "")] == ["three", "twofold"]
    assert [line.text for line in ring.find(0, 1, "")] == ["twofold"]


def test_a_ring_forgets_the_oldest() -> None:
    wire = WireLog(size=3)
    for n in range(5):
        wire.emit(logging.LogRecord(WIRE, logging.DEBUG, "", 0, "%s %r", ("in", b"%d\n" % n), None))
    assert [(line.number, line.text) for line in wire.ring.find(0, 10, "")] == [(3, "2"), (4, "3"), (5, "4")]


def test_the_programs_log_has_no_directories_and_no_secrets(book: Logbook) -> None:
    log = logging.getLogger("kempelen.somewhere")
    log.info("cannot write %s: %s", "/home/anna/data/games.db", "token=abc123&x=1")
    log.debug("not this")
    (note,) = [line for line in book.program.ring.find(0, 10, "") if line.name == "kempelen.somewhere"]
    assert note.text == "cannot write games.db: token=…&x=1"
    assert note.level == "INFO"


def test_an_exception_is_told_by_its_kind() -> None:
    program = ProgramLog()
    found = (OSError, OSError("/secret/place is full"), None)
    program.emit(logging.LogRecord("kempelen.x", logging.ERROR, "", 0, "failed", None, found))
    assert program.ring.find(0, 1, "")[0].text == "failed (OSError: place is full)"


@pytest.mark.parametrize(
    "text", ["http://127.0.0.1:8420/spectator", "and/or", "a / b", "socket://host:1", "/dev/ttyUSB0"]
)
def test_what_is_no_path_stays(text: str) -> None:
    assert without_secrets(text) == text


def test_nothing_is_left_behind() -> None:
    wire, root = logging.getLogger(WIRE), logging.getLogger()
    before = (wire.level, wire.propagate, list(wire.handlers), list(root.handlers))
    with kept():
        assert wire.level == logging.DEBUG
    assert (wire.level, wire.propagate, list(wire.handlers), list(root.handlers)) == before
