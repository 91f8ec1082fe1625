"""The bridge's board: what it says and hears, its commands, its motors; time is let pass by `VirtualLatch`.

No I/O and no clock of its own. Source: docs/reference/latch-bridge.md, version 1.
"""

from collections.abc import Callable, Sequence

import numpy as np

from kempelen.kinematics.arm import Arm
from kempelen.motion.arm.motors import Motors
from kempelen.twin.grbl.arm import parked
from kempelen.twin.grbl.faults import Faults
from kempelen.twin.grbl.joints import ArmMachine
from kempelen.twin.grbl.settings import Vec
from kempelen.twin.grbl.uart import Uart
from kempelen.twin.latch.frames import Answer, Refused, command, frame
from kempelen.twin.latch.seek import Seek
from kempelen.twin.latch.steps import LONGEST, QUEUE, TICKS, Block, StepClock

_BOOT_S = 1.0
_REALTIME = b"?!\x18\x85"
_RING = 128
_RESET_IN_MOTION, _RESET_HOMING = 3, 6
_LONGEST_LINE = 100


class Board:
    """The bridge's program.

    Args:
        arm: By its parameter file.
        joints: True joint angles at power-up, rad; None for somewhere near home.
        faults: What goes wrong; None for nothing.
        baud: Speed of the serial line, bit/s; 0 for one without delay.

    Attributes:
        state: ``Idle``, ``Run``, ``Jog``, ``Home``, ``Hold`` or ``Alarm``.
        faults: May be changed at any time.
        time_s: Since power-up.
    """

    def __init__(
        self,
        arm: Arm,
        joints: Sequence[float] | None = None,
        *,
        faults: Faults | None = None,
        baud: int = 0,
    ) -> None:
        self.arm = arm
        self.faults = faults or Faults()
        self.time_s = self._rest_since = 0.0
        self._axes = Motors.of(arm)
        self._degrees: Vec = tuple((1.0 / np.radians(arm.steps_per_rad)).tolist())
        self._machine = ArmMachine(self._axes, parked(self._axes) if joints is None else joints)
        self._uart = Uart(baud, _RING)
        self._ticks = 0
        self._homed = [0] * arm.n
        self._handlers: dict[str, Callable[[Sequence[int]], Answer]] = {
            "I": self._info, "B": self._block, "J": self._jog, "E": self._end, "W": self._wait,
            "G": self._grip, "H": self._home, "X": self._unlock, "K": self._keep,
        }  # fmt: skip
        self._power_up()

    def _power_up(self) -> None:
        self._uart.power_cycle()
        self._clock = StepClock(self.arm.n)
        self._machine.rename((0.0,) * self.arm.n)
        self.state = "Alarm"
        self._boot = self.time_s + _BOOT_S
        self._forget()

    def _forget(self) -> None:
        """What a reset loses: queue, numbers, outputs, the mark."""
        self._clock.drop()
        self._uart.clear()
        self._pending: tuple[int, Callable[[], bool]] | None = None
        self._seek: Seek | None = None
        self._expected = 0
        self._open = self._known = False
        self._cancelling = False

    # --- the wire ------------------------------------------------------------------------------------------

    def receive(self, data: bytes) -> None:
        """Bytes from the host."""
        self._hear(self._uart.send(self.faults.garbled_in(data), self.time_s))

    def take_output(self) -> bytes:
        """What has reached the host since the last call."""
        return self._uart.take(self.time_s)

    def reset_by_dtr(self) -> None:
        """The host has opened the port: the board boots."""
        self._stop_dead()
        self._power_up()

    def _hear(self, data: bytes) -> None:
        for byte in b"" if self._boot else data:  # the boot loader listens to nobody
            if byte in _REALTIME:
                self._at_once(byte)
            elif not self._uart.store(bytes((byte,)), self.time_s):
                self._uart.dropped += 1

    def _at_once(self, byte: int) -> None:
        if byte == ord("?"):
            self._say(self._report())
        elif byte == ord("!"):
            if self.state in {"Run", "Jog"}:
                self._clock.hold()
                self._cancelling = self.state == "Jog"
                self.state = "Jog" if self._cancelling else "Hold"
        elif byte == 0x18:  # noqa: PLR2004 - reset
            self._reset()
        elif self.state == "Jog":  # cancel
            self._clock.hold()
            self._cancelling = True

    def _say(self, text: str) -> None:
        if text.startswith("ok") and self.faults.swallows_ok():
            return
        data = self.faults.garbled_out(frame(text))
        self._uart.transmit(data, self.time_s, self.faults.reply_delay_s)

    def _report(self) -> str:
        state = self.state
        if state == "Hold":
            state += ":1" if self._clock.pace else ":0"
        counts = ",".join(map(str, self._clock.counts))
        room = QUEUE - len(self._clock.blocks)
        grip = "o" if self._open else "c"
        return f"<{state}|P:{counts}|Q:{room}|L:{self._machine.pressed()}|G:{grip}|K:{int(self._known)}>"

    def _greet(self) -> None:
        self._say(f"Kempelen latch bridge 1, {self.arm.n} motors")

    # --- commands ------------------------------------------------------------------------------------------

    def _read(self) -> bool:
        """Take up the next line; False when there is none."""
        ring = self._uart.ring
        end = ring.find(b"\n")
        if end < 0:
            if len(ring) >= _LONGEST_LINE:
                ring.clear()
                self._say("error 103 0")
            return False
        line = bytes(ring[:end]).strip()
        del ring[: end + 1]
        if len(line) >= _LONGEST_LINE:
            self._say(f"error 103 {self._expected}")
        elif line:
            self._execute(line)
        return True

    def _execute(self, line: bytes) -> None:
        try:
            number, letter, values = command(line)
            if letter == "~":
                self._resume()
                return
            self._answer(number, self._handler(number, letter)(values))
        except Refused as refusal:
            self._say(f"error {refusal.code} {self._expected}")

    def _handler(self, number: int, letter: str) -> Callable[[Sequence[int]], Answer]:
        if number not in {0, self._expected}:
            raise Refused(102)
        self._expected = number % 255 + 1
        if letter not in self._handlers:
            raise Refused(1)
        return self._handlers[letter]

    def _answer(self, number: int, done: Answer) -> None:
        if done is None or done():
            self._say(f"ok {number}")
        else:
            self._pending = (number, done)

    def _resume(self) -> None:
        if self.state == "Hold" and not self._clock.pace:
            self._clock.resume()
            self.state = "Run" if self._clock.blocks else "Idle"

    def _info(self, _values: Sequence[int]) -> Answer:
        for text in ("[VER:1]", f"[AXS:{self.arm.n}]", f"[QUE:{QUEUE}]"):
            self._say(text)
        return None

    def _steps(self, values: Sequence[int]) -> Block:
        milliseconds, *steps = values or (0,)
        if len(steps) != self.arm.n:
            raise Refused(1)
        if not 1 <= milliseconds <= LONGEST:
            raise Refused(2)
        if max(map(abs, steps)) > milliseconds * (TICKS // 1000):
            raise Refused(3)
        return Block(milliseconds, tuple(steps))

    def _block(self, values: Sequence[int]) -> Answer:
        block = self._steps(values)
        if self.state not in {"Idle", "Run", "Hold"}:
            raise Refused(9 if self.state == "Alarm" else 8)

        def enter() -> bool:
            if self._clock.full:
                return False
            self._clock.blocks.append(block)
            self.state = "Run" if self.state == "Idle" else self.state
            return True

        return enter

    def _jog(self, values: Sequence[int]) -> Answer:
        block = self._steps(values)
        if self.state not in {"Idle", "Jog"}:
            raise Refused(9 if self.state == "Alarm" else 8)
        if not self._cancelling:
            self._clock.blocks.append(block)
            self.state = "Jog"
        return None

    def _end(self, _values: Sequence[int]) -> Answer:
        if self.state == "Alarm":
            raise Refused(9)
        return lambda: self.state == "Idle"

    def _wait(self, values: Sequence[int]) -> Answer:
        if len(values) != 1 or values[0] < 0:
            raise Refused(1)
        ends: list[float] = []

        def over() -> bool:
            if self.state != "Idle":
                return False
            if not ends:
                ends.append(self.time_s + values[0] / 1000.0)
            return self.time_s >= ends[0]

        return over

    def _grip(self, values: Sequence[int]) -> Answer:
        if len(values) != 1 or values[0] not in {0, 1}:
            raise Refused(2)

        def turn() -> bool:
            if self.state not in {"Idle", "Alarm"}:
                return False
            self._open = values[0] == 0
            return True

        return turn

    def _home(self, values: Sequence[int]) -> Answer:
        if len(values) != 7:  # noqa: PLR2004 - motor, way, two speeds, back, most, home
            raise Refused(1)
        motor, way, rate, slow, off, most, home = values
        seek = Seek(motor, way, rate, slow, off, most, home)
        if not 0 <= seek.motor < self.arm.n or abs(seek.way) != 1 or min(values[2:6]) < 1:
            raise Refused(2)
        if self.state not in {"Idle", "Alarm"}:
            raise Refused(8)
        if max(seek.rate, seek.slow) > TICKS:
            raise Refused(3)
        self._seek, self.state = seek, "Home"
        return lambda: self._seek is None

    def _unlock(self, _values: Sequence[int]) -> Answer:
        if self.state == "Alarm":
            self.state = "Idle"
        return None

    def _keep(self, _values: Sequence[int]) -> Answer:
        self._known = True
        return None

    # --- stopping ------------------------------------------------------------------------------------------

    def _reset(self) -> None:
        """0x18: at rest the counts are kept, in motion they are lost."""
        if self.state == "Home":
            self._alarm(_RESET_HOMING)
        elif self._clock.running and self.state != "Idle":
            self._stop_dead()
            self._alarm(_RESET_IN_MOTION)
        else:
            self._forget()
            self.state = "Alarm" if self.state == "Alarm" else "Idle"
            self._greet()

    def _alarm(self, code: int) -> None:
        self._say(f"alarm {code}")
        self._forget()
        self.state = "Alarm"
        self._greet()

    def _stop_dead(self) -> None:
        """The phases stand; what turns slips on."""
        if self._clock.running and self._clock.blocks:
            block = self._clock.blocks[0]
            speed = [
                steps * degrees * 1000.0 * self._clock.pace / (1024.0 * block.milliseconds)
                for steps, degrees in zip(block.steps, self._degrees, strict=True)
            ]
            self._follow()
            self._machine.cut_off(tuple(speed))

    # --- motors --------------------------------------------------------------------------------------------

    def _told(self) -> Vec:
        return tuple(
            count * degrees for count, degrees in zip(self._clock.counts, self._degrees, strict=True)
        )

    def _follow(self) -> None:
        self._machine.follow(self._told())
