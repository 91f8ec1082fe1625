"""GRBL's errors, alarms and states in plain words, with what to do.

Source: the code lists of GRBL 1.1 (``interface.md``).
"""

from kempelen.core.errors import AlarmError
from kempelen.core.words import say

# Alarms that lose the position; 2 (soft limit), 4 and 5 (probe) stop under control.
LOSES_POSITION = frozenset({1, 3, 6, 7, 8, 9})
# Alarms after which the firmware answers nothing at all until it is reset.
NEEDS_RESET = frozenset({1, 2})

_NOT_GCODE = "The line was damaged on its way, or the program has a fault; check the cable."
_HOME = "Home the machine."
_SETTINGS = "Check the controller's settings with `kempelen doctor`."

_ERRORS: dict[int, tuple[str, str]] = {
    1: ("expected a letter in front of a value", _NOT_GCODE),
    2: ("a number is malformed", _NOT_GCODE),
    3: ("an unknown $ command", _NOT_GCODE),
    4: ("a value that must not be negative", _SETTINGS),
    5: ("homing is switched off in its settings", "Send $22=1 and fit reference switches."),
    6: ("the step pulse is shorter than 3 µs", "Send $0=10."),
    7: ("its stored settings could not be read and were reset", "Set the controller up again."),
    8: ("it is not idle, so it takes no $ command", "Wait for rest, or recover from the alarm."),
    9: ("it is locked", _HOME),
    10: ("soft limits need homing to be switched on", "Send $22=1."),
    11: ("the line is longer than 80 characters", _NOT_GCODE),
    12: ("a setting asks for more than 30,000 steps a second", "Lower $110..$112 or $100..$102."),
    13: ("the safety door is open", "Close the door and resume."),
    14: ("a start-up line or build info is too long", "Shorten it."),
    15: ("the jog leads out of the machine's travel", "Jog the other way."),
    16: ("a jog line without '=' or with a forbidden word", _NOT_GCODE),
    17: ("laser mode needs a PWM output", "Send $32=0."),
    20: ("a command that this firmware does not know", "Use GRBL 1.1 built with its standard options."),
    21: ("two commands of one modal group in a line", _NOT_GCODE),
    22: ("no feed rate is set", _NOT_GCODE),
    23: ("a command that needs a whole number", _NOT_GCODE),
    24: ("two commands that both use axis words", _NOT_GCODE),
    25: ("the same word twice in a line", _NOT_GCODE),
    26: ("axis words are missing", _NOT_GCODE),
    27: ("a line number out of range", _NOT_GCODE),
    28: ("a value is missing", _NOT_GCODE),
    29: ("only the work coordinates G54 to G59 exist", _NOT_GCODE),
    30: ("G53 works with G0 and G1 only", _NOT_GCODE),
    31: ("axis words that nothing uses", _NOT_GCODE),
    32: ("an arc without axis words in its plane", _NOT_GCODE),
    33: ("an invalid target", _NOT_GCODE),
    34: ("an arc's radius is wrong", _NOT_GCODE),
    35: ("an arc without an offset", _NOT_GCODE),
    36: ("values that nothing uses", _NOT_GCODE),
    37: ("tool length offset on the wrong axis", _NOT_GCODE),
    38: ("a tool number that is too high", _NOT_GCODE),
}  # fmt: skip

ALARMS: dict[int, tuple[str, str]] = {
    1: (
        "A limit switch was hit; the machine stopped dead and its position is lost",
        "Free the axis if it is jammed, recover, then home.",
    ),
    2: (
        "A target beyond the machine's travel; it stopped under control and still knows its position",
        "Recover; the work offset or the calibration may be wrong.",
    ),
    3: ("It was reset while moving; its position is lost", "Recover, then home."),
    4: ("The probe was not in its expected state", "Recover."),
    5: ("The probe touched nothing within its travel", "Recover."),
    6: ("Homing was interrupted by a reset", "Home again."),
    7: ("The safety door was opened while homing", "Close the door, then home again."),
    8: (
        "Homing failed: a switch did not release when the axis pulled off",
        "Check the switch for jamming, or raise $27; then home again.",
    ),
    9: (
        "Homing failed: a reference switch was not found",
        "Check that the axis moves towards its switch and the switch works; then home again.",
    ),
}

_STATES: dict[str, str] = {
    "Idle": "At rest.",
    "Run": "Moving.",
    "Hold:0": "Paused, at rest in mid-motion; resume goes on.",
    "Hold:1": "Slowing down to a pause.",
    "Hold": "Paused; resume goes on.",
    "Jog": "Jogging.",
    "Home": "Finding its reference switches.",
    "Alarm": "Locked: recover, then home.",
    "Check": "In G-code check mode, nothing moves; send $C to leave it.",
    "Sleep": "Asleep, motors off: recover, then home.",
    "Door:0": "The safety door is closed again; resume goes on.",
    "Door:1": "The safety door is open; close it, then resume.",
    "Door:2": "The safety door was opened; the machine is stopping.",
    "Door:3": "The safety door is closed; the machine is starting again.",
    "Door": "The safety door is open; close it, then resume.",
}


def error_text(code: int) -> tuple[str, str]:
    """What ``error:code`` means, and what to do next."""
    return _ERRORS.get(code, ("an unknown reason", "See the documentation of this controller's firmware."))


def alarm_text(code: int) -> tuple[str, str]:
    """What ``ALARM:code`` means, and what to do next."""
    return ALARMS.get(code, ("An unknown alarm; its position may be lost", "Recover, then home."))


def alarm_words(code: int) -> str:
    """The same in one go, for other languages too."""
    what, hint = alarm_text(code)
    return say(f"alarm_{code}" if code in ALARMS else "alarm_unknown", f"{what}. {hint}")


def alarm_error(code: int, where: str) -> AlarmError:
    """The exception for ``ALARM:code``."""
    what, hint = alarm_text(code)
    return AlarmError(f"{where}: alarm {code}. {what}.", hint=hint)


def state_text(state: str, sub: int | None = None) -> str:
    """A status report's state as a sentence."""
    full = state if sub is None else f"{state}:{sub}"
    return _STATES.get(full) or _STATES.get(state, f"Unknown state {full}.")
