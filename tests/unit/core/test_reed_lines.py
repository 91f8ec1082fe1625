"""The reed board's lines: written, read, refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.reed import (
    ALL_SQUARES,
    Ask,
    Buzz,
    Change,
    Finding,
    Hello,
    Lamps,
    Lines,
    Message,
    Refusal,
    Snapshot,
    Sound,
    Wiring,
    checksum,
    decode,
    encode,
    square_name,
    squares_in,
)

NUMBERS, TIMES = st.integers(0, 65535), st.integers(0, 2**32 - 1)
SETS = st.integers(0, ALL_SQUARES)
MESSAGES = st.one_of(
    st.builds(Hello, st.integers(1, 9), st.just("00C0FFEE"), st.sampled_from(Wiring)),
    st.builds(Change, NUMBERS, TIMES, st.integers(0, 63), placed=st.just(True), doubtful=st.booleans()),
    st.builds(Change, NUMBERS, TIMES, st.integers(0, 63), placed=st.just(False)),
    st.builds(Snapshot, NUMBERS, TIMES, SETS, SETS, NUMBERS),
    st.builds(Finding, NUMBERS, TIMES, st.sampled_from(("sneak", "chatter")), SETS),
    st.builds(Refusal, st.sampled_from(("checksum", "unknown", "range", "long"))),
    st.builds(Ask, st.just("H")),
    st.builds(Ask, st.just("S"), NUMBERS),
    st.builds(Lamps, SETS),
    st.builds(Buzz, st.sampled_from(Sound)),
)


@given(MESSAGES)
def test_what_is_written_is_read(message: Message) -> None:
    line = encode(message)
    assert line.endswith(b"\n")
    assert decode(line[:-1]) == message


def test_the_checksum_is_that_of_the_catalogue() -> None:
    """CRC-16/CCITT-FALSE of "123456789" is 0x29B1."""
    assert checksum(b"123456789") == 0x29B1


def test_a_line_as_the_reference_shows_it() -> None:
    assert encode(Change(17, 48210, 28, placed=True)) == b"E 17 48210 +e4*303D\n"


@given(MESSAGES, st.data())
def test_one_damaged_byte_is_noticed(message: Message, data: st.DataObject) -> None:
    line = bytearray(encode(message)[:-1])
    place = data.draw(st.integers(0, len(line) - 1))
    line[place] ^= data.draw(st.integers(1, 255))
    with pytest.raises(ValueError, match="checksum|unknown|long"):
        decode(bytes(line))


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (b"E 1 2 +i4", "range"), (b"E 1 2 +e9", "range"), (b"E 99999 2 +e4", "range"), (b"E 1 2 e4", "range"),
        (b"S 1 2 12 34 0", "range"), (b"B loud", "range"), (b"L 0", "range"), (b"X", "unknown"),
        (b"H 1", "unknown"), (b"F 1 2 smoke 0000000000000000", "range"), (b"H " + 120 * b"1", "long"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(body: bytes, why: str) -> None:
    with pytest.raises(ValueError, match=f"^{why}$"):
        decode(b"%s*%04X" % (body, checksum(body)))


def test_a_stream_is_cut_into_lines_wherever_it_is_cut_itself() -> None:
    lines, seen = Lines(), []
    stream = encode(Ask("H")) + b"ok\r\n\r\n" + encode(Ask("S", 7)) + b"x" * 200 + b"\n" + encode(Lamps(5))
    for byte in stream:
        seen += list(lines.feed(bytes([byte])))
    good = [message for message in seen if not isinstance(message, ValueError)]
    assert good == [Ask("H"), Ask("S", 7), Lamps(5)]
    assert lines.damaged == 4  # "ok", and 200 letters in three pieces
    assert len(lines.stranger) <= 97


def test_squares() -> None:
    assert [square_name(square) for square in squares_in(1 | 1 << 28 | 1 << 63)] == ["a1", "e4", "h8"]
