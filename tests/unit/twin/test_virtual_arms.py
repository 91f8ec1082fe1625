"""Virtual controllers of arms: a G-code controller of five axes and the latch bridge, byte by byte."""

import json
from math import degrees, radians

import numpy as np
import pytest

from kempelen.core.errors import TwinError
from kempelen.kinematics import Arm, load_arm
from kempelen.twin.grbl import GRBL, VirtualArm
from kempelen.twin.latch import VirtualLatch
from kempelen.twin.latch.bridge import PHASES
from kempelen.twin.latch.frames import frame

ARM = load_arm("labvolt-5150")
HOME = tuple(np.degrees(ARM.home).tolist())


class Host:
    """Types at a controller."""

    def __init__(self, board: VirtualArm | VirtualLatch, *, booted: bool = True) -> None:
        self.board = board
        self.number = 0
        if booted:
            self.wait(2.0)

    def wait(self, seconds: float) -> str:
        heard, end = "", self.board.time_s + seconds
        self.board.advance(0.0)
        while True:
            heard += self.board.take_output().decode()
            if self.board.time_s >= end:
                return heard
            self.board.advance(0.01)

    def type(self, line: str, seconds: float = 0.0) -> str:
        self.board.receive(f"{line}\n".encode())
        return self.wait(seconds)

    def command(self, body: str, seconds: float = 0.0) -> list[str]:
        """A numbered frame to the bridge; the answers without their checksums."""
        self.board.receive(frame(f"{self.number} {body}").replace(b"\r", b""))
        self.number = self.number % 255 + 1
        return [line[:-5] for line in self.wait(seconds).split("\r\n") if line]

    def settle(self) -> str:
        heard = self.wait(0.0)
        while not self.board.idle():
            heard += self.wait(0.05)
        return heard


def in_degrees(board: VirtualArm | VirtualLatch) -> list[float]:
    return [round(degrees(angle), 6) for angle in board.joints]


# --- five axes ----------------------------------------------------------------------------------------------


def test_five_axes_are_reported() -> None:
    host = Host(VirtualArm(ARM))
    assert "[AXS:5:XYZAB]" in host.type("$I")
    zero = "0.000,0.000,0.000,0.000,0.000"
    assert f"<Alarm|MPos:{zero}|" in host.type("?")
    assert f"[G54:{zero}]" in host.type("$#")
    listed = host.type("$$")
    assert [listed.count(f"${number}=") for number in (44, 48, 104, 114, 124, 134, 105)] == [1] * 6 + [0]


def test_a_firmware_of_other_axes_is_refused() -> None:
    with pytest.raises(TwinError, match="3 axes here, labvolt-5150 has 5 joints"):
        VirtualArm(ARM, dialect=GRBL)


def test_all_axes_home_in_their_order() -> None:
    board = VirtualArm(ARM)
    host = Host(board)
    host.type("$H")
    first = board.joints
    host.wait(0.5)
    moved = [abs(a - b) > 1e-9 for a, b in zip(board.joints, first, strict=True)]
    assert moved == [False, True, True, True, False]  # the shoulder, and what hangs on it
    host.settle()
    assert in_degrees(board) == pytest.approx(HOME)
    assert board.homings == 1
    assert board.motors == pytest.approx(board.told)


def test_one_axis_homes_alone_where_that_is_allowed() -> None:
    board = VirtualArm(ARM)
    host = Host(board)
    before = in_degrees(board)
    host.type("$HB")
    host.settle()
    assert in_degrees(board) == pytest.approx([*before[:4], HOME[4]])
    assert board.homings == 0
    host.type("$22=1", 0.2)
    assert host.type("$HY") == "error:5\r\n"


def test_inverse_time_turns_all_motors_together() -> None:
    board = VirtualArm(ARM)
    board.assume_homed()
    host = Host(board, booted=False)
    start = np.array(board.told)
    host.type("G21G91G93G1X10Y-5Z2A0B7F30", 0.0)
    host.wait(1.0)
    half = np.degrees(np.array(board.told) - start)
    assert half == pytest.approx([5, -2.5, 1, 0, 3.5], rel=0.06, abs=1e-9)
    host.settle()
    assert np.degrees(np.array(board.told) - start) == pytest.approx([10, -5, 2, 0, 7])
    assert board.settled_at == pytest.approx(2.0, abs=0.06)


def test_an_unknown_axis_and_a_missing_feed_are_errors() -> None:
    board = VirtualArm(ARM)
    board.assume_homed()
    host = Host(board, booted=False)
    assert host.type("G0C5") == "error:20\r\n"
    assert host.type("G93G1A5") == "error:22\r\n"


def test_joints_stop_at_their_ends_and_lose_steps() -> None:
    board = VirtualArm(ARM)
    board.assume_homed()
    host = Host(board, booted=False)
    host.type("G91G0Y200")
    host.settle()
    assert in_degrees(board)[1] == pytest.approx(149 + 4)
    assert degrees(board.told[1] - board.motors[1]) > 100


def test_the_coupling_drags_what_hangs_on_a_joint() -> None:
    board = VirtualArm(ARM, np.radians([0.0, 60.0, -60.0, 30.0, 0.0]).tolist())
    board.assume_homed()
    host = Host(board, booted=False)
    before = in_degrees(board)
    host.type("G91G0Y10")
    host.settle()
    turned = np.subtract(in_degrees(board), before)
    assert turned == pytest.approx([0, 10, 10, 10, 0])


# --- the bridge ---------------------------------------------------------------------------------------------


def homed(arm: Arm = ARM) -> Host:
    board = VirtualLatch(arm)
    board.assume_homed()
    return Host(board, booted=False)


def test_the_bridge_greets_and_tells_what_it_is() -> None:
    board = VirtualLatch(ARM)
    assert Host(board, booted=False).wait(1.5) == "Kempelen latch bridge 1, 5 motors*2F7E\r\n"
    host = Host(board, booted=False)
    assert host.command("I") == ["[VER:1]", "[AXS:5]", "[QUE:64]", "ok 0"]
    assert host.type("?").startswith("<Alarm|P:0,0,0,0,0|Q:64|L:|G:c|K:0>*")


def test_a_block_makes_its_steps_in_its_time() -> None:
    host = homed()
    start = np.array(host.board.told)
    assert host.command("B 1000 400 -200 100 0 7") == ["ok 0"]
    host.wait(0.5)
    half = np.degrees(np.array(host.board.told) - start) * 20
    assert half == pytest.approx([200, -100, 50, 0, 3.5], abs=2)
    host.settle()
    assert np.degrees(np.array(host.board.told) - start) * 20 == pytest.approx([400, -200, 100, 0, 7])
    assert host.board.settled_at == pytest.approx(1.0, abs=0.02)


def test_latches_hold_the_phases_of_their_counts() -> None:
    host = homed()
    assert isinstance(host.board, VirtualLatch)
    seen = []
    for _ in range(9):
        seen.append(host.board.nibbles[0])
        host.command("B 1 1 0 0 0 0")
        host.settle()
    first = PHASES.index(seen[0])
    assert seen == [PHASES[(first + k) % 8] for k in range(9)]


@pytest.mark.parametrize(
    ("line", "code"),
    [("B 1000 1 2 3 4 5*0000", 101), ("no frame at all", 101), ("x" * 120, 103)],
)
def test_damaged_lines(line: str, code: int) -> None:
    host = homed()
    assert host.type(line).startswith(f"error {code} 0*")


@pytest.mark.parametrize(
    ("body", "code"),
    [("B 10 41 0 0 0 0", 3), ("B 0 0 0 0 0 0", 2), ("B 10 1", 1), ("Q", 1), ("G 2", 2), ("W", 1),
     ("H 7 1 100 10 10 100 0", 2), ("H 1 1 100", 1), ("H 1 1 9000 10 10 100 0", 3)],
)  # fmt: skip
def test_wrong_commands(body: str, code: int) -> None:
    host = homed()
    assert host.command(body) == [f"error {code} 1"]
    assert host.command("I")[-1] == "ok 1"


def test_nothing_is_done_after_a_line_that_was_lost() -> None:
    host = homed()
    host.command("B 100 10 0 0 0 0", 0.3)
    host.number = 5
    before = host.board.told
    assert host.command("B 100 10 0 0 0 0", 0.3) == ["error 102 1"]
    assert host.board.told == before
    host.number = 0  # a program that begins anew
    assert host.command("B 100 10 0 0 0 0", 0.3) == ["ok 0"]
    assert host.board.told != before


def test_a_locked_bridge_moves_nothing() -> None:
    host = Host(VirtualLatch(ARM))
    assert host.command("B 100 1 0 0 0 0") == ["error 9 1"]
    assert host.command("E") == ["error 9 2"]
    assert host.command("X") == ["ok 2"]
    assert host.command("B 100 1 0 0 0 0") == ["ok 3"]


def test_a_reset_in_motion_loses_the_counts_and_closes_the_gripper() -> None:
    host = homed()
    host.command("G 0", 0.01)
    assert "|G:o|" in host.type("?")
    host.command("B 1000 400 0 0 0 0", 0.3)
    host.board.receive(b"\x18")
    heard = host.wait(0.0)
    assert heard.startswith("alarm 3*")
    assert "Kempelen latch bridge" in heard
    assert host.board.gripper_closed
    resting = host.board.motors
    host.wait(0.5)
    assert host.board.motors == resting


def test_a_jog_ends_with_a_byte() -> None:
    host = homed()
    start = host.board.told[0]
    for _ in range(5):
        host.command("J 200 80 0 0 0 0")
    host.wait(0.3)
    host.board.receive(b"\x85")
    host.settle()
    assert host.type("?").startswith("<Idle|")
    turned = degrees(host.board.told[0] - start) * 20
    assert 100 < turned < 200  # of 400


def test_homing_tells_where_the_switch_closed() -> None:
    host = Host(VirtualLatch(ARM))
    host.command("H 1 1 500 60 40 6000 1800", 20.0)
    host.board.faults.lose_steps(1, 25)
    answers = host.command("H 1 1 500 60 40 6000 1800", 20.0)
    assert answers == ["[HOM:1815]", "ok 1"]
    assert degrees(host.board.told[1]) == 90.0
    assert degrees(host.board.joints[1]) == pytest.approx(90.0, abs=0.051)


# --- put away and taken up again ----------------------------------------------------------------------------


def lines_of(board: VirtualArm | VirtualLatch) -> bytes:
    if isinstance(board, VirtualArm):
        return b"G91G93G1X40Y-20Z10A5B-30F20\n"
    return frame("0 B 3000 800 -400 200 100 -600").replace(b"\r", b"")


@pytest.mark.parametrize("kind", [VirtualArm, VirtualLatch])
def test_it_goes_on_where_it_was_put_away(kind: type[VirtualArm | VirtualLatch]) -> None:
    boards = [kind(ARM), kind(ARM, [radians(3)] * 5)]
    first, second = boards
    first.assume_homed()
    first.receive(lines_of(first))
    for _ in range(100):
        first.advance(0.01)
    second.restore(json.loads(json.dumps(first.snapshot())))
    for board in boards:
        for _ in range(400):
            board.advance(0.01)
    assert second.joints == first.joints
    assert second.idle()
    assert second.homings == first.homings
