"""What the driver believes of the machine: all of it from what the wire said, nothing assumed."""

import asyncio
from collections.abc import AsyncIterator

from kempelen.core.errors import LinkError
from kempelen.core.protocols import GripperState, RobotPhase, RobotState
from kempelen.core.words import joined, say
from kempelen.robots.grbl.codec import Alarm, Axes, Banner, Event, Message, PositionTracker, Status
from kempelen.robots.grbl.explain import LOSES_POSITION, NEEDS_RESET, alarm_words, state_text
from kempelen.robots.grbl.gcode import GripperWiring
from kempelen.robots.grbl.mechanics import Mechanics, Pose

_PRESSED = "A limit switch is pressed; move the axis off it by hand, then home."
_RESTARTED = "The controller restarted by itself; check its power supply, then home."
_PHASES = {
    "Run": RobotPhase.MOVING,
    "Jog": RobotPhase.JOGGING,
    "Home": RobotPhase.HOMING,
    "Alarm": RobotPhase.LOCKED,
    "Sleep": RobotPhase.LOCKED,
    "Check": RobotPhase.LOCKED,
}
_AT_WORK = {"run": RobotPhase.MOVING, "home": RobotPhase.HOMING, "jog": RobotPhase.JOGGING}


class Condition:
    """The machine's condition and its watchers.

    Attributes:
        connected: Whether there is a line.
        homed: The driver's own: false after boot, alarms that lose the position, and loss of the link.
        alarm: GRBL's number of the alarm that has not been cleared yet.
        silent: After alarms 1 and 2: nothing but a reset is heard.
        banner_due: A restart has been announced (by an alarm) and its banner has not come yet.
        gripper: What the controller does with its outputs now.
        wanted: What the gripper was last told; differs from ``gripper`` after a reset.
        position: Of the axes, work coordinates, as last reported; None while it is not known.
        machine: The same in machine coordinates.
        activity: ``"run"``, ``"home"``, ``"jog"`` or empty.
        paused: Between `hold` and `resume`.
        keeps_position: The next banner is our own doing, at rest.
    """

    def __init__(self, wiring: GripperWiring, mechanics: Mechanics) -> None:
        self._wiring = wiring
        self._mechanics = mechanics
        self._watchers: set[asyncio.Event] = set()
        self._tracker = PositionTracker()
        self.closed = False
        self.forget()

    def forget(self) -> None:
        """As before connecting."""
        self.connected = self.homed = self.memory_kept = False
        self.silent = self.banner_due = self.paused = self.keeps_position = False
        self.alarm: int | None = None
        self.gripper = self.wanted = GripperState.UNKNOWN
        self.activity = ""
        self.status: Status | None = None
        self.position: Axes | None = None
        self.machine: Axes | None = None
        self._pose: Pose | None = None
        self._trouble = ""
        self._tracker = PositionTracker()

    # --- what the wire says ------------------------------------------------------------------------------

    def hear(self, event: Event) -> None:
        """Take in one event."""
        match event:
            case Status():
                self._report(event)
            case Alarm(code):
                self._alarmed(code)
            case Banner():
                self._restarted()
            case Message("Check Limits"):
                self._trouble = say("limit_pressed", _PRESSED)
            case _:
                return
        self.publish()

    def _report(self, status: Status) -> None:
        self.status = status
        before, self.position = self.position, self._tracker.work(status)
        if self.position is None or len(self.position) != len(self._mechanics.axes):
            self._pose = None
        elif self.position != before or self._pose is None:
            self._pose = self._mechanics.pose(self.position)
        self.machine = self._tracker.machine(status)

    def _alarmed(self, code: int) -> None:
        self.alarm, self._trouble = code, alarm_words(code)
        self.silent = code in NEEDS_RESET
        self.banner_due = code in LOSES_POSITION and not self.silent
        self.gripper = self._wiring.after_reset
        self.status = Status("Alarm")
        if code in LOSES_POSITION:
            self.homed = False

    def _restarted(self) -> None:
        self.silent = self.banner_due = False
        self.gripper = self._wiring.after_reset
        if not self.keeps_position and self.alarm is None:
            expected = not self.homed  # whoever stops the machine takes it for unhomed at once
            self.homed = False
            if self.connected and not expected:
                self._trouble = say("restarted_itself", _RESTARTED)

    def lost(self, error: LinkError) -> None:
        """The line is gone; the machine ends what it has in its buffer by itself."""
        self.connected = self.homed = False
        self._trouble = joined(error.message, error.hint)
        self.publish()

    def clear(self) -> None:
        """Alarm and trouble are dealt with."""
        self.alarm = None
        self.silent = False
        self._trouble = ""

    def know_offset(self, offset: Axes) -> None:
        """The work offset is this: reports tell it only now and then."""
        self._tracker.offset = offset

    def told(self, gripper: GripperState) -> None:
        """The controller has carried out a gripper command."""
        self.gripper = self.wanted = gripper

    # --- what people see ---------------------------------------------------------------------------------

    @property
    def phase(self) -> RobotPhase:
        """In the words shown to people."""
        if not self.connected:
            return RobotPhase.DISCONNECTED
        if self.alarm is not None:
            return RobotPhase.ALARM
        return self._reported_phase()

    def _reported_phase(self) -> RobotPhase:
        state = self.status.state if self.status else "Alarm"
        if self.status is not None and state in {"Hold", "Door"}:
            return RobotPhase.HOLDING if self.status.moving else RobotPhase.HELD
        if state != "Idle" and not (state == "Alarm" and self.activity == "home"):
            return _PHASES.get(state, RobotPhase.LOCKED)
        if self.paused:
            return RobotPhase.HELD
        if self.activity:
            return _AT_WORK[self.activity]
        return RobotPhase.IDLE if self.homed else RobotPhase.LOCKED

    @property
    def message(self) -> str:
        """One sentence when something is wrong or must be done."""
        if self._trouble:
            return self._trouble
        if self.status is not None and self.status.state in {"Door", "Check", "Sleep"}:
            return state_text(self.status.state, self.status.sub)
        return say("home_it", "Home the machine.") if self.phase is RobotPhase.LOCKED else ""

    @property
    def state(self) -> RobotState:
        """The snapshot."""
        pose = self._pose if self.homed else None
        return RobotState(
            phase=self.phase,
            homed=self.homed,
            reported_position=pose.tool if pose else None,
            gripper=self.gripper,
            memory_kept=self.memory_kept,
            message=self.message,
            joints=pose.joints if pose else None,
        )

    def publish(self) -> None:
        """Wake the watchers."""
        for news in self._watchers:
            news.set()

    async def watch(self) -> AsyncIterator[RobotState]:
        """Each new snapshot, beginning with the present one; ends with the device."""
        news = asyncio.Event()
        self._watchers.add(news)
        try:
            last = self.state
            yield last
            while not self.closed:
                await news.wait()
                news.clear()
                if self.state != last:
                    last = self.state
                    yield last
        finally:
            self._watchers.discard(news)
