"""How a camera's process is doing, and when it is started again."""

from dataclasses import dataclass, replace
from enum import StrEnum

SILENT_S = 2.0


class CameraState(StrEnum):
    """Of a camera's process."""

    STARTING = "starting"
    RUNNING = "running"
    SILENT = "silent"  # it runs, and has had no frame for a while
    LOST = "lost"  # it ended; another one is started soon, if that is wanted
    ENDED = "ended"  # a recording has been played
    CLOSED = "closed"


@dataclass(frozen=True, slots=True)
class CameraStatus:
    """How it is going.

    Attributes:
        state: In one word.
        message: In one sentence, with what to do; empty when all is well.
        camera: What the driver calls it.
        frames: Written to the ring by the present process, as of its last report.
        dropped: Lost by the camera, as it knows.
        lost: Lost by the ring because readers held all of it.
        restarts: How often the process was started again.
    """

    state: CameraState
    message: str = ""
    camera: str = ""
    frames: int = 0
    dropped: int = 0
    lost: int = 0
    restarts: int = 0


@dataclass(frozen=True, slots=True)
class Restarting:
    """When a process that died is started again.

    Attributes:
        first: Wait before the first attempt, s; doubled with each that fails.
        longest: Wait at most, s.
        settled: A process that ran for this long, s, starts the count anew.
    """

    first: float = 0.5
    longest: float = 10.0
    settled: float = 10.0


def silence(status: CameraStatus, age: float) -> CameraStatus:
    """The status of a camera that runs, with its newest frame ``age`` s old."""
    if age <= SILENT_S:
        return status
    return replace(
        status,
        state=CameraState.SILENT,
        message=f"The camera has shown nothing for {age:.0f} s. Check its cable and what is in front of it.",
    )
