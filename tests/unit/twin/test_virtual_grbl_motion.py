"""Motion keeps to GRBL's own rules, and nothing depends on how time or bytes are cut."""

import json
import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kempelen.core.errors import TwinError
from kempelen.twin.grbl import Eeprom, Machine, VirtualGrbl, execute
from kempelen.twin.grbl.motion import Ramp

TRAVEL = (700.0, 450.0, 200.0)
START = (-400.0, -250.0, -100.0)
RATE, ACCELERATION = 300.0, 1500.0

Bench = Any
MakeBench = Callable[..., Bench]

_COORDINATES = st.tuples(
    st.integers(-6900, -50).map(lambda n: n / 10),
    st.integers(-4400, -50).map(lambda n: n / 10),
    st.integers(-1900, -50).map(lambda n: n / 10),
)
_MOVES = st.lists(
    st.tuples(_COORDINATES, st.sampled_from(["G0", "G1F18000", "G1F7000"])), min_size=1, max_size=6
)


def _lines(moves: list[tuple[tuple[float, float, float], str]]) -> list[str]:
    return [f"{word}X{x}Y{y}Z{z}" for (x, y, z), word in moves]


def _fresh() -> VirtualGrbl:
    grbl = VirtualGrbl(Machine(TRAVEL, START), eeprom=Eeprom.for_travel(TRAVEL))
    grbl.assume_homed()
    return grbl


def _run(grbl: VirtualGrbl, step: float = 0.008) -> bytes:
    heard = grbl.take_output()
    for _ in range(200_000):
        if grbl.idle():
            break
        grbl.advance(step)
        heard += grbl.take_output()
    return heard


# --- single ramps ---------------------------------------------------------------------------------------


@given(
    length=st.floats(1e-3, 500),
    start=st.floats(0, 400),
    cruise=st.floats(1, 400),
    end=st.floats(0, 400),
    acceleration=st.floats(10, 5000),
)
def test_a_ramp_covers_its_length_within_its_limits(
    length: float, start: float, cruise: float, end: float, acceleration: float
) -> None:
    ramp = Ramp.over(length, start, cruise, min(end, cruise), acceleration)
    distance, speed = 0.0, start
    for duration, rate in ramp.phases:
        assert duration >= -1e-12
        assert abs(rate) <= acceleration
        distance += (speed + 0.5 * rate * duration) * duration
        speed += rate * duration
        assert speed <= max(start, cruise, ramp.end_speed) + 1e-6
    assert distance == pytest.approx(length, rel=1e-6, abs=1e-9)
    assert speed == pytest.approx(ramp.end_speed, abs=1e-5)
    for share in (0.0, 0.2, 0.5, 0.9, 1.0):
        when = ramp.time_at(share * length)
        assert ramp.at(when)[0] == pytest.approx(share * length, rel=1e-6, abs=1e-6)


def test_a_ramp_at_rest_to_rest_is_the_textbook_trapezoid() -> None:
    ramp = Ramp.over(300.0, 0.0, 300.0, 0.0, 1500.0)
    assert ramp.duration == pytest.approx(300.0 / 300.0 + 300.0 / 1500.0)
    assert Ramp.over(15.0, 0.0, 300.0, 0.0, 1500.0).duration == pytest.approx(2 * math.sqrt(15.0 / 1500.0))


def test_a_lowered_ceiling_is_reached_by_braking() -> None:
    ramp = Ramp.over(200.0, 300.0, 100.0, 0.0, 1500.0)
    duration, rate = ramp.phases[0]
    assert duration == pytest.approx(200.0 / 1500.0)
    assert rate == -1500.0
    assert ramp.at(0.2)[1] == pytest.approx(100.0)


# --- whole programs -------------------------------------------------------------------------------------


@settings(max_examples=30, suppress_health_check=[HealthCheck.too_slow])
@given(_MOVES)
def test_programs_end_on_target_within_limits_and_not_too_early(
    moves: list[tuple[tuple[float, float, float], str]],
) -> None:
    step = 0.004
    done = execute(_lines(moves), travel=TRAVEL, start=START, sample_s=step)
    last = done.samples[-1]
    for axis in range(3):
        assert last[1 + axis] == pytest.approx(moves[-1][0][axis], abs=0.5 / 80 + 1e-9)
    points = [START, *(point for point, _ in moves)]
    lower_bound = max(sum(abs(b[axis] - a[axis]) for a, b in pairwise(points)) for axis in range(3))
    assert done.time_s >= lower_bound / RATE - 1e-6
    samples = done.samples
    for before, after in pairwise(samples):
        dt = after[0] - before[0]
        for axis in range(1, 4):
            assert abs(after[axis] - before[axis]) <= RATE * dt + 1e-6


@settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow])
@given(_MOVES)
def test_along_each_block_rate_and_acceleration_are_kept(
    moves: list[tuple[tuple[float, float, float], str]],
) -> None:
    """GRBL bounds each axis along a block; only at corners may junction deviation exceed it."""
    grbl = _fresh()
    grbl.receive(b"".join(line.encode() + b"\n" for line in _lines(moves))[:120].rpartition(b"\n")[0] + b"\n")
    core = grbl._core
    previous: tuple[object, float] = (None, 0.0)
    grbl.advance(0.0)
    while not grbl.idle():
        grbl.advance(0.002)
        block, velocity = core.stepper.block, core.velocity()
        speed = core.stepper.speed
        if block is None:
            continue
        assert speed <= block.nominal + 1e-6
        assert all(abs(part) <= RATE + 1e-6 for part in velocity)
        if previous[0] is block:
            for part in block.unit:
                assert abs(speed - previous[1]) * abs(part) <= ACCELERATION * 0.002 + 1e-6
        previous = (block, speed)


def test_a_straight_line_in_pieces_is_driven_without_stopping() -> None:
    whole = execute(["G0X-100"], travel=TRAVEL, start=START).time_s
    pieces = execute([f"G0X{-400 + 10 * n}" for n in range(1, 31)], travel=TRAVEL, start=START).time_s
    assert pieces == pytest.approx(whole, abs=0.01)


def test_a_reversal_is_a_full_stop() -> None:
    there_and_back = execute(["G0X-300", "G0X-400"], travel=TRAVEL, start=START).time_s
    once = execute(["G0X-300"], travel=TRAVEL, start=START).time_s
    assert there_and_back == pytest.approx(2 * once, abs=0.005)


def test_a_right_angle_is_taken_at_the_speed_of_junction_deviation() -> None:
    grbl = _fresh()
    grbl.receive(b"G1X-300F18000\nG1Y-150\n")
    grbl.advance(0.0)
    sine = math.sqrt(0.5)
    expected = math.sqrt(ACCELERATION * math.sqrt(2) * 0.02 * sine / (1 - sine))
    assert math.sqrt(grbl._core.planner.blocks[1].max_junction) == pytest.approx(expected)
    assert 6.0 < expected < 11.0


def test_feed_per_axis_is_bounded_by_the_slowest_axis() -> None:
    slow = execute(["G0X-300Z-50"], travel=TRAVEL, start=START, settings={112: 3000.0}).time_s
    assert slow == pytest.approx(50.0 / 50.0, abs=0.1)


def test_inverse_time_takes_the_time_it_says() -> None:
    done = execute(["G93G1X-300F30"], travel=TRAVEL, start=START)
    assert done.time_s == pytest.approx(2.0, abs=0.05)


def test_arcs_end_on_target_and_keep_their_radius() -> None:
    done = execute(
        ["G2X-300Y-250I50J0F9000"], travel=TRAVEL, start=START, sample_s=0.005, settings={12: 0.002}
    )
    assert tuple(done.samples[-1][1:]) == pytest.approx((-300.0, -250.0, -100.0), abs=0.01)
    for _, x, y, _z in done.samples:
        assert math.hypot(x + 350.0, y + 250.0) == pytest.approx(50.0, abs=0.02)
    assert max(sample[2] for sample in done.samples) == pytest.approx(-200.0, abs=0.1)
    by_radius = execute(["G2X-300Y-250R50F9000"], travel=TRAVEL, start=START)
    assert by_radius.time_s == pytest.approx(done.time_s, rel=0.02)


def test_execute_names_the_line_that_is_refused() -> None:
    with pytest.raises(TwinError, match=r"Line 2, 'G7X1'.*error:20"):
        execute(["G0X-300", "G7X1"], travel=TRAVEL, start=START)


def test_execute_includes_dwells() -> None:
    done = execute(["M8", "G4P0.3"], travel=TRAVEL, start=START)
    assert done.time_s == pytest.approx(0.3, abs=0.01)


# --- cutting bytes and time -----------------------------------------------------------------------------


@settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow])
@given(_MOVES, st.lists(st.integers(1, 9), min_size=1, max_size=20))
def test_split_and_merged_bytes_give_the_same(
    moves: list[tuple[tuple[float, float, float], str]], cuts: list[int]
) -> None:
    data = (b"".join(line.encode() + b"\n" for line in _lines(moves)))[:120]
    whole, split = _fresh(), _fresh()
    whole.receive(data)
    whole.advance(0.0)
    rest = data
    for cut in cuts:
        split.receive(rest[:cut])
        split.advance(0.0)
        rest = rest[cut:]
    split.receive(rest)
    split.advance(0.0)
    assert _run(whole) == _run(split)
    assert whole.position_mm == split.position_mm
    assert whole.time_s == split.time_s


@settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow])
@given(_MOVES, st.floats(0.002, 0.05))
def test_the_step_of_time_does_not_matter(
    moves: list[tuple[tuple[float, float, float], str]], step: float
) -> None:
    data = (b"".join(line.encode() + b"\n" for line in _lines(moves)))[:120]
    coarse, fine = _fresh(), _fresh()
    for grbl, dt in ((coarse, 0.008), (fine, step)):
        grbl.receive(data)
        grbl.advance(0.0)
        _run(grbl, dt)
    assert coarse.position_mm == pytest.approx(fine.position_mm, abs=1e-9)
    assert coarse.settled_at == pytest.approx(fine.settled_at, abs=1e-6)


@settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow])
@given(_MOVES, st.floats(0.0, 3.0), st.sampled_from([b"", b"!", b"\x84", b"\x91\x96", b"\x18"]))
def test_a_snapshot_in_mid_motion_continues_identically(
    moves: list[tuple[tuple[float, float, float], str]], when: float, byte: bytes
) -> None:
    grbl = _fresh()
    grbl.receive(b"".join(line.encode() + b"\n" for line in _lines(moves)) + b"M8\n")
    grbl.advance(when)
    grbl.receive(byte)
    grbl.advance(0.01)
    grbl.take_output()
    twin = VirtualGrbl(Machine(TRAVEL, (0.0, 0.0, 0.0)))
    twin.restore(json.loads(json.dumps(grbl.snapshot())))
    assert twin.position_mm == grbl.position_mm
    for _ in range(400):
        for each in (grbl, twin):
            each.receive(b"?")
            each.advance(0.008)
        assert grbl.take_output() == twin.take_output()
        assert grbl.position_mm == twin.position_mm


@pytest.mark.parametrize("when", [0.5, 1.51, 3.0, 3.5, 6.0])
def test_a_snapshot_while_homing_continues_identically(when: float) -> None:
    grbl = VirtualGrbl(Machine(TRAVEL, START))
    grbl.advance(1.5)
    grbl.receive(b"$H\n")
    grbl.advance(when)
    grbl.take_output()
    twin = VirtualGrbl(Machine(TRAVEL, (0.0, 0.0, 0.0)))
    twin.restore(json.loads(json.dumps(grbl.snapshot())))
    assert _run(grbl) == _run(twin)
    assert grbl.position_mm == twin.position_mm


# --- garbage --------------------------------------------------------------------------------------------

_TYPED = (
    "G0 G1 G2 G38.2 G10L2P1 G28 G30.1 G92 G53 G43.1 G93 G20 M0 M30 M3S100 M8 X-1 Y-3.5 Z-2 I1 R4 F100 P1 "
    "$J= $ $H $X $$ $SLP $RST=* $100=0 $120=0 $12=0 $N0=G4P0 ( ) ; / ? ! ~"
)
_BYTES = b"\x18\x84\x85\x91\x96\x9a\x9e\xa0\xc2\n\n\n\n\r "
_WORDS = st.sampled_from(
    [word.encode() for word in _TYPED.split()] + [bytes((byte,)) for byte in _BYTES] + [b"9" * 70]
)


@settings(max_examples=150, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.one_of(_WORDS, st.binary(max_size=12)), max_size=60), st.booleans())
def test_garbage_never_raises_and_leaves_it_answering(parts: list[bytes], homed: bool) -> None:
    grbl = VirtualGrbl(Machine(TRAVEL, START))
    if homed:
        grbl.assume_homed()
    for part in parts:
        grbl.receive(part)
        grbl.advance(0.02)
        json.dumps(grbl.snapshot())
    grbl.take_output()
    grbl.reset_by_dtr()
    grbl.advance(2.0)
    grbl.receive(b"?")
    grbl.advance(0.0)
    assert b"Grbl 1.1h" in grbl.take_output()


def test_starving_asks_for_more_only_while_it_moves(bench: MakeBench) -> None:
    host = bench()
    assert not host.grbl.starving()
    host.send(b"G0X-100\n")
    assert host.grbl.starving()
    host.wait(0.5)
    assert host.grbl.starving()
    host.send(b"M9\nM8\n")
    assert not host.grbl.starving()
    host.settle()
    assert not host.grbl.starving()
