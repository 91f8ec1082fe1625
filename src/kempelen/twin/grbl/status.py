"""Answers and alarms by their numbers. Source: GRBL wiki "Grbl v1.1 Interface", CSV of codes."""

from enum import IntEnum


class Status(IntEnum):
    """What a line is answered with: ``ok`` or ``error:N``."""

    OK = 0
    EXPECTED_COMMAND_LETTER = 1
    BAD_NUMBER_FORMAT = 2
    INVALID_STATEMENT = 3
    NEGATIVE_VALUE = 4
    SETTING_DISABLED = 5
    STEP_PULSE_MIN = 6
    READ_FAIL = 7
    NOT_IDLE = 8
    LOCKED = 9
    SOFT_LIMIT_ERROR = 10
    OVERFLOW = 11
    TRAVEL_EXCEEDED = 15
    INVALID_JOG = 16
    UNSUPPORTED_COMMAND = 20
    MODAL_GROUP_VIOLATION = 21
    UNDEFINED_FEED_RATE = 22
    VALUE_NOT_INTEGER = 23
    AXIS_COMMAND_CONFLICT = 24
    WORD_REPEATED = 25
    NO_AXIS_WORDS = 26
    INVALID_LINE_NUMBER = 27
    VALUE_WORD_MISSING = 28
    UNSUPPORTED_COORDINATES = 29
    G53_INVALID_MOTION = 30
    AXIS_WORDS_EXIST = 31
    NO_AXIS_WORDS_IN_PLANE = 32
    INVALID_TARGET = 33
    ARC_RADIUS_ERROR = 34
    NO_OFFSETS_IN_PLANE = 35
    UNUSED_WORDS = 36
    G43_DYNAMIC_AXIS = 37
    MAX_VALUE_EXCEEDED = 38

    def answer(self) -> str:
        """The line that goes out."""
        return "ok\r\n" if self is Status.OK else f"error:{self.value}\r\n"


class Alarm(IntEnum):
    """Why the controller has locked itself: ``ALARM:N``."""

    NONE = 0
    HARD_LIMIT = 1
    SOFT_LIMIT = 2
    ABORT_CYCLE = 3
    PROBE_INITIAL = 4
    PROBE_CONTACT = 5
    HOMING_RESET = 6
    HOMING_DOOR = 7
    HOMING_PULL_OFF = 8
    HOMING_APPROACH = 9


class State:
    """Machine states, as the status report names them."""

    IDLE = "Idle"
    RUN = "Run"
    HOLD = "Hold"
    JOG = "Jog"
    HOME = "Home"
    ALARM = "Alarm"
    CHECK = "Check"
    DOOR = "Door"
    SLEEP = "Sleep"


MOVING_STATES = frozenset({State.RUN, State.JOG})
