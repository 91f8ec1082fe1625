"""How an arm differs from its parameter file: from points of the board that its fingertips have touched.

The points are known in the board's frame, the joints as the controller reports them. From at least ten follow
the arm's place beside the board, the offsets of its joints and the errors of its links; they have a file of
their own.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from io import StringIO
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from kempelen.app.files import replace_file
from kempelen.core.calibration import Calibration, calibrate
from kempelen.core.errors import CalibrationError
from kempelen.core.table import Table
from kempelen.kinematics import Arm, Link

if TYPE_CHECKING:
    from kempelen.kinematics.fit import ArmFit

_AGAIN = "Calibrate again: kempelen calibrate --arm"

TOUCHED: Mapping[str, tuple[int, int]] = {
    "the outer corner of a1": (0, 0),
    "the outer corner of h1": (8, 0),
    "the outer corner of h8": (8, 8),
    "the outer corner of a8": (0, 8),
    "the edge between d1 and e1": (4, 0),
    "the edge between h4 and h5": (8, 4),
    "the edge between d8 and e8": (4, 8),
    "the edge between a4 and a5": (0, 4),
    "the crossing of b2, c2, b3 and c3": (2, 2),
    "the crossing of f2, g2, f3 and g3": (6, 2),
    "the crossing of f6, g6, f7 and g7": (6, 6),
    "the crossing of b6, c6, b7 and c7": (2, 6),
}
"""What is touched, in squares from a1's outer corner along the first rank and along the a-file."""


@dataclass(frozen=True, slots=True)
class TouchedPoint:
    """One point.

    Attributes:
        point: (x, y, z) mm in the board's frame; NaN for what was not measured.
        joints: rad, as reported.
    """

    point: tuple[float, float, float]
    joints: tuple[float, ...]


class _Record(BaseModel):
    """The file's content: rows of a, d (mm) and offset (rad), link by link."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    version: Literal[1] = 1
    date: AwareDatetime
    arm: str
    links: Annotated[list[tuple[FiniteFloat, FiniteFloat, FiniteFloat]], Field(min_length=3, max_length=7)]
    residuals: list[FiniteFloat]


def fit_touched(arm: Arm, table: Table, touched: Sequence[TouchedPoint]) -> "ArmFit":
    """The arm, and the board's frame from its base, as the points tell it.

    Args:
        arm: As its parameter file has it.
        table: Where the board is thought to be; its gripper's fingertips touched.
        touched: At least ten, far apart.

    Raises:
        CalibrationError: they are too few, or all near one line.
    """
    from kempelen.kinematics.fit import ArmFit, fit_arm  # noqa: PLC0415 - brings an optimizer along; games load arms

    fitted = fit_arm(
        _longer(arm, table.gripper.below_tool),
        np.array([one.joints for one in touched]),
        np.array([one.point for one in touched]),
        table.robot_from_board.inverse(),
    )
    return ArmFit(
        arm=_longer(fitted.arm, -table.gripper.below_tool),
        table_from_robot=fitted.table_from_robot,
        values=fitted.values,
        left=fitted.left,
        residuals=fitted.residuals,
    )


def _longer(arm: Arm, by: float) -> Arm:
    """The arm with its tool point ``by`` mm farther out."""
    *others, last = arm.links
    return arm.with_links((*others, last._replace(d=last.d + by)))


def board_from(fit: "ArmFit", square: float, date: datetime) -> Calibration:
    """The board's own calibration, as the same points tell it.

    Args:
        fit: In whose ``table_from_robot`` the table is the board.
        square: Side of a square, mm.
        date: When it was measured.
    """
    robot_from_board = fit.table_from_robot.inverse()
    side = 8 * square
    corners = {"a1": (0.0, 0.0), "h1": (side, 0.0), "h8": (side, side), "a8": (0.0, side)}
    found = {name: robot_from_board @ np.array([x, y, 0.0]) for name, (x, y) in corners.items()}
    return calibrate(found, date=date, square=square)


def save_arm(path: Path, arm: Arm, fit: "ArmFit", date: datetime) -> None:
    """Keep what was found.

    Raises:
        CalibrationError: it cannot be written.
    """
    record = _Record(
        date=date,
        arm=arm.name,
        links=[(link.a, link.d, link.offset) for link in fit.arm.links],
        residuals=fit.residuals.tolist(),
    )
    try:
        replace_file(path, record.model_dump_json(indent=2) + "\n")
    except OSError as error:
        raise CalibrationError(
            f"The arm's calibration cannot be written to {path}: {error.strerror}.",
            hint="Free or allow that directory, or name another one with --data-dir.",
        ) from None


def calibrated_arm(path: Path, arm: Arm) -> Arm:
    """The arm as it was measured; as its parameter file has it where it was not.

    Raises:
        CalibrationError: the file is damaged, or that of another arm.
    """
    try:
        record = _Record.model_validate_json(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return arm
    except OSError as error:
        raise CalibrationError(
            f"The arm's calibration {path} cannot be read: {error.strerror}.", hint="Allow reading it."
        ) from None
    except (ValidationError, UnicodeDecodeError) as error:
        raise CalibrationError(
            f"The arm's calibration {path} is damaged: {_first(error)}.", hint=_AGAIN
        ) from None
    if record.arm != arm.name or len(record.links) != arm.n:
        raise CalibrationError(
            f"The calibration {path} is that of the arm {record.arm}, configured is {arm.name}.",
            hint=f"{_AGAIN}; or delete the file.",
        )
    rows = zip(arm.links, record.links, strict=True)
    return arm.with_links(tuple(Link(a, link.alpha, d, offset) for link, (a, d, offset) in rows))


def _first(error: ValidationError | UnicodeDecodeError) -> str:
    return error.errors(include_url=False)[0]["msg"] if isinstance(error, ValidationError) else "no text"


def read_points(path: Path, arm: Arm) -> list[TouchedPoint]:
    """Points from a file, a line each: x, y, z (mm, board frame; nan if unknown), then the joints (degrees).

    Raises:
        CalibrationError: it cannot be read, or a line is not that; which.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise CalibrationError(f"The points in {path} cannot be read: {error}.") from None
    rows = [(n, row) for n, row in enumerate(csv.reader(StringIO(text)), 1) if row and row[0][:1] != "#"]
    return [_point(path, number, row, arm) for number, row in rows]


def _point(path: Path, line: int, row: Sequence[str], arm: Arm) -> TouchedPoint:
    try:
        x, y, z, *joints = map(float, row)
    except ValueError:
        joints = []
    if len(joints) != arm.n or not np.isfinite(joints).all():
        raise CalibrationError(
            f"{path}:{line}: '{','.join(row)}' is no point.",
            hint=f"Write x, y, z in mm of the board's frame, then {arm.n} joint angles in degrees.",
        )
    angles = np.radians(joints)
    low, high = arm.ranges.T
    beyond = np.maximum(low - angles, angles - high)
    if (worst := int(beyond.argmax())) >= 0 and beyond[worst] > 1e-6:  # noqa: PLR2004 - rounding
        raise CalibrationError(
            f"{path}:{line}: the {arm.joint_names[worst]} at {joints[worst]:g}° is "
            f"{degrees(beyond[worst]):.1f}° outside of its range, {degrees(low[worst]):g}° to "
            f"{degrees(high[worst]):g}°.",
            hint="Give the joints in the order base first, in degrees.",
        )
    return TouchedPoint((x, y, z), tuple(angles.tolist()))
