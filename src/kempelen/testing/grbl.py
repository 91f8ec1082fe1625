"""What a GRBL 1.1h says and hears, as pieces of scripts (see `kempelen.testing.wires`)."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from kempelen.core.table import WorkSpace
from kempelen.robots.grbl.gantry import GrblGantry
from kempelen.robots.grbl.gcode import GripperWiring
from kempelen.robots.grbl.timing import Timing
from kempelen.testing.wires import ScriptedWire

SPACE = WorkSpace()
WCO = "-705.000,-455.000,-205.000"
BANNER = b"\r\nGrbl 1.1h ['$' for help]\r\n"
UNLOCK = b"[MSG:'$H'|'$X' to unlock]\r\n"
OK = b"ok\r\n"
RESET = b"\x18"

# Short where something is expected not to come; the watchdog is off unless a test is about it.
QUICK = Timing(
    banner=0.2, quiet=0.01, answer=0.2, poll=0.005, watch=0.0, idle_watch=0.0, homing=0.5, lost_ok=0.05
)


def settings(**changes: float | None) -> bytes:
    """``$$`` of a controller that fits the default work space; ``_21=0`` changes a line, None drops it."""
    values: dict[int, float | None] = {
        0: 10, 1: 255, 10: 1, 11: 0.02, 13: 0, 20: 1, 21: 1, 22: 1, 23: 3, 27: 2, 32: 0,
        100: 80, 101: 80, 102: 80, 110: 18000, 111: 18000, 112: 18000,
        120: 1500, 121: 1500, 122: 1500, 130: 710, 131: 460, 132: 210,
    }  # fmt: skip
    values |= {int(key[1:]): value for key, value in changes.items()}
    lines = [f"${key}={value:.3f}\r\n" for key, value in values.items() if value is not None]
    return "".join(lines).encode() + OK


def offsets(g54: str = WCO, g92: str = "0.000,0.000,0.000") -> bytes:
    """``$#``."""
    zero = "0.000,0.000,0.000"
    lines = [f"[G54:{g54}]", *(f"[G{n}:{zero}]" for n in (55, 56, 57, 58, 59, 28, 30))]
    return (
        "".join(f"{line}\r\n" for line in (*lines, f"[G92:{g92}]", "[TLO:0.000]", f"[PRB:{zero}:0]")).encode()
        + OK
    )


def report(
    state: str, xyz: tuple[float, float, float] = (0.0, 0.0, 200.0), extra: str = f"|WCO:{WCO}"
) -> bytes:
    """A status report for a work position."""
    machine = ",".join(f"{v + float(o):.3f}" for v, o in zip(xyz, WCO.split(","), strict=True))
    return f"<{state}|MPos:{machine}|FS:0,0{extra}>\r\n".encode()


def modal(gripper: str = "M9", feed: str = "F0") -> bytes:
    """``$G``."""
    return f"[GC:G0 G54 G17 G21 G90 G94 M5 {gripper} T0 {feed} S0]\r\n".encode() + OK


def expect_inventory(
    wire: ScriptedWire, *, state: str = "Alarm", refusal: bytes = b"error:9\r\n",
    settings_reply: bytes = b"", offsets_reply: bytes = b"", modal_reply: bytes = b"",
) -> None:  # fmt: skip
    """The questions that the driver asks of every controller."""
    wire.expect(b"=\n", refusal)
    wire.expect(b"?", report(state))
    wire.expect(b"$I\n", b"[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\n" + OK)
    wire.expect(b"$$\n", settings_reply or settings())
    wire.expect(b"$#\n", offsets_reply or offsets())
    wire.expect(b"$G\n", modal_reply or modal())


def expect_boot(wire: ScriptedWire) -> None:
    """A board that DTR has just reset."""
    wire.say(BANNER + UNLOCK)
    expect_inventory(wire)


def expect_running(wire: ScriptedWire, *, gripper: str = "M8", feed: str = "F77") -> None:
    """A board that nobody reset."""
    for _ in range(3):
        wire.expect(b"?", report("Idle"))
    expect_inventory(wire, state="Idle", refusal=b"error:1\r\n", modal_reply=modal(gripper, feed))


CORNER = (0.0, 0.0, 200.0)
PULL_OFF = (-3.0, -3.0, 203.0)


def expect_homing(wire: ScriptedWire, *, restores: tuple[bytes, ...] = ()) -> None:
    """A homing that succeeds, and the way from the switches into the work space."""
    wire.expect(b"$H\n", OK)
    wire.expect(b"?", report("Idle", PULL_OFF))
    wire.expect(b"?", report("Idle", PULL_OFF))
    wire.expect(b"G21G54G90F77\n", OK)
    for line in restores:
        wire.expect(line, OK)
    wire.expect(b"?", report("Idle", PULL_OFF))
    wire.expect(b"G21G54G90G0X0Y0Z200\nG4P0\n", OK + OK)
    wire.expect(b"?", report("Idle", CORNER))


@asynccontextmanager
async def gantry(
    wire: ScriptedWire,
    *,
    timing: Timing = QUICK,
    wiring: GripperWiring | None = None,
    apply_settings: bool = False,
) -> AsyncIterator[GrblGantry]:
    """A driver at the near end of a script."""
    robot = GrblGantry(wire.connect, SPACE, timing=timing, wiring=wiring, apply_settings=apply_settings)
    async with robot:
        yield robot


@asynccontextmanager
async def homed(wire: ScriptedWire, *, timing: Timing = QUICK) -> AsyncIterator[GrblGantry]:
    """A driver that has connected and homed; its script begins after that."""
    expect_boot(wire)
    expect_homing(wire)
    async with gantry(wire, timing=timing) as robot:
        await robot.home()
        wire.assert_done()
        yield robot


async def turns(count: int = 20) -> None:
    """Let the other tasks run as far as they can."""
    for _ in range(count):
        await asyncio.sleep(0)
