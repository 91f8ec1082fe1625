"""Lines and their answers: G-code, $ commands, comments, errors by their numbers."""

from collections.abc import Callable
from typing import Any

import pytest

Bench = Any
MakeBench = Callable[..., Bench]


@pytest.mark.parametrize(
    ("line", "error"),
    [
        (b"1G0", 1),
        (b"G0X1\xc2", 1),
        (b"GX1", 2),
        (b"G1X.F100", 2),
        (b"G0X--1", 2),
        (b"$J G1", 3),
        (b"$$$", 3),
        (b"$HX", 3),
        (b"$SLEEP", 3),
        (b"$RST=x", 3),
        (b"$9=1", 3),
        (b"$300=1", 3),
        (b"$0", 3),
        (b"$0=", 2),
        (b"$Q", 2),
        (b"$110=-5", 4),
        (b"G1X-1F-5", 4),
        (b"$0=2", 6),
        (b"G5X1", 20),
        (b"G59.1", 23),
        (b"G1.5X1", 23),
        (b"G28.2", 20),
        (b"G38.6X1", 20),
        (b"G43Z1", 20),
        (b"G61.1", 20),
        (b"G90.1", 20),
        (b"M6", 20),
        (b"M3.1", 23),
        (b"D1", 20),
        (b"G17G18", 21),
        (b"M3M4", 21),
        (b"G1X-10", 22),
        (b"G93G1X-10", 22),
        (b"G0G10L2P1X0", 24),
        (b"G0G1X1F1", 24),
        (b"G43.1G0Z1", 24),
        (b"G0X1X2", 25),
        (b"G10L2P1", 26),
        (b"G92", 26),
        (b"G2I1F100", 26),
        (b"G38.2F10", 26),
        (b"N10000001G0X-1", 27),
        (b"G4", 28),
        (b"G10X1", 28),
        (b"G10L2P9X0", 29),
        (b"G10L3P1X0", 20),
        (b"G10L2P1X0R5", 20),
        (b"G2G53X-1Y-1I1F100", 30),
        (b"G80X1", 31),
        (b"G17G2Z-1I1F100", 32),
        (b"G2X-300Y-200I1J1F100", 33),
        (b"G38.2X-400F100", 33),
        (b"G2X-400Y-250R5F100", 33),
        (b"G2X-300Y-250R5F100", 34),
        (b"G2X-300Y-250K5F100", 35),
        (b"G0X-1P5", 36),
        (b"G1F100I5", 36),
        (b"G43.1X1", 37),
        (b"T256", 38),
        (b"$J=F100G1X1Y", 2),
        (b"$J=X-1F100S5", 36),
        (b"$J=X-1F100G10", 28),
        (b"$J=G55X-1F100", 16),
        (b"$J=G4P1X-1F100", 16),
    ],
)
def test_errors_have_their_numbers(bench: MakeBench, line: bytes, error: int) -> None:
    host = bench()
    before = host.grbl.snapshot()["parser"]
    assert host.send(line + b"\n") == f"error:{error}\r\n"
    assert host.grbl.snapshot()["parser"] == before
    assert host.send(b"G4P0\n") == "ok\r\n"


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"   ",
        b"(only a comment)",
        b"; only a comment",
        b"g0 x-390 (there) y-240",
        b"G0 X-390 ; and then",
        b"/G0X-390",
        b"(a)(b)G0X-390",
        b"G00 X-390.",
        b"G40G49G80G17G21G90G94G54G91.1G61M5M9",
        b"M1",
        b"F100",
        b"T3",
        b"N5 G0 X-390",
        b"G0",
        b"G49.7",
        b"S100",
    ],
)
def test_lines_that_are_fine(bench: MakeBench, line: bytes) -> None:
    assert bench().send(line + b"\n") == "ok\r\n"


def test_79_characters_fit_and_80_do_not(bench: MakeBench) -> None:
    host = bench()
    assert host.send(b"G4P0" + b"0" * 75 + b"\n") == "ok\r\n"
    assert host.send(b"G4P0" + b"0" * 76 + b"\n") == "error:11\r\n"
    assert host.send(b"G4P0(" + b"c" * 90 + b")\n") == "ok\r\n"
    assert host.send(b"(c)G4P0" + b"0" * 76 + b"\n") == "error:11\r\n"


def test_settings_are_listed_as_the_firmware_does(bench: MakeBench) -> None:
    listing = bench().send(b"$$\n").split("\r\n")
    assert listing[0] == "$0=10"
    assert {"$1=255", "$11=0.020", "$12=0.002", "$20=1", "$23=3", "$27=2.000", "$30=1000", "$32=0"} < set(
        listing
    )
    assert {"$100=80.000", "$110=18000.000", "$120=1500.000", "$130=700.000", "$132=200.000"} < set(listing)
    assert listing[-2:] == ["ok", ""]
    assert len(listing) == 34 + 2


def test_settings_are_stored_and_survive_a_board_reset(bench: MakeBench) -> None:
    host = bench()
    assert host.send(b"$110=6000\n") == ""  # the EEPROM is being written
    assert host.wait(0.1) == "ok\r\n"
    host.grbl.reset_by_dtr()
    host.wait(2.0)
    assert "$110=6000.000\r\n" in host.send(b"$$\n")
    assert host.send(b"$X\n") == "[MSG:Caution: Unlocked]\r\nok\r\n"


def test_an_unchanged_setting_is_not_written(bench: MakeBench) -> None:
    assert bench().send(b"$110=18000\n") == "ok\r\n"


def test_soft_limits_need_homing(bench: MakeBench) -> None:
    host = bench()
    host.send(b"$22=0\n", 0.1)
    assert "$20=0\r\n" in host.send(b"$$\n")
    assert host.send(b"$20=1\n") == "error:10\r\n"
    assert host.send(b"$H\n") == "error:5\r\n"


def test_without_homing_nothing_is_locked_at_power_up(bench: MakeBench) -> None:
    host = bench(homed=False, settings={22: 0.0})
    assert host.wait(1.6) == "\r\nGrbl 1.1h ['$' for help]\r\n"
    assert host.status().startswith("<Idle|")


def test_restore_defaults(bench: MakeBench) -> None:
    host = bench()
    host.send(b"$110=6000\n", 0.1)
    host.send(b"G10L2P2X-5\n", 0.1)
    heard = host.send(b"$RST=$\n", 2.0)
    assert heard == "[MSG:Restoring defaults]\r\nok\r\n\r\nGrbl 1.1h ['$' for help]\r\n"
    assert "$110=18000.000\r\n" in host.send(b"$$\n")
    assert "[G55:-5.000,0.000,0.000]" in host.send(b"$#\n")
    host.send(b"$RST=#\n", 2.0)
    assert "[G55:0.000,0.000,0.000]" in host.send(b"$#\n")
    host.send(b"$N0=G4P0\n", 1.0)
    host.send(b"$RST=*\n", 2.0)
    assert host.send(b"$N\n") == "$N0=\r\n$N1=\r\nok\r\n"


def test_parameters_and_modes(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G10 L2 P1 X-700 Y-450 Z-200\n", 0.2)
    host.send(b"G92 Z5\n")
    host.send(b"G43.1 Z1.5\n")
    host.send(b"G28.1\n", 0.2)
    listing = host.send(b"$#\n")
    assert "[G54:-700.000,-450.000,-200.000]\r\n" in listing
    assert "[G28:-400.000,-250.000,-100.000]\r\n" in listing
    assert "[G92:0.000,0.000,95.000]\r\n[TLO:1.500]\r\n[PRB:0.000,0.000,0.000:0]\r\nok\r\n" in listing
    host.send(b"G1 F1500\nG91 G18 G20\nM3 S500\nT2\n", 0.1)
    assert host.send(b"$G\n") == "[GC:G1 G54 G18 G20 G91 G94 M3 M9 T2 F1500 S500]\r\nok\r\n"


def test_build_info_help_and_startup_lines(bench: MakeBench) -> None:
    host = bench()
    assert host.send(b"$I\n") == "[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\nok\r\n"
    host.send(b"$I=CHESS\n", 0.2)
    assert host.send(b"$I\n").startswith("[VER:1.1h.20190830:CHESS]\r\n")
    assert host.send(b"$\n").startswith("[HLP:$$ $# $G $I $N $x=val")
    assert host.send(b"$N0=G20\n", 0.2) == "ok\r\n"
    assert host.send(b"$N1=Q7\n") == "error:20\r\n"
    assert host.send(b"$N7=G20\n") == "error:3\r\n"
    assert host.send(b"$N\n") == "$N0=G20\r\n$N1=\r\nok\r\n"
    assert host.send(b"\x18") == "\r\nGrbl 1.1h ['$' for help]\r\n>G20:ok\r\n"


def test_work_coordinates(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G10 L2 P1 X-695 Y-445 Z-195\n", 0.3)
    host.send(b"G0 X100 Y50 Z25\n")
    host.settle()
    assert host.grbl.position_mm == pytest.approx((-595.0, -395.0, -170.0), abs=1e-9)
    host.send(b"G53 G0 Z-5\n")
    host.settle()
    assert host.grbl.position_mm[2] == pytest.approx(-5.0)
    host.send(b"G91 G0 X10\n")
    host.send(b"G20 G0 X1\n")
    host.settle()
    assert host.grbl.position_mm[0] == pytest.approx(-595.0 + 10 + 25.4, abs=0.007)
    host.send(b"G21 G90 G10 L20 P0 X0\n", 0.3)
    host.send(b"G0 X-100\n")
    host.settle()
    assert host.grbl.position_mm[0] == pytest.approx(-559.6 - 100, abs=0.02)
    host.send(b"G55 G0 X-10\n")
    host.settle()
    assert host.grbl.position_mm[0] == pytest.approx(-10.0, abs=0.007)


def test_predefined_positions(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G28.1\n", 0.3)
    host.send(b"G0 X-100 Y-100\n")
    host.settle()
    host.send(b"G91 G28 Z5\n")
    host.settle()
    assert host.grbl.position_mm == pytest.approx((-100.0, -100.0, -100.0), abs=0.01)
    host.send(b"G90 G28\n")
    host.settle()
    assert host.grbl.position_mm == pytest.approx((-400.0, -250.0, -100.0), abs=0.01)


def test_g92_is_forgotten_by_a_reset(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G92 X0\n")
    assert "|WCO:-400.000,0.000,0.000" in host.status()
    host.send(b"\x18")
    assert "|WCO:0.000,0.000,0.000" in host.status()


def test_program_end_resets_modes(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G91 G55 M8\nM3 S100\n")
    assert host.grbl.flood_on
    assert host.grbl.spindle_rpm == 100.0
    assert host.send(b"M30\n") == "[MSG:Pgm End]\r\nok\r\n"
    assert not host.grbl.flood_on
    assert not host.grbl.spindle_on
    assert host.send(b"$G\n").startswith("[GC:G1 G54 G17 G21 G90 G94 M5 M9")


def test_coolant_waits_for_the_motion_before_it(bench: MakeBench) -> None:
    host = bench()
    assert host.send(b"G0 X-300\nM8\n") == "ok\r\n"
    assert not host.grbl.flood_on
    assert host.settle() == "ok\r\n"
    assert host.grbl.flood_on


def test_a_dwell_lasts_full_twentieths_of_a_second(bench: MakeBench) -> None:
    host = bench()
    assert host.send(b"G4 P0.3\n", 0.29) == ""
    assert host.wait(0.02) == "ok\r\n"
    assert host.send(b"G4 P0.01\n", 0.04) == ""
    assert host.wait(0.02) == "ok\r\n"


def test_speed_is_bounded_and_follows_its_override(bench: MakeBench) -> None:
    host = bench()
    host.send(b"M3 S5000\n")
    assert host.grbl.spindle_rpm == 1000.0
    host.send(b"S500\n")
    assert host.grbl.spindle_rpm == 500.0
    host.send(b"\x9a")
    assert host.grbl.spindle_rpm == pytest.approx(550.0)
    host.send(b"\x99\x9b\x9c")
    assert host.grbl.spindle_rpm == pytest.approx(455.0)


def test_probing_without_a_probe(bench: MakeBench) -> None:
    host = bench()
    heard = host.send(b"G38.3 X-390 F6000\n") + host.settle()
    assert heard == "[PRB:-390.000,-250.000,-100.000:0]\r\nok\r\n"
    heard = host.send(b"G38.2 X-380 F6000\n") + host.settle()
    assert heard.startswith("[PRB:")
    assert "ALARM:5\r\n" in heard
    host = bench()
    assert host.send(b"G38.4 X-390 F6000\n") + host.settle() == "ALARM:4\r\nok\r\n"
    assert host.grbl.state == "Alarm"


def test_unlocking_when_nothing_is_locked(bench: MakeBench) -> None:
    assert bench().send(b"$X\n") == "ok\r\n"


def test_settings_are_refused_in_motion(bench: MakeBench) -> None:
    host = bench()
    host.send(b"G0 X-100\n", 0.1)
    for line in (b"$$\n", b"$#\n", b"$110=5\n", b"$H\n", b"$C\n"):
        assert host.send(line) == "error:8\r\n"
    assert host.send(b"$G\n").startswith("[GC:G0")
