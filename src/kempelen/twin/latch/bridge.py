"""The bridge as a whole: time passes, steps are made, switches found, faults come about."""

from math import radians
from typing import Any

from kempelen.twin.grbl.settings import Vec
from kempelen.twin.latch.board import Board
from kempelen.twin.latch.frames import frame
from kempelen.twin.latch.seek import Failure, Seek
from kempelen.twin.latch.steps import TICKS

_FEW = 8  # blocks: fewer could run out before the host has sent more
PHASES = (0b0001, 0b0011, 0b0010, 0b0110, 0b0100, 0b1100, 0b1000, 0b1001)
"""Half steps: which of a motor's four phases have current."""


class VirtualLatch(Board):
    """The virtual bridge; its face is told in `kempelen.twin.grbl.arm`."""

    # --- outside view --------------------------------------------------------------------------------------

    @property
    def joints(self) -> Vec:
        """(n,) rad, true joint angles as far as motors and the file's coupling make them."""
        return tuple(map(radians, self._machine.joints_deg))

    @property
    def motors(self) -> Vec:
        """(n,) rad, where the motors truly are, counted from joint angles 0."""
        return tuple(map(radians, self._machine.position))

    @property
    def told(self) -> Vec:
        """(n,) rad, where the bridge believes the motors to be; right after homing it is `motors`."""
        return tuple(map(radians, self._machine.motor))

    @property
    def homings(self) -> int:
        """How often every motor has been homed."""
        return min(self._homed)

    @property
    def gripper_closed(self) -> bool:
        """Without current it is closed."""
        return not self._open

    @property
    def nibbles(self) -> tuple[int, ...]:
        """What stands in each motor's latch: its four phases."""
        return tuple(PHASES[count % len(PHASES)] for count in self._clock.counts)

    @property
    def settled_at(self) -> float:
        """When the last motion ended, s."""
        return self._rest_since

    # --- time ----------------------------------------------------------------------------------------------

    def advance(self, dt: float) -> None:
        """Let ``dt`` seconds pass; with 0 what has arrived is still read and answered."""
        self._apply_faults()
        self._work()
        ticks = int((self.time_s + dt) * TICKS + _ROUNDING) - self._ticks
        end = self.time_s + dt
        while ticks > 0:
            count = min(ticks, _AT_ONCE)
            self._tick(count)
            self._ticks += count
            ticks -= count
            self.time_s = min(self._ticks / TICKS, end)
            self._hear(self._uart.arrived(self.time_s))
            self._work()
        self.time_s = end
        self._follow()

    def _tick(self, count: int) -> None:
        if self._seek is not None:
            self._search(self._seek, count)
            return
        if not self._clock.running:
            return
        self._clock.run(count)
        if self._cancelling and not self._clock.pace:
            self._clock.drop()
        if not self._clock.blocks and self.state in {"Run", "Jog", "Hold"}:
            self._rested()

    def _rested(self) -> None:
        self.state, self._cancelling = "Idle", False
        self._rest_since = self.time_s + _AT_ONCE / TICKS

    def _search(self, seek: Seek, ticks: int) -> None:
        motor = seek.motor
        while ticks and not seek.over:
            count = self._clock.counts[motor]
            step, ticks = seek.run(ticks, closed=self._machine.closed(motor), count=count)
            if step:
                self._clock.name(motor, count + step)
                self._follow()
        if seek.over:
            self._found(seek)

    def _found(self, seek: Seek) -> None:
        self._seek = None
        self._rest_since = self.time_s
        if seek.failure is not Failure.NONE:
            self._alarm(int(seek.failure))
            return
        self._say(f"[HOM:{seek.closed_at}]")
        self._clock.name(seek.motor, seek.home)
        self._machine.rename(self._told())
        self._homed[seek.motor] += 1
        self.state = "Idle"

    def _work(self) -> None:
        """What the main program does between ticks: boot, answer, read."""
        if self._boot:
            if self.time_s < self._boot:
                return
            self._boot = 0.0
            self._greet()
        while True:
            if self._pending is not None:
                number, done = self._pending
                if not done():
                    # What only looks or resumes is read past a command that waits.
                    self._peek()
                    return
                self._pending = None
                self._say(f"ok {number}")
            if not self._read():
                return

    def _peek(self) -> None:
        """A resume is heard though a command waits."""
        ring, signal = self._uart.ring, frame("~").replace(b"\r", b"")
        at = bytes(ring).find(signal)
        if at == 0 or (at > 0 and ring[at - 1 : at] == b"\n"):
            del ring[at : at + len(signal)]
            self._resume()

    def _apply_faults(self) -> None:
        faults, machine = self.faults, self._machine
        if faults.stalled != machine.stalled or faults.dead_switches != machine.dead_switches:
            self._follow()
            machine.stalled, machine.dead_switches = set(faults.stalled), set(faults.dead_switches)
        for axis, steps in enumerate(faults.take_lost_steps() or ()):
            if steps:
                machine.slip(axis, steps * self._degrees[axis])
        if faults.take_reset():
            self.reset_by_dtr()

    # --- for the loop --------------------------------------------------------------------------------------

    def starving(self) -> bool:
        """Whether the arm would go on without a break if only the host sent more."""
        busy = self.state == "Run" and self._pending is None and not self._uart.ring
        return busy and len(self._clock.blocks) < _FEW

    def idle(self) -> bool:
        """Whether nothing would happen if only time passed."""
        if self._boot or self._seek is not None or self._uart.ring or not self._uart.quiet(self.time_s):
            return False
        if self._pending is not None and not (self.state == "Hold" and not self._clock.pace):
            return False
        return not self._clock.running

    def assume_homed(self) -> None:
        """Skip homing: boot at once, and know where the motors are, to the step (for measurements)."""
        self._boot = 0.0
        for motor, (place, degrees) in enumerate(zip(self._machine.position, self._degrees, strict=True)):
            self._clock.name(motor, round(place / degrees))
        self._machine.rename(self._told())
        self._homed = [count + 1 for count in self._homed]
        self.state = "Idle"

    def snapshot(self) -> dict[str, Any]:
        """Everything but a command that waits: JSON-able; its host is gone by the time it is restored."""
        return {
            "plain": {name: getattr(self, name) for name in _PLAIN},
            "clock": self._clock.snapshot(),
            "seek": self._seek and self._seek.snapshot(),
            "machine": self._machine.snapshot(),
            "uart": self._uart.snapshot(),
            "faults": self.faults.snapshot(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on where `snapshot` was taken."""
        for name, value in state["plain"].items():
            setattr(self, name, value)
        self._clock.restore(state["clock"])
        self._seek = None if state["seek"] is None else Seek.from_snapshot(state["seek"])
        self._machine.restore(state["machine"])
        self._uart.restore(state["uart"])
        self.faults.restore(state["faults"])
        self._pending = None


_PLAIN = (
    "time_s", "state", "_rest_since", "_ticks", "_homed", "_boot", "_expected", "_open", "_known",
    "_cancelling",
)  # fmt: skip
_AT_ONCE = 8  # ticks between two looks at the wire: 2 ms
_ROUNDING = 1e-6
