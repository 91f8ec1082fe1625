"""How long to wait for what, s, wall clock."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Timing:
    """Patience. Only silences are timed: how long a motion may take is up to the machine.

    Attributes:
        banner: For the banner after a reset.
        quiet: For a banner where no reset is expected.
        answer: For the answer to a status query, while answers are due.
        poll: Between status queries while waiting for rest; the firmware wants five a second at most.
        watch: Between the watchdog's status queries while something is at work; 0 for none.
        idle_watch: The same while nothing is.
        homing: For homing, in which silence is legal.
        lost_ok: How long the controller may report Idle while it owes an acknowledgement.
        keep_alive: A jog ends when its keep-alives are silent for so long.
        jog_segment: Length of one jog command.
    """

    banner: float = 3.0
    quiet: float = 0.3
    answer: float = 5.0
    poll: float = 0.21
    watch: float = 0.25
    idle_watch: float = 1.0
    homing: float = 180.0
    lost_ok: float = 3.0
    keep_alive: float = 0.4
    jog_segment: float = 0.1
