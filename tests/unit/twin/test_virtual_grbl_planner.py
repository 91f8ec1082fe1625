"""The look-ahead against an independent two-pass plan, and the pieces that whole sessions seldom reach."""

import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.errors import TwinError
from kempelen.twin.grbl import Eeprom, Machine, VirtualGrbl, execute
from kempelen.twin.grbl.arcs import arc_points
from kempelen.twin.grbl.motion import Ramp, Stepper
from kempelen.twin.grbl.planner import CAPACITY, Planner
from kempelen.twin.grbl.uart import Uart

TRAVEL = (700.0, 450.0, 200.0)
START = (-400.0, -250.0, -100.0)

Bench = Any
MakeBench = Callable[..., Bench]

_TARGETS = st.lists(
    st.tuples(
        st.tuples(*(st.integers(-3000, 3000).map(lambda n: n / 10) for _ in range(3))),
        st.sampled_from([20.0, 100.0, 300.0]),
        st.booleans(),
    ),
    min_size=1,
    max_size=CAPACITY,
)


def _planner() -> Planner:
    return Planner(Eeprom.for_travel(TRAVEL).settings)


@given(_TARGETS)
def test_the_incremental_plan_is_the_optimal_one(
    moves: list[tuple[tuple[float, float, float], float, bool]],
) -> None:
    planner = _planner()
    for target, rate, rapid in moves:
        planner.append(target, rate, rapid=rapid, inverse=False, fixed=False)
    blocks = planner.blocks
    entries = [block.max_entry for block in blocks] + [0.0]
    entries[0] = 0.0
    for n in range(len(blocks) - 1, 0, -1):
        reachable = entries[n + 1] + 2 * blocks[n].acceleration * blocks[n].length
        entries[n] = min(entries[n], reachable)
    for n in range(len(blocks) - 1):
        reachable = entries[n] + 2 * blocks[n].acceleration * blocks[n].length
        entries[n + 1] = min(entries[n + 1], reachable)
    assert [block.entry for block in blocks] == pytest.approx(entries[:-1], rel=1e-9, abs=1e-9)


def test_sixteen_slots_hold_fifteen_blocks() -> None:
    planner = _planner()
    for n in range(15):
        assert not planner.full
        planner.append((float(n + 1), 0.0, 0.0), 10.0, rapid=False, inverse=False, fixed=False)
    assert planner.full


def test_a_move_shorter_than_a_step_is_no_block() -> None:
    planner = _planner()
    assert not planner.append((0.005, 0.0, 0.0), 10.0, rapid=False, inverse=False, fixed=False)
    assert planner.blocks == []


def test_limits_hold_per_axis_along_a_diagonal() -> None:
    planner = _planner()
    planner.append((100.0, 100.0, 0.0), 1000.0, rapid=True, inverse=False, fixed=False)
    block = planner.blocks[0]
    assert block.nominal == pytest.approx(300.0 * math.sqrt(2))
    assert block.acceleration == pytest.approx(1500.0 * math.sqrt(2))


def test_steps_are_where_blocks_end() -> None:
    planner = _planner()
    planner.append((1.004, 0.0, 0.0), 10.0, rapid=False, inverse=False, fixed=False)
    assert planner.position == (80, 0, 0)
    planner.append((1.012, 0.0, 0.0), 10.0, rapid=False, inverse=False, fixed=False)
    assert planner.position == (81, 0, 0)


def test_a_stepper_without_blocks_stands() -> None:
    stepper = Stepper(_planner())
    assert stepper.velocity() == (0.0, 0.0, 0.0)
    assert stepper.time_left() == 0.0
    assert stepper.finish()
    assert not stepper.tripped()


def test_time_at_a_distance_never_reached() -> None:
    assert Ramp.over(10.0, 0.0, 5.0, 0.0, 100.0).time_at(10.1) == math.inf


def test_a_ramp_too_short_for_its_end_speed_ends_slower() -> None:
    ramp = Ramp.over(1.0, 0.0, 300.0, 300.0, 100.0)
    assert ramp.end_speed == pytest.approx(math.sqrt(200.0))


@pytest.mark.parametrize("clockwise", [False, True])
def test_a_full_circle_comes_back(*, clockwise: bool) -> None:
    points = arc_points(
        (0.0, 0.0, 0.0), (0.0, 0.0, 5.0), (10.0, 0.0), (0, 1, 2), clockwise=clockwise, tolerance=0.01
    )
    assert points[-1] == (0.0, 0.0, 5.0)
    assert len(points) > 50
    assert min(point[1] for point in points) == pytest.approx(-10.0, abs=0.05)
    assert max(point[1] for point in points) == pytest.approx(10.0, abs=0.05)
    first_quarter = points[len(points) // 4]
    assert (first_quarter[1] > 0) == clockwise


def test_the_long_way_round_by_a_negative_radius() -> None:
    short = execute(["G3X-390Y-240R10F1200"], travel=TRAVEL, start=START).time_s
    long = execute(["G3X-390Y-240R-10F1200"], travel=TRAVEL, start=START).time_s
    assert long / short == pytest.approx(3.0, rel=0.15)


def test_arcs_in_other_planes_and_inches() -> None:
    done = execute(["G18 G2 X-390 Z-90 I10 K0 F6000"], travel=TRAVEL, start=START, sample_s=0.01)
    assert tuple(done.samples[-1][1:]) == pytest.approx((-390.0, -250.0, -90.0), abs=0.01)
    done = execute(
        ["G19 G91 G3 Y10 Z10 J10 F6000", "G20 G2 Y1 Z1 J1"], travel=TRAVEL, start=START, sample_s=0.01
    )
    assert tuple(done.samples[-1][1:]) == pytest.approx((-400.0, -214.6, -64.6), abs=0.02)


def test_an_arc_coarser_than_its_tolerance_is_a_line() -> None:
    points = arc_points(
        (0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (1.0, 0.0), (0, 1, 2), clockwise=True, tolerance=5.0
    )
    assert points == [(1.0, 1.0, 0.0)]


def test_an_arc_in_inverse_time() -> None:
    done = execute(["G93 G2 X-300 Y-250 I50 F30"], travel=TRAVEL, start=START)
    assert done.time_s == pytest.approx(2.0, abs=0.1)


def test_a_helix_without_a_chord_by_radius_is_refused() -> None:
    with pytest.raises(TwinError, match="error:33"):
        execute(["G2 X-400 Y-250 Z-90 R5 F100"], travel=TRAVEL, start=START)


def test_execute_gives_up_on_endless_programs() -> None:
    with pytest.raises(TwinError, match="still at work after 3600 s"):
        execute(["G4P3000", "G4P3000"], travel=TRAVEL, start=START, sample_s=10.0)


def test_execute_wants_commands_within_the_travel() -> None:
    with pytest.raises(TwinError, match="ALARM:2"):
        execute(["G0X5"], travel=TRAVEL, start=START)


def test_finely_cut_curves_pass_quickly() -> None:
    """A half circle over 200 mm in 73 pieces takes little longer than without corners."""
    points = [
        (-400 + 100 * (1 - math.cos(n * math.pi / 73)), 100 * math.sin(n * math.pi / 73)) for n in range(74)
    ]
    fine = execute(
        [f"G0X{x:.3f}Y{-300 + y:.3f}" for x, y in points], travel=TRAVEL, start=(-400.0, -300.0, -100.0)
    )
    coarse_points = [*points[::9], points[-1]]
    coarse = execute(
        [f"G0X{x:.3f}Y{-300 + y:.3f}" for x, y in coarse_points],
        travel=TRAVEL,
        start=(-400.0, -300.0, -100.0),
    )
    assert fine.time_s < coarse.time_s


def test_the_carriage_never_jumps(bench: MakeBench) -> None:
    host = bench(homed=False)
    host.wait(1.6)
    host.step_s = 0.002
    script = [
        b"$H\n",
        b"\x18",
        b"$X\n",
        b"$J=G91X5F3000\n",
        b"\x85",
        b"$H\n",
        b"G0X-300\n",
        b"!",
        b"~",
        b"\x18",
    ]
    where = host.grbl.position_mm
    for data in script:
        host.grbl.receive(data)
        for _ in range(600):
            host.grbl.advance(0.002)
            now = host.grbl.position_mm
            moved = max(abs(a - b) for a, b in zip(now, where, strict=True))
            assert moved <= 300.0 * 0.002 + 1.6
            where = now
        if data == b"\x18":
            assert moved < 1e-9


def test_after_an_aborted_homing_the_carriage_stays_where_it_is(bench: MakeBench) -> None:
    host = bench()
    host.send(b"$H\n", 0.6)
    where = host.grbl.position_mm
    host.send(b"\x18", 1.0)
    assert host.grbl.position_mm == pytest.approx(where, abs=0.007)


def test_homing_goes_on_across_a_change_of_the_mind_of_the_switch() -> None:
    """A switch that is mended while the axis searches is found."""
    grbl = VirtualGrbl(Machine(TRAVEL, START))
    grbl.advance(1.6)
    grbl.faults.dead_switches = {0}
    grbl.receive(b"$H\n")
    grbl.advance(1.5)
    grbl.faults.dead_switches = set()
    grbl.advance(15.0)
    assert b"ok" in grbl.take_output()
    assert grbl.position_mm == pytest.approx((-698.0, -448.0, -2.0), abs=1e-6)


def test_a_slow_line_loses_bytes_while_eeprom_is_written() -> None:
    uart = Uart(115200)
    uart.send(b"G90 \n" * 8, 0.0)
    uart.shut_ear(0.0, 1)
    heard = uart.arrived(1.0)
    assert len(heard) == 4
    assert uart.dropped == 36


def test_nothing_is_lost_after_the_write() -> None:
    uart = Uart(0)
    seconds = uart.shut_ear(1.0, 2)
    assert uart.send(b"G4P0\n" * 10, 1.0 + seconds) == b"G4P0\n" * 10
    assert uart.dropped == 0
