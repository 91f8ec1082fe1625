"""The fit check before play: what on the table is too big, too near or too far, by how much, and the mend.

All distances are horizontal unless they are called heights; a piece counts as an upright cylinder as wide as
its widest part, wherever it may stand within `OFF_CENTRE` of its place.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import atan2, degrees

import chess
import numpy as np

from kempelen.core.errors import FitError
from kempelen.core.geometry import Array
from kempelen.core.pieces import KINDS, PieceShape, kind_name
from kempelen.core.places import Place
from kempelen.core.table import FULL_SET, Table, Tray, WorkSpace

OFF_CENTRE = 3.0
"""How far from the middle of its place a piece may stand, mm."""
DRIVING = 0.45
"""How far the fingers may be from where they are wanted, mm: servo lag, rounding of corners and alignment."""

CARRY_CLEARANCE = 10.0
"""Least gap between a carried piece and the tallest one below it, mm; the planner's own default."""

PALM_CLEARANCE = 2.0
"""Least gap between the palm and the heads below it, mm."""

FINGER_CLEARANCE = 1.0
"""Least gap between the finger tips and the surface, mm."""

PIECES_OFF_BOARD = 2 * (sum(FULL_SET.values()) - FULL_SET[chess.KING])
"""Most pieces that can stand beside the board: all but the kings, the spare queens included."""

_EPSILON = 1e-6  # mm: rounding of coordinates is no misfit


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that does not fit.

    Attributes:
        what: Where and what, with the measured and the allowed number.
        by: By how much, in ``unit``, above 0.
        mend: What to change.
        where: What a picture of the table marks: ``board``, names of trays, places and kinds.
    """

    what: str
    by: float
    mend: str
    unit: str = "mm"
    where: tuple[str, ...] = ()

    def __str__(self) -> str:
        amount = f"{self.by:.1f} {self.unit}" if self.unit == "mm" else f"{self.by:.0f} {self.unit}"
        return f"{self.what}: {amount} too much. {self.mend}"


def check_fit(table: Table, carry_clearance: float = CARRY_CLEARANCE) -> list[Finding]:
    """Everything on the table that does not fit, nothing if all does.

    Args:
        table: To be checked.
        carry_clearance: Gap that the planner keeps between a carried piece and those below it, mm.
    """
    return [*_lift(table, carry_clearance), *(finding for check in _CHECKS for finding in check(table))]


def refuse(findings: Sequence[Finding]) -> None:
    """Refuse a table of which there are findings.

    Raises:
        FitError: with all of them.
    """
    if findings:
        count = "One thing does" if len(findings) == 1 else f"{len(findings)} things do"
        raise FitError(
            "\n".join([f"{count} not fit on the table:", *(f"  - {finding}" for finding in findings)]),
            hint="Change the configuration or the table, then check again with: kempelen doctor",
        )


# --- work space -------------------------------------------------------------------------------------------


def _reach(table: Table) -> Iterator[Finding]:
    """Every place can be reached at the grip heights of all kinds."""
    for area in ("", *(tray.name for tray in table.trays)):
        places = [place for place in table.places if place.tray == area]
        points = np.array(
            [[table.grip_point(p, k), table.release_point(p, k)] for p in places for k in KINDS]
        )  # (places * kinds, 2, 3)
        labels = [place for place in places for _ in KINDS]
        for axis in range(3):
            low, high = points[:, :, axis].min(axis=1), points[:, :, axis].max(axis=1)
            first, last = int(low.argmin()), int(high.argmax())
            yield from _beyond(table.space, labels[first], axis, float(low[first]))
            yield from _beyond(table.space, labels[last], axis, float(high[last]))


def _beyond(space: WorkSpace, place: Place, axis: int, value: float) -> Iterator[Finding]:
    low, high = space.lower[axis], space.upper[axis]
    excess = max(low - value, value - high)
    if excess > _EPSILON:
        what, name, sign = place.tray or "board", "xyz"[axis], "+" if value < low else "-"
        yield Finding(
            f"Reach of the {what}: over {place} the tool point has {name} {value:.1f} mm, "
            f"the work space is {low:.1f} to {high:.1f} mm",
            excess,
            f"Move the {what} {excess:.1f} mm in {sign}{name}, or widen the work space.",
            where=(what, str(place)),
        )


def _lift(table: Table, clearance: float) -> Iterator[Finding]:
    """The tallest piece can be carried over the tallest piece."""
    surface = max(float(table.centre(place)[2]) for place in table.places)
    grip = max(table.pieces[kind].grip_height for kind in KINDS)
    needed = surface + table.pieces.tallest + clearance + grip
    missing = needed - table.space.upper[2]
    if missing > _EPSILON:
        yield Finding(
            f"Lift: carrying one piece over the tallest needs the tool point at z {needed:.1f} mm, "
            f"the work space ends at {table.space.upper[2]:.1f} mm",
            missing,
            "Raise the gantry, lower the board or use shorter pieces.",
        )


def _finger_tips(table: Table) -> Iterator[Finding]:
    """The finger tips stay above the surface at the lowest grip."""
    lowest = min(KINDS, key=lambda kind: table.pieces[kind].grip_height)
    height = table.pieces[lowest].grip_height
    missing = table.gripper.below_tool + FINGER_CLEARANCE - height
    if missing > _EPSILON:
        yield Finding(
            f"Finger tips: they reach {table.gripper.below_tool:.1f} mm below the tool point, "
            f"a {kind_name(lowest)} is gripped {height:.1f} mm above the surface",
            missing,
            f"Grip the {kind_name(lowest)} higher or shorten the fingers below the pads.",
            where=(kind_name(lowest),),
        )


# --- pieces on their places -------------------------------------------------------------------------------


def _footprint(table: Table) -> float:
    """Radius of the circle in which the widest piece stands, off-centre included, mm."""
    return max(_width(table.pieces[kind]) for kind in KINDS) / 2 + OFF_CENTRE


def _width(shape: PieceShape) -> float:
    return max(shape.base_diameter, shape.head_diameter)


def _spacing(table: Table) -> Iterator[Finding]:
    """Neighbours do not touch, on the squares and in each tray."""
    needed = 2 * _footprint(table)
    spacings = [("Squares", table.square, "Use larger squares or narrower pieces.", "board")]
    spacings += [
        (f"Tray '{tray.name}': slots", tray.pitch, f"Set its pitch to {needed:.1f} mm or more.", tray.name)
        for tray in table.trays
        if tray.rows * tray.columns > 1
    ]
    for what, pitch, mend, area in spacings:
        if needed - pitch > _EPSILON:
            yield Finding(
                f"{what} of {pitch:.1f} mm: the widest piece needs {needed:.1f} mm, "
                f"{OFF_CENTRE:.0f} mm off-centre on either side included",
                needed - pitch,
                mend,
                where=(area,),
            )


def _trays_and_board(table: Table) -> Iterator[Finding]:
    """No slot's piece reaches onto the playing field."""
    radius, side = _footprint(table), 8 * table.square
    for tray in table.trays:
        centres = _slots(tray)
        outside = np.maximum(np.maximum(-centres, centres - side), 0.0)  # (slots, 2)
        gaps = np.linalg.norm(outside, axis=1)
        worst = int(gaps.argmin())
        missing = radius - float(gaps[worst])
        if missing > _EPSILON:
            yield Finding(
                f"Tray '{tray.name}': slot {tray.slots[worst]} is {gaps[worst]:.1f} mm from the playing "
                f"field, its piece needs {radius:.1f} mm",
                missing,
                f"Move the tray's origin {missing:.1f} mm away from the board.",
                where=(tray.name, str(tray.slots[worst])),
            )


def _trays_apart(table: Table) -> Iterator[Finding]:
    """Slots of different trays leave room for their pieces."""
    needed = 2 * _footprint(table)
    for one, other in combinations(table.trays, 2):
        apart = np.linalg.norm(_slots(one)[:, None] - _slots(other)[None], axis=2)
        i, j = np.unravel_index(int(apart.argmin()), apart.shape)
        missing = needed - float(apart[i, j])
        if missing > _EPSILON:
            yield Finding(
                f"Trays '{one.name}' and '{other.name}': slots {one.slots[i]} and {other.slots[j]} are "
                f"{apart[i, j]:.1f} mm apart, two pieces need {needed:.1f} mm",
                missing,
                f"Move one of the trays {missing:.1f} mm away from the other.",
                where=(str(one.slots[i]), str(other.slots[j])),
            )


def _slots(tray: Tray) -> Array:
    """(slots, 2) centres, board frame, mm."""
    return np.array([tray.centre(slot.number)[:2] for slot in tray.slots])


def _slot_count(table: Table) -> Iterator[Finding]:
    """Every piece that can be off the board has a slot."""
    missing = PIECES_OFF_BOARD - len(table.slots)
    if missing > 0:
        yield Finding(
            f"Trays with {len(table.slots)} slots: {PIECES_OFF_BOARD} pieces can stand beside the board, "
            "the two spare queens included",
            missing,
            f"Add {missing} slots.",
            "pieces",
        )


# --- gripper ----------------------------------------------------------------------------------------------


def _opening(table: Table) -> Iterator[Finding]:
    """Every head passes between the open pads."""
    for kind in KINDS:
        shape = table.pieces[kind]
        needed = max(shape.head_diameter, shape.grip_diameter) + 2 * (OFF_CENTRE + DRIVING)
        if needed - table.gripper.opening > _EPSILON:
            yield Finding(
                f"Gripper open by {table.gripper.opening:.1f} mm: a {kind_name(kind)} up to "
                f"{OFF_CENTRE:.0f} mm off-centre needs {needed:.1f} mm",
                needed - table.gripper.opening,
                f"Open the gripper to {needed:.1f} mm or use pieces with smaller heads.",
                where=(kind_name(kind),),
            )


def _fingers(table: Table) -> Iterator[Finding]:
    """Open fingers around one place stay clear of pieces on all others."""
    gap, centre, other = _worst_pair(table, _finger_gaps(table))
    needed = _footprint(table) + DRIVING
    missing = needed - gap
    if missing > _EPSILON:
        to = table.centre(other) - table.centre(centre)
        closing = float(table.gripper.closing_angles(table.centre(centre)))
        axis = abs(degrees(closing - atan2(to[1], to[0]))) % 180
        yield Finding(
            f"Fingers: gripping on {centre}, an open finger passes {gap:.1f} mm from the middle of {other}, "
            f"whose piece needs {needed:.1f} mm; the fingers close at "
            f"{min(axis, 180 - axis):.0f}° to that line",
            missing,
            f"Open the gripper {missing:.1f} mm less at each side, use thinner fingers, larger squares or "
            "narrower pieces, or align the board with the gripper.",
            where=(str(centre), str(other)),
        )


def _finger_gaps(table: Table) -> Array:
    """(places, places) from the open fingers over the first to the middle of the second, mm."""
    gripper = table.gripper
    angles = gripper.closing_angles(np.array([table.centre(place) for place in table.places]))[:, None]
    c, s = np.cos(angles), np.sin(angles)
    x, y = np.moveaxis(_between(table), 2, 0)  # each (n, n)
    along, across = np.abs(c * x + s * y), np.abs(c * y - s * x)
    # By symmetry both fingers are the rectangle [opening/2, half_length_open] x [0, width/2].
    dx = np.maximum(np.maximum(gripper.opening / 2 - along, along - gripper.half_length_open), 0.0)
    dy = np.maximum(across - gripper.finger_width / 2, 0.0)
    return np.asarray(np.hypot(dx, dy), dtype=np.float64)


def _palm(table: Table) -> Iterator[Finding]:
    """The palm stays above every head while the lowest piece is gripped next to the tallest."""
    gripper, pieces = table.gripper, table.pieces
    for kind in KINDS:
        over = gripper.finger_length - (pieces[kind].height - pieces[kind].grip_height)
        if PALM_CLEARANCE - over > _EPSILON:
            yield Finding(
                f"Palm: gripping a {kind_name(kind)}, it is {over:.1f} mm above its head, "
                f"{PALM_CLEARANCE:.1f} mm needed",
                PALM_CLEARANCE - over,
                f"Lengthen the fingers or grip the {kind_name(kind)} higher.",
                where=(kind_name(kind),),
            )
    heights = np.array([table.centre(place)[2] for place in table.places])
    lowest = min(pieces[kind].grip_height for kind in KINDS) + gripper.finger_length
    over_heads = heights[:, None] + lowest - (heights[None] + pieces.tallest)  # (n, n)
    near = np.linalg.norm(_between(table), axis=2) < gripper.palm_radius + _footprint(table)
    gap, centre, other = _worst_pair(table, np.where(near, over_heads, np.inf))
    if PALM_CLEARANCE - gap > _EPSILON:
        yield Finding(
            f"Palm: gripping the lowest piece on {centre}, it is {gap:.1f} mm above the tallest piece on "
            f"{other}, {PALM_CLEARANCE:.1f} mm needed",
            PALM_CLEARANCE - gap,
            "Lengthen the fingers, or grip the lowest piece higher.",
            where=(str(centre), str(other)),
        )


def _between(table: Table) -> Array:
    """(places, places, 2) from the first place to the second, robot frame, mm."""
    centres = np.array([table.centre(place)[:2] for place in table.places])
    between: Array = centres[None] - centres[:, None]
    return between


def _worst_pair(table: Table, gaps: Array) -> tuple[float, Place, Place]:
    """The least of (places, places) gaps and its two different places."""
    gaps = gaps + np.diag(np.full(len(gaps), np.inf))
    i, j = np.unravel_index(int(gaps.argmin()), gaps.shape)
    return float(gaps[i, j]), table.places[int(i)], table.places[int(j)]


_CHECKS: tuple[Callable[[Table], Iterator[Finding]], ...] = (
    _reach,
    _finger_tips,
    _spacing,
    _trays_and_board,
    _trays_apart,
    _slot_count,
    _opening,
    _fingers,
    _palm,
)
