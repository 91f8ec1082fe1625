"""Which places of a table an arm reaches, with how much tilt, and what placement would mend it.

A place is reached when the tool point can be at every grip and, lifted over a pawn, above it, with the
gripper tilted by no more than `MOST_TILT`: a piece stays upright in tilted fingers, but the more they tilt,
the nearer the palm comes to the heads around.
"""

from collections.abc import Iterator, Mapping
from math import degrees, radians

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import ReachError
from kempelen.core.fit import Finding
from kempelen.core.geometry import Array
from kempelen.core.pieces import KINDS
from kempelen.core.places import Place
from kempelen.core.table import Table
from kempelen.kinematics import Arm, least_tilt, least_tilts

MOST_TILT = radians(20.0)
"""How far from straight down the gripper may be tilted, rad."""
_TILTED = radians(0.5)
"""Less is as good as straight down, rad."""
_MOST_SHIFT = 200
"""How far a mend is looked for, mm."""
_DIRECTIONS = {"+x": (1.0, 0.0), "-x": (-1.0, 0.0), "+y": (0.0, 1.0), "-y": (0.0, -1.0)}


def reach_findings(arm: Arm, table: Table, clearance: float) -> list[Finding]:
    """What the arm does not reach: of the board and of each tray the worst place, by how much, and the mend.

    Args:
        arm: Its base is the origin of the robot's frame.
        table: Board, trays, pieces.
        clearance: Gap that the planner keeps between a carried piece and those below it, mm.
    """
    areas = ("", *(tray.name for tray in table.trays))
    return [finding for area in areas for finding in _unreached(arm, table, area, clearance)]


def tilted_places(arm: Arm, table: Table) -> dict[Place, float]:
    """The places over which the gripper has to be tilted to grip, and how far, rad."""
    places = list(table.places)
    grips = _grips(table, places)
    worst = np.abs(least_tilts(arm, grips, MOST_TILT)).max(axis=1)
    return {place: float(tilt) for place, tilt in zip(places, worst, strict=True) if tilt > _TILTED}


def tilts_told(tilts: Mapping[Place, float], most: int = 8) -> str:
    """A sentence of them, the greatest first; empty where there are none.

    Args:
        tilts: As `tilted_places` has them, rad.
        most: So many places are named.
    """
    if not tilts:
        return ""
    ranked = sorted(tilts.items(), key=lambda item: (-item[1], str(item[0])))
    named = ", ".join(f"{place} ({degrees(tilt):.1f}°)" for place, tilt in ranked[:most])
    rest = f" and {len(ranked) - most} more" if len(ranked) > most else ""
    return f"The arm tilts its gripper over {named}{rest}: they are near the end of its reach."


def _grips(table: Table, places: list[Place]) -> Array:
    """(places, 2, 3) lowest and highest tool point that grips or lets go of a piece there, mm."""
    kinds = sorted(KINDS, key=lambda kind: table.pieces[kind].grip_height)
    ends = (table.grip_point, kinds[0]), (table.release_point, kinds[-1])
    return np.array([[point(place, kind) for point, kind in ends] for place in places])


def _wanted(table: Table, places: list[Place], clearance: float) -> Array:
    """(places, 3, 3) the grips, and the tool point with the tallest piece lifted over a pawn, mm."""
    grips = _grips(table, places)
    lifted = grips[:, 1].copy()
    lifted[:, 2] += min(table.pieces[kind].height for kind in KINDS) + clearance
    return np.concatenate([grips, lifted[:, None]], axis=1)


def _unreached(arm: Arm, table: Table, area: str, clearance: float) -> Iterator[Finding]:
    places = [place for place in table.places if place.tray == area]
    if not places:
        return
    wanted = _wanted(table, places, clearance)
    bad = _out(arm, wanted)
    if not bad.any():
        return
    outside = [place for place, out in zip(places, bad, strict=True) if out]
    points = wanted[bad].reshape(-1, 3)
    points = points[np.isnan(least_tilts(arm, points, MOST_TILT))]
    worst = points[int(np.abs(np.linalg.norm(points[:, :2], axis=1) - _middle(arm)).argmax())]
    name = f"tray '{area}'" if area else "board"
    by, mend = _mend(arm, wanted, name)
    many = f"{len(outside)} places, {_listed(outside)}" if len(outside) > 1 else str(outside[0])
    yield Finding(
        f"Reach of the {name}: the arm cannot grip and lift pieces on {many}. {_why(arm, worst)}",
        by,
        mend,
        where=(area or "board", *map(str, outside)),
    )


def _out(arm: Arm, wanted: Array) -> npt.NDArray[np.bool_]:
    """(places,) whether any of (places, k, 3) tool points is out of reach."""
    return np.asarray(np.isnan(least_tilts(arm, wanted, MOST_TILT)).any(axis=1))


def _middle(arm: Arm) -> float:
    """A distance from the base's axis that is neither near nor far, mm."""
    return 0.6 * sum(abs(link.a) for link in arm.links)


def _why(arm: Arm, point: Array) -> str:
    try:
        least_tilt(arm, point, most=MOST_TILT)
    except ReachError as error:
        return error.message.removesuffix(".")
    return "It is at the very end of its reach"


def _mend(arm: Arm, wanted: Array, name: str) -> tuple[float, str]:
    """How far the area is out, mm, and the shortest move along an axis that brings all of it into reach."""
    if coarse := _shift(arm, wanted, range(5, _MOST_SHIFT + 1, 5)):
        last, _ = coarse
        shift, sign = _shift(arm, wanted, range(last - 4, last + 1)) or coarse
        return float(shift), f"Move the {name} {shift} mm in {sign} of the robot's frame."
    return _shrunk(arm, wanted, name)


def _shift(arm: Arm, wanted: Array, shifts: range) -> tuple[int, str] | None:
    """The first of these moves, in whatever direction, that brings (places, k, 3) mm into reach."""
    for shift in shifts:
        for sign, (x, y) in _DIRECTIONS.items():
            if not _out(arm, wanted + np.array([x, y, 0.0]) * shift).any():
                return shift, sign
    return None


def _shrunk(arm: Arm, wanted: Array, name: str) -> tuple[float, str]:
    """No place is good enough: how much smaller the area would have to be, and where it then is."""
    middle = wanted.mean(axis=(0, 1))
    extent = float(np.ptp(wanted[:, 0, :2], axis=0).max())
    for percent in range(90, 20, -10):
        smaller = middle + (wanted - middle) * np.array([percent / 100, percent / 100, 1.0])
        if found := _shift(arm, smaller, range(0, _MOST_SHIFT + 1, 20)):
            shift, sign = found
            where = f" and move it {shift} mm in {sign} of the robot's frame" if shift else ""
            by = extent * (1 - percent / 100)
            return by, f"Make the {name} {by:.0f} mm shorter ({percent} % of its size){where}."
    return extent, f"Put the {name} elsewhere."


def _listed(places: list[Place], most: int = 4) -> str:
    names = ", ".join(map(str, places[:most]))
    return f"{names} …" if len(places) > most else names
