"""The calibration's own file: versioned JSON with date and residual, for machines and for people.

What counts are the touched corners; pose and residuals are written beside them for people and as a check: a
file whose pose does not follow from its corners was damaged or edited, and is refused.
"""

import json
from datetime import datetime
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from kempelen.app.files import replace_file
from kempelen.core.calibration import CALIBRATION_VERSION, Calibration, Tolerances, Touched, calibrate
from kempelen.core.errors import CalibrationError

_AGREEMENT = 1e-6  # mm: numbers are written in full
_AGAIN = "Calibrate again: kempelen calibrate."

_Point = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
_Row = tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat]


class _Record(BaseModel):
    """The file's content; lengths in mm, the pose as the rows of a 4 x 4 matrix."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    version: Annotated[int, Field(ge=1, le=CALIBRATION_VERSION)] = CALIBRATION_VERSION
    date: AwareDatetime
    touched: Touched
    known_square: FiniteFloat | None
    corners: dict[str, _Point]
    weights: dict[str, FiniteFloat]
    square: FiniteFloat
    residuals: dict[str, FiniteFloat]
    rms: FiniteFloat
    robot_from_board: tuple[_Row, _Row, _Row, _Row]


def save_calibration(path: Path, calibration: Calibration) -> None:
    """Write the file; the one before it is replaced whole or not at all.

    Raises:
        CalibrationError: it cannot be written.
    """
    record = _Record(
        date=calibration.date,
        touched=calibration.touched,
        known_square=calibration.known_square,
        corners=dict(calibration.corners),
        weights=dict(calibration.weights),
        square=calibration.square,
        residuals=dict(calibration.residuals),
        rms=calibration.rms,
        robot_from_board=calibration.robot_from_board.matrix.tolist(),
    )
    try:
        replace_file(path, record.model_dump_json(indent=2) + "\n")
    except OSError as error:
        raise CalibrationError(
            f"The calibration cannot be written to {path}: {error.strerror}.",
            hint="Free or allow that directory, or name another one with --data-dir.",
        ) from None


def load_calibration(path: Path, tolerances: Tolerances | None = None) -> Calibration | None:
    """Read the file; None when there is none.

    Args:
        path: Of the file.
        tolerances: With which its corners are believed.

    Raises:
        CalibrationError: unreadable, damaged, of a newer version, or its corners are no board.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    except OSError as error:
        raise CalibrationError(
            f"The calibration {path} cannot be read: {error.strerror}.", hint="Allow reading it."
        ) from None
    except UnicodeDecodeError:
        raise CalibrationError(f"The calibration {path} is damaged: it is no text.", hint=_AGAIN) from None
    record = _parse(path, text)
    try:
        found = _measure(record, record.date, tolerances)
    except CalibrationError as error:
        raise CalibrationError(
            f"The calibration {path}: {error.message}", hint=error.hint or _AGAIN
        ) from None
    _check_agreement(path, record, found)
    return found


def _measure(record: _Record, date: datetime, tolerances: Tolerances | None) -> Calibration:
    return calibrate(
        record.corners,
        date=date,
        square=record.known_square,
        touched=record.touched,
        weights=record.weights,
        tolerances=tolerances,
    )


def _parse(path: Path, text: str) -> _Record:
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise CalibrationError(f"The calibration {path} is damaged: {error}.", hint=_AGAIN) from None
    version = content.get("version") if isinstance(content, dict) else None
    if isinstance(version, int) and version > CALIBRATION_VERSION:
        raise CalibrationError(
            f"The calibration {path} is of version {version}, this program reads up to "
            f"{CALIBRATION_VERSION}.",
            hint="Use the newer Kempelen that wrote it, or calibrate again.",
        )
    try:
        return _Record.model_validate(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "the whole"
        raise CalibrationError(
            f"The calibration {path} is damaged at '{where}': {first['msg']}.", hint=_AGAIN
        ) from None


def _check_agreement(path: Path, record: _Record, found: Calibration) -> None:
    off = float(np.abs(found.robot_from_board.matrix - np.array(record.robot_from_board)).max())
    off = max(off, abs(found.square - record.square))
    if off > _AGREEMENT:
        raise CalibrationError(
            f"The calibration {path} is damaged: its pose is {off:.3g} mm off what its corners say.",
            hint=_AGAIN,
        )
