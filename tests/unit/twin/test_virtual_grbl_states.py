"""States, real-time bytes, reports, faults: what happens besides lines."""

import re
from collections.abc import Callable
from typing import Any

import pytest

from kempelen.twin.grbl import Machine, VirtualGrbl

BANNER = "\r\nGrbl 1.1h ['$' for help]\r\n"
LOCKED = "[MSG:'$H'|'$X' to unlock]\r\n"
TRAVEL = (700.0, 450.0, 200.0)

Bench = Any
MakeBench = Callable[..., Bench]


# --- status reports -------------------------------------------------------------------------------------


def test_work_offset_comes_first_then_overrides_then_every_tenth(bench: MakeBench) -> None:
    host = bench()
    reports = [host.status() for _ in range(22)]
    assert [n for n, report in enumerate(reports) if "|WCO:" in report] == [0, 10, 20]
    assert [n for n, report in enumerate(reports) if "|Ov:" in report] == [1, 11, 21]
    assert reports[2] == "<Idle|MPos:-400.000,-250.000,-100.000|FS:0,0>\r\n"


def test_work_offset_comes_every_thirtieth_while_busy(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G1 X-5 F1000\n", 0.1)
    reports = [host.status() for _ in range(62)]
    assert [n for n, report in enumerate(reports) if "|WCO:" in report] == [0, 30, 60]
    assert [n for n, report in enumerate(reports) if "|Ov:" in report] == [1, 21, 41, 61]


def test_accessories_are_named_with_the_overrides(bench: MakeBench) -> None:
    host = bench()
    host.status()
    host.status()
    assert "|A:" not in host.status()
    host.send(b"M8\n")
    assert host.status().endswith("|Ov:100,100,100|A:F>\r\n")
    host.send(b"M4S10\n")
    assert host.status().endswith("|FS:0,10|Ov:100,100,100|A:CF>\r\n")
    host.send(b"M9M5\n")
    assert host.status().endswith("|Ov:100,100,100>\r\n")


def test_the_mask_chooses_what_is_reported(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G10L2P1X-700\n", 0.5)
    host.send(b"$10=2\n", 0.5)
    assert re.match(r"<Idle\|WPos:300\.000,-250\.000,-100\.000\|Bf:15,128\|FS:0,0\|WCO:-700", host.status())
    host.send(b"$13=1\n", 0.5)
    assert host.status().startswith("<Idle|WPos:11.8110,-9.8425,-3.9370|Bf:15,128|FS:0.0,0")


def test_buffer_state_counts_blocks_and_bytes(bench: MakeBench) -> None:
    host = bench(settings={10: 3.0})
    host.send(b"G1X-390F60\nG1X-380\nG1X-370\n", 0.1)
    assert "|Bf:12,128|" in host.status()


# --- holds, doors, sleep --------------------------------------------------------------------------------


def test_hold_at_rest_and_resume(bench: MakeBench) -> None:
    host = bench()
    host.send(b"!")
    assert host.status().startswith("<Hold:0|")
    assert host.send(b"G4P0\n") == ""
    assert host.send(b"~") == "ok\r\n"
    assert host.status().startswith("<Idle|")


def test_hold_across_several_blocks_keeps_the_path(bench: MakeBench) -> None:
    host = bench()
    host.send(b"".join(b"G1X%dF18000\n" % (-395 + 5 * n) for n in range(9)), 0.1)
    host.send(b"!", 1.0)
    x = host.grbl.position_mm[0]
    assert -400.0 < x < -355.0
    host.send(b"~")
    host.settle()
    assert host.grbl.position_mm == pytest.approx((-355.0, -250.0, -100.0), abs=1e-9)


def test_reset_while_decelerating_is_alarm_3(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G0 X-100\n", 0.7)
    assert host.send(b"!\x18") == "ALARM:3\r\n"


def test_a_reset_answers_the_line_that_was_waiting(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G0 X-100\nM8\nM9\n", 0.7)
    assert host.send(b"\x18", 0.6) == "ALARM:3\r\nok\r\n" + BANNER + LOCKED
    assert not host.grbl.flood_on


def test_door_switches_off_and_resume_switches_on_again(bench: MakeBench) -> None:
    host = bench()
    host.send(b"M8\nG0 X-100\n", 0.7)
    assert host.send(b"\x84") == "[MSG:Check Door]\r\n"
    assert host.status().startswith("<Door:2|")
    assert host.grbl.flood_on
    host.wait(0.5)
    assert host.status().startswith("<Door:0|")
    assert not host.grbl.flood_on
    assert host.send(b"~", 0.5) == ""
    assert host.status() == ""  # the processor waits for the coolant
    assert host.grbl.flood_on
    host.settle()
    assert host.grbl.position_mm[0] == pytest.approx(-100.0)


def test_door_restores_the_spindle_first(bench: MakeBench) -> None:
    host = bench()
    host.send(b"M3S100\nM8\n")
    host.send(b"\x84", 0.1)
    assert not host.grbl.spindle_on
    host.send(b"~", 3.9)
    assert host.grbl.spindle_on
    assert not host.grbl.flood_on
    host.wait(0.2)
    assert host.grbl.flood_on
    host.wait(1.0)
    assert host.status().startswith("<Idle|")


def test_door_while_jogging_cancels_the_jog(bench: MakeBench) -> None:
    host = bench()
    host.send(b"$J=G91X-100F6000\n", 0.3)
    assert host.send(b"\x84", 0.5) == "[MSG:Check Door]\r\n"
    assert host.status().startswith("<Door:0|")
    host.send(b"~", 0.1)
    assert host.status().startswith("<Idle|")


def test_door_while_homing_is_alarm_7(bench: MakeBench) -> None:
    host = bench()
    host.send(b"$H\n", 0.5)
    assert host.send(b"\x84", 1.0) == "ALARM:7\r\nok\r\n" + BANNER + LOCKED


def test_hold_while_homing_is_ignored(bench: MakeBench) -> None:
    host = bench()
    host.send(b"$H\n", 0.5)
    host.send(b"!~\x85")
    assert host.settle() == "ok\r\n"
    assert host.status().startswith("<Idle|")


def test_sleep_ends_with_a_reset(bench: MakeBench) -> None:
    host = bench()
    host.send(b"M8\n")
    assert host.send(b"$SLP\n") == "ok\r\n[MSG:Sleeping]\r\n"
    assert not host.grbl.flood_on
    assert host.status().startswith("<Sleep|")
    assert host.send(b"$X\n", 1.0) == ""
    assert host.grbl.idle()
    assert host.send(b"\x18") == BANNER + LOCKED


def test_sleep_in_alarm(bench: MakeBench) -> None:
    host = bench(homed=False)
    host.wait(2.0)
    assert host.send(b"$SLP\n") == "ok\r\n[MSG:Sleeping]\r\n"


def test_spindle_stop_in_hold(bench: MakeBench) -> None:
    host = bench()
    host.send(b"M3S100\nG1X-100F6000\n", 0.3)
    host.send(b"!", 0.5)
    host.send(b"\x9e")
    assert not host.grbl.spindle_on
    host.send(b"\x9e")
    assert host.grbl.spindle_on
    host.send(b"\x9e")
    assert host.send(b"~") == "[MSG:Restoring spindle]\r\n"
    assert host.grbl.spindle_on


def test_flood_toggle_at_any_time_but_alarm(bench: MakeBench) -> None:
    host = bench()
    host.send(b"\xa0")
    assert host.grbl.flood_on
    host.send(b"\xa0")
    assert not host.grbl.flood_on
    host.grbl.reset_by_dtr()
    host.wait(2.0)
    host.send(b"\xa0")
    assert not host.grbl.flood_on


# --- overrides ------------------------------------------------------------------------------------------


def test_feed_override_changes_the_motion_under_way(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G1X-100F6000\n", 0.5)
    host.send(b"\x92\x94", 0.3)
    assert "|FS:5340,0" in host.status()
    host.send(b"\x90\x91", 0.3)
    assert "|FS:6600,0" in host.status()
    for _ in range(30):
        host.send(b"\x92")
    host.wait(0.5)
    assert "|FS:600,0" in host.status()


def test_rapid_override_slows_rapids_only(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G0X-100\n", 0.4)
    host.send(b"\x97", 0.3)
    assert "|FS:4500,0" in host.status()
    host.send(b"\x96", 0.3)
    assert "|FS:9000,0" in host.status()
    host.send(b"\x95", 0.3)
    host.settle()
    host.send(b"\x97")
    host.send(b"G1X-300F6000\n", 0.5)
    assert "|FS:6000,0" in host.status()


def test_jogs_know_no_override(bench: MakeBench) -> None:
    host = bench()
    host.send(b"\x92")
    host.send(b"$J=G91X100F6000\n", 0.5)
    assert "<Jog|" in (report := host.status())
    assert "|FS:6000,0" in report


# --- limits and homing ----------------------------------------------------------------------------------


def test_soft_limit_in_motion_stops_before_it_complains(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G1 X-300 F6000\nG1 X-200\n", 0.3)
    heard = host.send(b"G1 X50\n")
    assert heard == ""
    heard = host.wait(1.0)
    assert heard == "ALARM:2\r\n[MSG:Reset to continue]\r\n"
    assert host.send(b"\x18") == "ok\r\n" + BANNER + LOCKED
    x = float(re.findall(r"MPos:(-?[\d.]+)", host.status())[0])
    assert x == pytest.approx(host.grbl.position_mm[0], abs=0.007)


def test_moving_off_a_pressed_switch_is_a_change_too(bench: MakeBench) -> None:
    host = bench()
    host.grbl.faults.lose_steps(0, -80 * 20)
    host.send(b"G0 X-690\n")
    host.settle()
    host.send(b"\x18", 0.1)
    host.send(b"$X\n")
    assert "ALARM:1" in host.send(b"$J=G91X5F600\n", 1.0)


def test_without_hard_limits_the_carriage_grinds_against_its_end(bench: MakeBench) -> None:
    host = bench(settings={21: 0.0})
    host.grbl.faults.lose_steps(0, -80 * 50)
    host.send(b"G0 X-690\n")
    assert "ALARM" not in host.settle()
    assert host.grbl.position_mm[0] == pytest.approx(-701.5)
    host.send(b"G0 X-600\n")
    host.settle()
    assert host.grbl.position_mm[0] == pytest.approx(-611.5)
    assert host.status().startswith("<Idle|MPos:-600.000")


def test_homing_finds_lost_steps_again(bench: MakeBench) -> None:
    host = bench()
    host.grbl.faults.lose_steps(0, 400)
    host.wait(0.01)
    assert host.grbl.position_mm[0] == pytest.approx(-395.0)
    host.send(b"$H\n")
    host.settle()
    host.send(b"G0X-400\n")
    host.settle()
    assert host.grbl.position_mm[0] == pytest.approx(-400.0, abs=1e-6)


@pytest.mark.parametrize(
    "start", [(-700.0, -450.0, 0.0), (-701.5, -451.5, 1.5), (0.0, 0.0, -200.0), (-699.0, -1.0, -5.0)]
)
def test_homing_from_anywhere(start: tuple[float, float, float]) -> None:
    grbl = VirtualGrbl(Machine(TRAVEL, start))
    grbl.advance(1.6)
    grbl.receive(b"$H\n")
    grbl.advance(30.0)
    assert grbl.take_output().endswith(LOCKED.encode() + b"ok\r\n")
    assert grbl.position_mm == pytest.approx((-698.0, -448.0, -2.0), abs=1e-6)


def test_homing_towards_the_wrong_end_is_alarm_9(bench: MakeBench) -> None:
    host = bench(settings={23: 0.0})
    host.send(b"$H\n")
    assert "ALARM:9\r\n" in host.settle()


def test_too_short_a_pull_off_is_alarm_8(bench: MakeBench) -> None:
    host = bench(settings={27: 0.0})
    host.send(b"$H\n")
    assert "ALARM:8\r\n" in host.settle()


def test_homing_x_and_y_at_the_same_time_z_first(bench: MakeBench) -> None:
    host = bench()
    host.send(b"$H\n", 0.8)
    assert host.grbl.position_mm[:2] == (-400.0, -250.0)
    host.wait(2.5)
    before = host.grbl.position_mm
    host.wait(0.1)
    after = host.grbl.position_mm
    assert after[0] - before[0] == pytest.approx(-10.0)
    assert after[1] - before[1] == pytest.approx(-10.0)


# --- faults ---------------------------------------------------------------------------------------------


def test_a_stalled_axis_stays_while_the_controller_counts(bench: MakeBench) -> None:
    host = bench()
    host.grbl.faults.stalled.add(0)
    host.send(b"G0 X-300 Y-200\n")
    host.settle()
    assert host.grbl.position_mm == pytest.approx((-400.0, -200.0, -100.0))
    host.grbl.faults.stalled.clear()
    host.send(b"G0 X-200\n")
    host.settle()
    assert host.grbl.position_mm[0] == pytest.approx(-300.0)
    assert host.status().startswith("<Idle|MPos:-200.000")


def test_a_stalled_axis_cannot_home(bench: MakeBench) -> None:
    host = bench()
    host.grbl.faults.stalled.add(1)
    host.send(b"$H\n")
    assert "ALARM:9\r\n" in host.settle()


def test_lost_steps_that_press_a_switch_raise_the_alarm_at_once(bench: MakeBench) -> None:
    host = bench()
    host.grbl.faults.lose_steps(0, -80 * 300)
    assert host.wait(0.01) == "ALARM:1\r\n"


def test_a_swallowed_ok_is_missing(bench: MakeBench) -> None:
    host = bench()
    host.grbl.faults.swallow_oks = 1
    assert host.send(b"G4P0\nG4P0\n") == "ok\r\n"


def test_late_answers(bench: MakeBench) -> None:
    host = bench()
    host.grbl.faults.reply_delay_s = 0.5
    assert host.send(b"G4P0\n", 0.49) == ""
    assert not host.grbl.idle()
    assert host.wait(0.02) == "ok\r\n"


def test_noise_is_reproducible_and_stops(bench: MakeBench) -> None:
    heard = []
    for _ in range(2):
        host = bench()
        host.grbl.faults.garble_in = 0.3
        host.grbl.faults.garble_out = 0.2
        heard.append("".join(host.send(b"G4P0\n") for _ in range(20)))
        host.grbl.faults.garble_in = host.grbl.faults.garble_out = 0.0
        host.grbl.reset_by_dtr()
        assert host.wait(2.0) == BANNER + LOCKED
    assert heard[0] == heard[1]
    assert heard[0] != "ok\r\n" * 20


def test_a_spontaneous_reset(bench: MakeBench) -> None:
    host = bench()
    host.send(b"M8\nG0X-100\n", 0.5)
    host.grbl.faults.reset = True
    assert host.wait(2.0) == BANNER + LOCKED
    assert not host.grbl.flood_on
    assert host.grbl.position_mm[0] < -200.0


def test_a_link_drop_is_told_once(bench: MakeBench) -> None:
    faults = bench().grbl.faults
    assert not faults.take_link_drop()
    faults.link_drop = True
    assert faults.take_link_drop()
    assert not faults.take_link_drop()


# --- the line -------------------------------------------------------------------------------------------


def test_a_slow_line_delays_both_ways(bench: MakeBench) -> None:
    host = bench(baud=9600)
    heard = host.send(b"G4P0\n", 0.005)
    assert heard == ""
    assert not host.grbl.idle()
    assert host.wait(0.02) == "ok\r\n"


def test_real_time_bytes_overtake_waiting_lines(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G0X-100\nG4P0\nG4P0\n", 0.3)
    assert host.status().startswith("<Run|")


def test_bytes_beyond_the_ring_are_dropped_silently(bench: MakeBench) -> None:
    host = bench()
    host.send(b"!")
    host.send(b"G4P0\n" * 40)
    assert host.grbl.dropped == 200 - 128
    heard = host.send(b"~") + host.settle()
    assert heard == "ok\r\n" * 25


def test_reading_goes_on_in_check_mode_without_motion(bench: MakeBench) -> None:
    host = bench()
    host.send(b"$C\n")
    assert host.send(b"M3S5\nM8\nG4P5\nG38.2X-5F100\nM0\nM30\n") == "ok\r\n" * 5 + "[MSG:Pgm End]\r\nok\r\n"
    assert not host.grbl.flood_on
    assert host.send(b"G0X5\n", 1.0).startswith("ALARM:2\r\n")
