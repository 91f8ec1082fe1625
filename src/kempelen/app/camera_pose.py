"""Where the camera stands over the robot, kept in a file of its own; and a bumped board measured by it alone.

With the board calibrated (touched corners) and in the camera's view, ``robot_from_camera`` follows. From then
on the camera measures where a board is that was bumped: it slides on its table, so that its place and turn
are taken from the camera, and its height and tilt from the touched corners, which are finer than any camera.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from kempelen.app.files import replace_file
from kempelen.core.calibration import CORNERS, Calibration, calibrate
from kempelen.core.errors import CalibrationError, SensorError
from kempelen.core.geometry import Transform

if TYPE_CHECKING:
    from kempelen.app.eye import Eye

VERSION = 1
LOOKS = 5
"""The board is found anew so often for one measurement."""
SPREAD_MM = 4.0
"""Looks that differ by more are no measurement: something moves, or the board is badly seen."""
LIFTED_MM, TILTED = 25.0, math.radians(3.0)
"""A board that was bumped lies on the same table still; depth cameras err by up to this."""

_Row = tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat]


class _Record(BaseModel):
    """The file's content; the pose as the rows of a 4 x 4 matrix, mm."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    version: Annotated[int, Field(ge=1, le=VERSION)] = VERSION
    date: AwareDatetime
    camera: str
    spread: FiniteFloat
    robot_from_camera: tuple[_Row, _Row, _Row, _Row]


@dataclass(frozen=True, slots=True, eq=False)
class CameraPose:
    """A calibrated camera.

    Attributes:
        robot_from_camera: Pose of its colour camera.
        camera: Which.
        spread: Largest distance of a look's board from the mean of all, mm.
        date: When.
    """

    robot_from_camera: Transform
    camera: str
    spread: float
    date: datetime


@dataclass(frozen=True, slots=True, eq=False)
class BoardPose:
    """A board as the camera sees it.

    Attributes:
        camera_from_board: Mean of several looks.
        spread: Largest distance of a look's board centre from theirs, mm.
    """

    camera_from_board: Transform
    spread: float


async def measure_board(eye: "Eye", square: float, looks: int = LOOKS) -> BoardPose:
    """Find the board several times.

    Args:
        eye: Looking at it; told what stands on it, so that it knows a1.
        square: Side of a square, mm.
        looks: How often.

    Raises:
        SensorError: it is not seen, nobody knows its direction or its scale.
        CalibrationError: the looks disagree.
    """
    poses = []
    for _ in range(looks):
        eye.look_again()
        async for seen in eye.observe():
            if seen.valid:
                break
        found = await eye.sighting()
        if found.camera_from_board is None or not found.oriented:
            raise SensorError(
                "The board is seen, but not where it is in space.",
                hint="A camera with known intrinsics is needed, and a position that tells a1 from h8.",
            )
        poses.append(found.camera_from_board)
    centre = np.array([4 * square, 4 * square, 0.0])
    mean = _mean(poses)
    spread = max(float(np.linalg.norm(pose @ centre - mean @ centre)) for pose in poses)
    if spread > SPREAD_MM:
        raise CalibrationError(
            f"Looks at the board differ by {spread:.1f} mm, more than {SPREAD_MM:g} mm.",
            hint="Keep board and camera still, and light the board evenly.",
        )
    return BoardPose(mean, spread)


def _mean(poses: Sequence[Transform]) -> Transform:
    """Of places, and of turns in the chordal sense (nearest rotation to the mean matrix)."""
    u, _, vt = np.linalg.svd(np.mean([pose.rotation for pose in poses], axis=0))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return Transform(rotation, np.mean([pose.translation for pose in poses], axis=0))


def bumped(before: Transform, seen: Transform) -> Transform:
    """The pose of a board that slid over its table.

    Args:
        before: ``robot_from_board`` as it was calibrated.
        seen: The same as the camera has it now.

    Raises:
        CalibrationError: it seems to have been lifted or tilted; then it is not only a bump.
    """
    shift = before.inverse() @ seen
    lifted, tilted = abs(float(shift.translation[2])), shift.tilt
    if lifted > LIFTED_MM or tilted > TILTED:
        raise CalibrationError(
            f"The board seems {lifted:.0f} mm higher or lower and tilted by {math.degrees(tilted):.1f}°; "
            f"a bump leaves it within {LIFTED_MM:.0f} mm and {math.degrees(TILTED):.0f}°.",
            hint="If the camera was moved, not the board: kempelen calibrate --camera",
        )
    x, y, _ = shift.translation
    return before @ Transform.about_z(shift.yaw, (float(x), float(y), 0.0))


def shift_of(before: Transform, after: Transform, square: float) -> float:
    """Largest distance that an outer corner has moved, mm."""
    return max(
        float(np.linalg.norm(p - q)) for p, q in zip(*_corner_points(before, after, square), strict=True)
    )


def _corner_points(
    before: Transform, after: Transform, square: float
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    corners = list(_corners(square).values())
    return [before @ corner for corner in corners], [after @ corner for corner in corners]


def _corners(square: float) -> Mapping[str, np.ndarray]:
    unit = {"a1": (0, 0), "h1": (8, 0), "h8": (8, 8), "a8": (0, 8)}
    return {name: np.array([square * unit[name][0], square * unit[name][1], 0.0]) for name in CORNERS}


def as_calibration(robot_from_board: Transform, square: float) -> Calibration:
    """A pose as if its corners had been touched, to be kept where touched corners are."""
    points = {name: robot_from_board @ corner for name, corner in _corners(square).items()}
    return calibrate(points, date=datetime.now(UTC), square=square)


def save_camera_pose(path: Path, pose: CameraPose) -> None:
    """Write the file; the one before it is replaced whole or not at all.

    Raises:
        CalibrationError: it cannot be written.
    """
    record = _Record(
        date=pose.date,
        camera=pose.camera,
        spread=pose.spread,
        robot_from_camera=pose.robot_from_camera.matrix.tolist(),
    )
    try:
        replace_file(path, record.model_dump_json(indent=2) + "\n")
    except OSError as error:
        raise CalibrationError(
            f"The camera's calibration cannot be written to {path}: {error.strerror}.",
            hint="Free or allow that directory, or name another one with --data-dir.",
        ) from None


def load_camera_pose(path: Path) -> CameraPose | None:
    """Read the file; None when there is none.

    Raises:
        CalibrationError: unreadable, damaged, or of a newer version.
    """
    try:
        record = _Record.model_validate_json(path.read_text(encoding="utf-8"))
        matrix = np.array(record.robot_from_camera)
        pose = Transform(matrix[:3, :3], matrix[:3, 3])
    except FileNotFoundError:
        return None
    except (OSError, ValidationError, ValueError) as error:
        what = error.errors()[0]["msg"] if isinstance(error, ValidationError) else error
        raise CalibrationError(
            f"The camera's calibration {path} cannot be used: {what}.",
            hint="Calibrate again: kempelen calibrate --camera",
        ) from None
    return CameraPose(pose, record.camera, record.spread, record.date)
