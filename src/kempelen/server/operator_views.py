"""What the operator's pages read: ports, table, calibration, eyes, logs, about. Plain values over HTTP."""

from datetime import UTC, datetime
from math import degrees

import chess
from pydantic import Field

from kempelen.app.config import Config
from kempelen.app.doctor_rows import Check
from kempelen.app.fitting import tilts
from kempelen.app.port_scan import Answer, FoundPort
from kempelen.app.table_form import TableForm
from kempelen.core.calibration import Calibration
from kempelen.core.fit import OFF_CENTRE, Finding
from kempelen.core.geometry import Array
from kempelen.core.pieces import KINDS, PRESETS, PieceSet, PieceShape
from kempelen.core.surfaces import Surface
from kempelen.core.table import Gripper, Table
from kempelen.server.messages import WireLine
from kempelen.server.model import Model
from kempelen.server.topics import Point

Flat = tuple[float, float]


class PortView(Model):
    """A port and what answers there.

    Attributes:
        port: What to connect to.
        answer: As `kempelen.app.port_scan.FoundPort`.
        said: In plain words, with what to do.
    """

    port: str
    description: str
    answer: Answer
    said: str

    @classmethod
    def of(cls, found: FoundPort) -> "PortView":
        """From a scan."""
        return cls(port=found.port, description=found.description, answer=found.answer, said=found.said)


class PortsView(Model):
    """The last scan.

    Attributes:
        kinds: Robots that there are drivers for.
        at: When it was made, s since the epoch; None for never.
    """

    kinds: tuple[str, ...]
    at: float | None = None
    ports: tuple[PortView, ...] = ()


class FindingView(Model):
    """Something that does not fit.

    Attributes:
        text: Where and what, with the measured and the allowed number.
        by: By how much, in ``unit``.
        mend: What to change.
        where: To be marked: ``board``, names of trays, places, kinds of pieces.
    """

    text: str
    by: float
    unit: str
    mend: str
    where: tuple[str, ...]

    @classmethod
    def of(cls, found: Finding) -> "FindingView":
        """From the fit check."""
        return cls(text=found.what, by=found.by, unit=found.unit, mend=found.mend, where=found.where)


class AreaView(Model):
    """Playing field or tray, seen from above.

    Attributes:
        name: ``board``, or the tray's.
        corners: Of its surface, x, y, mm, robot frame, in a ring.
    """

    name: str
    corners: tuple[Flat, ...]


class SlotView(Model):
    """A place on the table: x, y, mm, robot frame."""

    name: str
    area: str
    at: Flat


class GeometryView(Model):
    """The table from above, robot frame, mm.

    Attributes:
        lower: Of the box that the tool point reaches.
        upper: Of it.
        areas: Playing field and trays.
        places: Squares and slots.
        radius: Of the circle that the widest piece needs on each place.
    """

    lower: Point
    upper: Point
    areas: tuple[AreaView, ...]
    places: tuple[SlotView, ...]
    radius: float

    @classmethod
    def of(cls, table: Table) -> "GeometryView":
        """Of a table."""
        pieces = table.pieces
        widest = max(max(pieces[kind].base_diameter, pieces[kind].head_diameter) for kind in KINDS)
        return cls(
            lower=table.space.lower,
            upper=table.space.upper,
            areas=tuple(AreaView(name=area.name, corners=_ring(area)) for area in table.surfaces),
            places=tuple(
                SlotView(name=str(place), area=place.tray or "board", at=_flat(table.centre(place)))
                for place in table.places
            ),
            radius=widest / 2 + OFF_CENTRE,
        )


class FitView(Model):
    """What came of a form: the picture, and what does not fit.

    Attributes:
        square: Of the table, mm: calibrated where it was.
        pieces: Sizes of each kind, mm.
        tilts: Places over which an arm has to tilt its gripper, and how far, degrees.
    """

    square: float
    geometry: GeometryView
    pieces: dict[str, PieceShape]
    findings: tuple[FindingView, ...]
    tilts: dict[str, float]

    @classmethod
    def of(cls, config: Config, table: Table, findings: list[Finding]) -> "FitView":
        """Of a table and the robot that plays on it."""
        return cls(
            square=table.square,
            geometry=GeometryView.of(table),
            pieces=shapes(table.pieces),
            findings=tuple(map(FindingView.of, findings)),
            tilts={str(place): degrees(tilt) for place, tilt in tilts(config, table).items()},
        )


class TableView(Model):
    """The table in force.

    Attributes:
        form: What can be edited of it.
        fit: What came of that.
        calibrated: Whether the board was measured: its square and place then come from there.
        presets: Sizes of each kind, by set.
        gripper: Sizes of the hand.
        editable: Whether it can be saved now; ``why_not`` tells otherwise.
    """

    form: TableForm
    fit: FitView
    calibrated: bool
    presets: dict[str, dict[str, PieceShape]]
    gripper: Gripper
    why_not: str = ""

    @classmethod
    def of(
        cls, config: Config, table: Table, findings: list[Finding], *, calibrated: bool, why_not: str
    ) -> "TableView":
        """Of a configuration and what was built of it."""
        return cls(
            form=TableForm.of(config),
            fit=FitView.of(config, table, findings),
            calibrated=calibrated,
            presets={name: shapes(pieces) for name, pieces in PRESETS.items()},
            gripper=config.gripper,
            why_not=why_not,
        )


class PoseView(Model):
    """Where the board stands: a1's outer corner, mm, robot frame; turn and tilt in degrees."""

    x: float
    y: float
    z: float
    turn: float
    tilt: float


class MeasuredView(Model):
    """The calibration in force.

    Attributes:
        made: Whether there is one; all else is empty when not.
        date: When, s since the epoch.
        age: s.
        corners: Touched points, mm, robot frame.
        residuals: mm, by corner.
        rms: mm.
        checked: Whether the residual says anything.
        pose: Also without a calibration: as configured.
    """

    made: bool
    pose: PoseView
    square: float
    date: float | None = None
    age: float | None = None
    corners: dict[str, Point] = Field(default_factory=dict)
    residuals: dict[str, float] = Field(default_factory=dict)
    rms: float | None = None
    checked: bool = False

    @classmethod
    def of(cls, calibration: Calibration | None, table: Table) -> "MeasuredView":
        """Of what was measured, and the table that came of it."""
        pose = table.robot_from_board
        x, y, z = (float(part) for part in pose.translation)
        there = PoseView(x=x, y=y, z=z, turn=degrees(pose.yaw), tilt=degrees(pose.tilt))
        if calibration is None:
            return cls(made=False, pose=there, square=table.square)
        return cls(
            made=True,
            pose=there,
            square=calibration.square,
            date=calibration.date.timestamp(),
            age=max(0.0, (datetime.now(UTC) - calibration.date).total_seconds()),
            corners=dict(calibration.corners),
            residuals=dict(calibration.residuals),
            rms=calibration.rms,
            checked=calibration.checked,
        )


class ParameterView(Model):
    """A number that the eyes read with.

    Attributes:
        name: ``reader.what_it_is``.
        value: Worked with.
        estimate: What the reader itself takes.
        low: Smallest value that makes sense.
        high: Largest.
        about: What it does, one phrase.
        source: Where the estimate comes from.
        overridden: Whether ``value`` was set by hand.
    """

    name: str
    value: float
    estimate: float
    unit: str
    low: float
    high: float
    about: str
    source: str
    overridden: bool


class WireView(Model):
    """Lines on the robot's wire, oldest first."""

    lines: tuple[WireLine, ...]


class LogLine(Model):
    """A record of the program's log."""

    number: int
    at: float
    level: str
    name: str
    text: str


class LogView(Model):
    """The program's log, oldest first."""

    lines: tuple[LogLine, ...]


class AboutView(Model):
    """The program and what it runs on."""

    version: str
    licence: str
    python: str
    system: str
    libraries: dict[str, str]
    robot: str
    port: str
    camera: str
    started: float


class CheckView(Model):
    """A row of the doctor's findings.

    Attributes:
        status: ``ok``, ``warn`` or ``fail``.
        todo: What to do; empty when all is well.
    """

    name: str
    status: str
    found: str
    todo: str

    @classmethod
    def of(cls, check: Check) -> "CheckView":
        """From the doctor."""
        return cls(name=check.name, status=check.status.value, found=check.found, todo=check.todo)


class DoctorView(Model):
    """All rows, and when they were found, s since the epoch."""

    at: float
    rows: tuple[CheckView, ...]


def shapes(pieces: PieceSet) -> dict[str, PieceShape]:
    """Of each kind, by its English name."""
    return {chess.piece_name(kind): pieces[kind] for kind in KINDS}


def _ring(area: Surface) -> tuple[Flat, ...]:
    (x, y, _), (c, s), (a, b) = area.corner, area.along, area.size
    ends = ((0.0, 0.0), (a, 0.0), (a, b), (0.0, b))
    return tuple((x + u * c - v * s, y + u * s + v * c) for u, v in ends)


def _flat(point: Array) -> Flat:
    return (float(point[0]), float(point[1]))
