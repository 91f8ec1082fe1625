import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.errors import ConfigError, MotionError
from kempelen.core.protocols import Action, Follow, FollowJoints, GripperState, SetGripper
from kempelen.core.table import WorkSpace
from kempelen.robots.grbl.gcode import GripperWiring, Program, compile_group, number

SPACE = WorkSpace()
START = (10.0, 20.0, 30.0)


def follow(*vertices: Sequence[float]) -> Follow:
    return Follow(np.array(vertices, dtype=np.float64), 1.0)


def compiled(*group: Action) -> Program:
    return compile_group(group, START, SPACE, GripperWiring())


@pytest.mark.parametrize(
    ("value", "text"),
    [(12.009, "12.009"), (-0.5, "-0.5"), (0.0, "0"), (-0.0, "0"), (-0.0001, "0"), (100.0, "100"),
     (0.05, "0.05"), (1234.5678, "1234.568"), (1e-9, "0"), (-12.3400001, "-12.34")],
)  # fmt: skip
def test_numbers_keep_leading_zeros_and_signs(value: float, text: str) -> None:
    """The original's formatter made "12.9" of 12.009 and "0.500" of -0.5."""
    assert number(value) == text


@given(st.floats(-9999, 9999))
def test_a_number_reads_back_within_half_a_micrometre(value: float) -> None:
    text = number(value)
    assert abs(float(text) - value) <= 5.0001e-4
    assert "e" not in text


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_none_is_refused(value: float) -> None:
    with pytest.raises(MotionError):
        number(value)


def test_a_group_is_one_program_that_ends_with_a_barrier() -> None:
    program = compiled(follow(START, (10, 20, 100), (60.5, 20, 100)), SetGripper(closed=True, seconds=0.25))
    assert program.lines == (b"G21G54G90G0\n", b"Z100\n", b"X60.5\n", b"M9\n", b"G4P0.25\n")
    assert program.end == (60.5, 20.0, 100.0)
    assert compiled(follow(START, (10, 20, 100))).lines[-1] == b"G4P0\n"
    assert compiled().lines == (b"G21G54G90G0\n", b"G4P0\n")


def test_only_axes_that_change_are_sent() -> None:
    assert compiled(follow(START, START, (10.0001, 20, 30), (11, 20, 30))).lines[1:-1] == (b"X11\n",)


def test_the_gripper_is_known_from_the_acknowledgements() -> None:
    program = compiled(SetGripper(closed=True, seconds=0.1), SetGripper(closed=False, seconds=0.1))
    states = [program.gripper_after(count) for count in range(6)]
    assert states == [
        None,
        None,
        GripperState.CLOSED,
        GripperState.CLOSED,
        GripperState.OPEN,
        GripperState.OPEN,
    ]


@given(st.lists(st.tuples(*(st.floats(0, high) for high in SPACE.upper)), min_size=1, max_size=30))
def test_no_line_is_longer_than_the_controller_takes(points: list[tuple[float, float, float]]) -> None:
    program = compiled(follow(START, *points))
    assert max(map(len, program.lines)) <= 80
    assert all(line.endswith(b"\n") and b"\r" not in line for line in program.lines)


@pytest.mark.parametrize(
    ("vertices", "words"),
    [
        ((START, (701.0, 20, 30)), "x = 701.000 mm, allowed 0 to 700 mm (1.000 mm too far)"),
        ((START, (10, -0.5, 30)), "y = -0.500 mm"),
        ((START, (10, 20, 200.01)), "z = 200.010 mm"),
        ((START, (10, 20, math.nan)), "not finite"),
        (((10, 20, 31), (10, 20, 100)), "1.000 mm apart, allowed 0.1 mm"),
        (((1, 2),), "shape"),
    ],
)
def test_a_path_is_checked_before_the_first_byte(vertices: tuple[Sequence[float], ...], words: str) -> None:
    with pytest.raises(MotionError) as refused:
        compiled(follow(*vertices))
    assert words in str(refused.value)


def test_the_gripper_on_coolant_is_read_from_the_modal_state() -> None:
    wiring = GripperWiring()
    assert wiring.read(["G0", "G54", "M5", "M8", "T7"]) is GripperState.OPEN
    assert wiring.read(["G0", "G54", "M5", "M9", "T7"]) is GripperState.CLOSED
    assert wiring.read(()) is GripperState.UNKNOWN


def test_the_gripper_on_a_servo() -> None:
    wiring = GripperWiring.servo(200, 800)
    assert wiring.line(GripperState.OPEN) == "M3S200"
    assert wiring.line(GripperState.CLOSED) == "M3S800"
    assert wiring.read(["M3", "M9", "S200.0"]) is GripperState.OPEN
    assert wiring.read(["M3", "M9", "S800"]) is GripperState.CLOSED
    assert wiring.read(["M5", "M9", "S800"]) is GripperState.UNKNOWN
    with pytest.raises(ConfigError, match="S300"):
        GripperWiring.servo(300, 300)


def test_a_path_of_joint_angles_is_refused() -> None:
    with pytest.raises(MotionError, match="machine of straight axes"):
        compiled(FollowJoints(np.zeros((2, 5)), np.array([0.0, 1.0]), 1.0))
