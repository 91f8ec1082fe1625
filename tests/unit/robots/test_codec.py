import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.robots.grbl.codec import (
    Alarm,
    Banner,
    BuildInfo,
    Damaged,
    Decoder,
    Error,
    Event,
    Message,
    Offset,
    Ok,
    ParserState,
    PositionTracker,
    Setting,
    Status,
    decode_line,
)

BANNER = b"Grbl 1.1h ['$' for help]"
LINES: tuple[tuple[bytes, Event], ...] = (
    (b"ok", Ok()),
    (b"error:9", Error(9)),
    (b"ALARM:3", Alarm(3)),
    (BANNER, Banner("1.1h")),
    (b"GrblHAL 1.1f ['$' or '$HELP' for help]", Banner("1.1f")),
    (b"[MSG:'$H'|'$X' to unlock]", Message("'$H'|'$X' to unlock")),
    (b"[MSG:Check Limits]", Message("Check Limits")),
    (b"$110=18000.000", Setting(110, 18000.0)),
    (b"$13=0 (report inches, bool)", Setting(13, 0.0)),
    (b"[G54:-705.000,-455.000,-205.000]", Offset("G54", (-705.0, -455.0, -205.0))),
    (b"[G92:0.000,0.000,0.000]", Offset("G92", (0.0, 0.0, 0.0))),
    (b"[TLO:0.000]", Message("TLO:0.000")),
    (b"[GC:G0 G54 M8 T7]", ParserState(("G0", "G54", "M8", "T7"))),
    (b"[VER:1.1h.20190830:]", BuildInfo("VER", "1.1h.20190830:")),
    (b"[OPT:V,15,128]", BuildInfo("OPT", "V,15,128")),
    (b">G54:ok", Message(">G54:ok")),
    (
        b"<Idle|MPos:-2.000,-2.000,-2.000|FS:0,0|WCO:-705.000,-455.000,-205.000>",
        Status("Idle", machine=(-2.0, -2.0, -2.0), offset=(-705.0, -455.0, -205.0)),
    ),
    (b"<Hold:1|WPos:1.000,2.000,3.000|FS:6000,0>", Status("Hold", 1, work=(1.0, 2.0, 3.0))),
    (
        b"<Run|MPos:0.000,0.000,0.000|FS:6000,0|Ov:100,100,100|A:SF>",
        Status("Run", machine=(0.0, 0.0, 0.0), accessories="SF"),
    ),
    (
        b"<Idle|MPos:0.000,0.000,0.000|FS:0,0|Ov:100,100,100>",
        Status("Idle", machine=(0.0, 0.0, 0.0), accessories=""),
    ),
    (b"<Alarm|MPos:0.000,0.000,0.000|FS:0,0|Pn:Y>", Status("Alarm", machine=(0.0, 0.0, 0.0), pins="Y")),
    (b"<Door:0|MPos:0.000,0.000,0.000|FS:0,0>", Status("Door", 0, machine=(0.0, 0.0, 0.0))),
)  # fmt: skip


@pytest.mark.parametrize(("line", "event"), LINES, ids=[line.decode() for line, _ in LINES])
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_every_line_of_the_firmware_is_one_event(line: bytes, event: Event, end: bytes) -> None:
    assert Decoder().feed(line + end) == [event]


@pytest.mark.parametrize(
    "line",
    [
        b"o", b"k", b"okok", b" ok", b"OK", b"ok ", b"error:", b"error:x", b"error:1234", b"ALARM", b"o\x8bk",
        b"<Idle|MPos:0.000,0.000|FS:0,0>", b"<Idle|MPos:0.000,0.000,0.000", b"<Idel|MPos:0.000,0.000,0.000>",
        b"<Idle|FS:0,0>", b"<Idle|MPos:0.0.0,0,0>", b"<|>", b"<>", b"[G54:1,2]", b"[MSG:cut", b"$=1", b"$10=",
        b"start", b"echo:Marlin 2.0", b"\x00\x00", b"Grbl", b"x" * 300,
    ],
)  # fmt: skip
def test_a_line_that_the_firmware_does_not_send_is_damaged(line: bytes) -> None:
    events = Decoder().feed(line + b"\r\n")
    assert [type(event) for event in events] == [Damaged]


def test_a_restart_behind_noise_is_still_a_restart() -> None:
    events = decode_line(b"<Idle|MPos:0.0\xff" + BANNER)
    assert [type(event) for event in events] == [Damaged, Banner]
    assert [type(event) for event in decode_line(b"<Idle|MPos:0.0" + BANNER)] == [Damaged, Banner]


def test_blank_lines_mean_nothing() -> None:
    assert Decoder().feed(b"\r\n\n\r\n") == []


def test_an_endless_line_is_bounded_and_reported_once() -> None:
    decoder = Decoder()
    for _ in range(1000):
        assert decoder.feed(b"x" * 100) == []
    assert len(decoder._tail) < 1000
    assert [type(event) for event in decoder.feed(b"\nok\r\n")] == [Damaged, Ok]


def test_machine_and_work_positions_are_the_same_place() -> None:
    tracker = PositionTracker()
    machine = Status("Idle", machine=(-2.0, -2.0, -2.0))
    assert tracker.work(machine) is None  # the offset is not known yet
    assert tracker.work(Status("Idle", machine=(-2.0, -2.0, -2.0), offset=(-705.0, -455.0, -205.0))) == (
        703.0,
        453.0,
        203.0,
    )
    assert tracker.work(machine) == (703.0, 453.0, 203.0)
    assert tracker.machine(Status("Idle", work=(703.0, 453.0, 203.0))) == (-2.0, -2.0, -2.0)
    assert PositionTracker().machine(Status("Idle", work=(703.0, 453.0, 203.0))) is None


@pytest.mark.parametrize(
    ("status", "moving"),
    [
        (Status("Run"), True), (Status("Jog"), True), (Status("Home"), True), (Status("Hold", 1), True),
        (Status("Hold", 0), False), (Status("Idle"), False), (Status("Alarm"), False),
        (Status("Door", 0), False),
        (Status("Door", 1), False), (Status("Door", 2), True), (Status("Door", 3), True),
    ],
)  # fmt: skip
def test_what_counts_as_moving(status: Status, moving: bool) -> None:
    assert status.moving is moving


ANY_LINES = st.lists(st.sampled_from([line for line, _ in LINES]), max_size=12)


@given(ANY_LINES, st.lists(st.integers(0, 600)))
def test_however_the_stream_is_cut_the_events_are_the_same(lines: list[bytes], cuts: list[int]) -> None:
    stream = b"".join(line + b"\r\n" for line in lines)
    whole = Decoder().feed(stream)
    decoder, places = Decoder(), sorted({0, *(cut % (len(stream) + 1) for cut in cuts), len(stream)})
    pieces = [event for a, b in itertools.pairwise(places) for event in decoder.feed(stream[a:b])]
    assert pieces == whole


@given(st.binary(max_size=700), st.lists(st.integers(0, 700)))
def test_noise_never_raises_and_cuts_do_not_matter(noise: bytes, cuts: list[int]) -> None:
    whole = Decoder().feed(noise)
    decoder, places = Decoder(), sorted({0, *(cut % (len(noise) + 1) for cut in cuts), len(noise)})
    pieces = [event for a, b in itertools.pairwise(places) for event in decoder.feed(noise[a:b])]
    assert pieces == whole


@given(ANY_LINES, st.data())
def test_damage_never_invents_an_acknowledgement(lines: list[bytes], data: st.DataObject) -> None:
    stream = bytearray(b"".join(line + b"\r\n" for line in lines))
    if stream:
        at = data.draw(st.integers(0, len(stream) - 1))
        kind = data.draw(st.sampled_from(["flip", "drop", "insert"]))
        if kind == "flip":
            stream[at] ^= 1 << data.draw(st.integers(0, 7))
        elif kind == "drop":
            del stream[at : at + data.draw(st.integers(1, 20))]
        else:
            stream[at:at] = bytes([data.draw(st.integers(128, 255))])
    acknowledged = sum(isinstance(event, Ok) for event in Decoder().feed(bytes(stream)))
    assert acknowledged <= lines.count(b"ok") + lines.count(b">G54:ok")
