"""Every exchange that was seen on the real firmware, one test each."""

import re
from collections.abc import Callable
from typing import Any

import pytest

BANNER = "\r\nGrbl 1.1h ['$' for help]\r\n"
LOCKED = "[MSG:'$H'|'$X' to unlock]\r\n"

Bench = Any
MakeBench = Callable[..., Bench]


def test_open_is_answered_after_a_second_and_a_half(bench: MakeBench) -> None:
    host = bench(homed=False)
    assert host.wait(1.49) == ""
    assert host.wait(0.02) == BANNER + LOCKED


def test_motion_while_locked_is_error_9(bench: MakeBench) -> None:
    host = bench(homed=False)
    host.wait(2.0)
    assert host.send(b"G0 X-10\n") == "error:9\r\n"


def test_jog_in_alarm_is_error_8(bench: MakeBench) -> None:
    host = bench(homed=False)
    host.wait(2.0)
    assert host.send(b"$J=G91X1F600\n") == "error:8\r\n"


def test_homing_answers_ok_and_stands_at_the_pull_off(bench: MakeBench) -> None:
    host = bench(homed=False, start=(-50.0, -50.0, -150.0), settings={10: 0})
    host.wait(2.0)
    assert host.send(b"$H\n") == ""
    begin = host.grbl.time_s
    assert host.settle() == "ok\r\n"
    assert 5.0 < host.grbl.time_s - begin < 14.0
    assert host.status().startswith("<Idle|WPos:-698.000,-448.000,-2.000|FS:0,0")
    assert host.grbl.position_mm == pytest.approx((-698.0, -448.0, -2.0), abs=1e-6)


def test_two_questions_while_homing_get_one_late_answer(bench: MakeBench) -> None:
    host = bench(homed=False)
    host.wait(2.0)
    assert host.send(b"$H\n", 1.0) == ""
    assert host.send(b"?", 1.0) == ""
    assert host.send(b"?", 0.5) == ""
    heard = host.settle()
    assert re.fullmatch(r"<Home\|[^>]*>\r\nok\r\n", heard)


def test_reset_while_homing(bench: MakeBench) -> None:
    host = bench(homed=False)
    host.wait(2.0)
    host.send(b"$H\n", 1.0)
    assert host.send(b"\x18", 0.4) == "ALARM:6\r\n"
    assert host.wait(0.2) == "ok\r\n" + BANNER + LOCKED


def test_homing_without_a_switch(bench: MakeBench) -> None:
    host = bench(homed=False)
    host.grbl.faults.dead_switches.add(2)
    host.wait(2.0)
    host.send(b"$H\n")
    assert host.settle() == "ALARM:9\r\nok\r\n" + BANNER + LOCKED


def test_hold_decelerates_then_stands(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G1 X-100 F6000\n", 1.0)
    assert host.send(b"!?").startswith("<Run|")
    assert re.match(r"<Hold:1\|MPos:[^|]*\|FS:[1-9]", host.send(b"?"))
    host.wait(0.5)
    assert re.match(r"<Hold:0\|MPos:[^|]*\|FS:0,0", host.status())


def test_hold_reports_the_programmed_rate_at_its_beginning(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G1 X-100 F6000\n", 1.0)
    host.send(b"!")
    assert re.match(r"<Hold:1\|MPos:[^|]*\|FS:6000,0", host.status())


def test_lines_in_hold_wait_for_resume(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G1 X-300 F6000\n", 0.2)
    host.send(b"!", 1.0)
    assert host.send(b"G4 P0\n", 1.0) == ""
    assert host.send(b"~", 5.0) == "ok\r\n"
    assert host.status().startswith("<Idle|MPos:-300.000")


def test_reset_in_a_complete_hold_keeps_the_position(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G1 X-100 F6000\n", 1.0)
    host.send(b"!", 1.0)
    place = host.status().split("|")[1]
    assert host.send(b"\x18") == BANNER
    assert host.status().startswith(f"<Idle|{place}|")
    assert host.grbl.position_mm[0] == pytest.approx(float(place[5:].split(",")[0]), abs=0.007)


def test_reset_in_motion_loses_the_position(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G0 X-100\n", 0.7)
    assert host.send(b"\x18") == "ALARM:3\r\n"
    assert host.wait(0.49) == ""
    assert host.wait(0.02) == BANNER + LOCKED
    counted = float(host.status().split("|")[1][5:].split(",")[0])
    assert abs(host.grbl.position_mm[0] - counted) > 0.5
    assert host.grbl.state == "Alarm"


def test_soft_limit_is_a_dead_end_until_reset(bench: MakeBench) -> None:
    host = bench()
    assert host.send(b"G0 X10\n") == "ALARM:2\r\n"
    assert host.wait(0.49) == ""
    assert host.wait(0.02) == "[MSG:Reset to continue]\r\n"
    assert host.send(b"?$X\n", 2.0) == ""
    assert host.send(b"\x18") == "ok\r\n" + BANNER + LOCKED


def test_hard_limit_names_its_axis_after_the_reset(bench: MakeBench) -> None:
    host = bench()
    host.grbl.faults.lose_steps(1, -80 * 20)
    host.send(b"G0 Y-445\n")
    assert host.settle() == "ALARM:1\r\n[MSG:Reset to continue]\r\n"
    assert host.send(b"?$X\n", 2.0) == ""
    assert host.send(b"\x18") == BANNER + "[MSG:Check Limits]\r\n" + LOCKED
    assert "|Pn:Y" in host.status()


@pytest.mark.parametrize(
    ("line", "error"),
    [
        (b"$J=G90X50F1000\n", "error:15\r\n"),
        (b"$J=X-20\n", "error:22\r\n"),
        (b"$J=X-20F100M3\n", "error:16\r\n"),
    ],
)
def test_jogs_refused(bench: MakeBench, line: bytes, error: str) -> None:
    assert bench().send(line) == error


def test_motion_during_a_jog_is_error_9(bench: MakeBench) -> None:
    host = bench()
    host.send(b"$J=G91X-100F3000\n", 0.1)
    assert host.send(b"G0 X-10\n") == "error:9\r\n"


def test_jog_cancel_stops(bench: MakeBench) -> None:
    host = bench()
    assert host.send(b"$J=G91X-200F6000\n", 0.5) == "ok\r\n"
    host.send(b"\x85", 0.5)
    assert host.status().startswith("<Idle|")
    assert -460.0 < host.grbl.position_mm[0] < -440.0


def test_jog_and_cancel_in_one_write_drives_all_of_it(bench: MakeBench) -> None:
    host = bench()
    host.send(b"$J=G91X-30F3000\n\x85")
    host.settle()
    assert host.grbl.position_mm[0] == pytest.approx(-430.0, abs=0.007)


def test_many_jogs_and_cancel_drive_on(bench: MakeBench) -> None:
    host = bench(baud=115200)
    host.send(b"$J=G91X1F300\n" * 25, 1.0)
    host.send(b"\x85", 0.1)
    stopped = host.grbl.position_mm[0]
    host.settle()
    assert 16.0 < host.grbl.position_mm[0] - stopped < 20.0
    assert host.grbl.state == "Idle"


def test_jog_cancel_as_utf8_spoils_the_next_line(bench: MakeBench) -> None:
    host = bench()
    host.send(b"$J=G91X-200F6000\n", 0.5)
    host.send("\x85".encode(), 0.5)
    assert host.status().startswith("<Idle|")
    assert host.send(b"G4P0\n") == "error:1\r\n"
    assert host.send(b"G4P0\n") == "ok\r\n"


@pytest.mark.parametrize("baud", [0, 115200])
def test_sixty_lines_sent_blind(bench: MakeBench, baud: int) -> None:
    host = bench(baud=baud, settings={110: 600.0})
    lines = b"".join(b"G0X-%d\n" % (n % 2 + 1) for n in range(60))
    assert len(lines) == 360
    heard = host.send(lines) + host.settle()
    assert heard == "ok\r\n" * 37
    assert host.send(b"G0X-1\n", 0.1) == "error:24\r\n"


def test_eeprom_write_keeps_the_controller_from_listening(bench: MakeBench) -> None:
    host = bench()
    heard = host.send(b"G10 L20 P1 X0 Y0 Z0\n" + b"G90 \n" * 8, 1.0)
    assert heard == "ok\r\nok\r\n"
    assert host.grbl.dropped == 36


def test_carriage_return_and_newline_are_two_lines(bench: MakeBench) -> None:
    assert bench().send(b"G4P0.01\r\n", 0.2) == "ok\r\nok\r\n"


def test_a_line_of_ninety_characters_is_error_11(bench: MakeBench) -> None:
    assert bench().send(b"G1" + b"X" * 88 + b"\n") == "error:11\r\n"


def test_mist_is_not_compiled_in(bench: MakeBench) -> None:
    assert bench().send(b"M7\n") == "error:20\r\n"


def test_program_pause_waits_for_resume(bench: MakeBench) -> None:
    host = bench()
    assert host.send(b"M0\n", 1.0) == ""
    assert host.status().startswith("<Hold:0|")
    assert host.send(b"~") == "ok\r\n"


def test_leaving_check_mode_resets(bench: MakeBench) -> None:
    host = bench()
    assert host.send(b"$C\n") == "[MSG:Enabled]\r\nok\r\n"
    assert host.send(b"G0X-10\nM8\n") == "ok\r\nok\r\n"
    assert host.status().startswith("<Check|MPos:-400.000")
    assert host.send(b"$C\n") == "[MSG:Disabled]\r\nok\r\n" + BANNER
    assert host.status().startswith("<Idle|")


def test_an_unplugged_machine_finishes_its_move(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G0 X-100\n")
    host.wait(5.0)
    assert host.grbl.position_mm[0] == pytest.approx(-100.0, abs=1e-9)


def test_reopening_in_a_move_resets_the_board(bench: MakeBench) -> None:
    host = bench()
    host.send(b"M8\n")
    host.send(b"G0 X-100\n", 0.5)
    host.grbl.reset_by_dtr()
    assert not host.grbl.flood_on
    assert host.wait(1.6) == BANNER + LOCKED
    assert host.status().startswith("<Alarm|MPos:0.000,0.000,0.000|")


def test_ok_then_idle_can_lie(bench: MakeBench) -> None:
    host = bench()
    assert host.send(b"G0 X-100\n") == "ok\r\n"
    assert host.status().startswith("<Idle|MPos:-400.000")
    host.wait(0.01)
    assert host.status().startswith("<Run|")
