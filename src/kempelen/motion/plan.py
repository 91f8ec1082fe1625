"""Plans for the hand: approach a piece, carry it, leave it.

Each plan is checked by the swept test before anyone sees it: one that would touch something is an error
and is never sent.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.core.pieces import piece_name
from kempelen.core.places import Place, Transfer
from kempelen.core.surfaces import Point
from kempelen.motion import race
from kempelen.motion.leg import Leg
from kempelen.motion.planners import DEFAULT_PLANNER, planner_named
from kempelen.motion.scene import Scene
from kempelen.motion.sweep import Contact, sweep
from kempelen.motion.timing import travel_seconds

DECIMALS = 3
"""Of a millimetre, on the wire."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A path that may be driven.

    Attributes:
        vertices: (n, 3) mm, robot frame, from the start to the end.
        seconds: Predicted time on the controller, from rest to rest.
        bound: No motion in the vertical plane with the same clearances is faster, s (see `race`).
        planner: Name of the planner.
    """

    vertices: Array
    seconds: float
    bound: float
    planner: str


def plan_approach(
    scene: Scene, start: npt.ArrayLike, place: Place, *, planner: str = DEFAULT_PLANNER
) -> Plan:
    """With open fingers from a tool point (3,) to the grip of the piece on ``place``.

    ``start`` may also be where another piece has just been released: the hand then rises off that one first.

    Raises:
        MotionError: nothing stands there; the work space is too small; something would be touched.
    """
    piece = scene.standing.get(place)
    if piece is None:
        raise MotionError(
            f"Nothing stands on {place}, so nothing can be gripped there.",
            hint="Check the position on the table against the game.",
        )
    end = scene.table.grip_point(place, piece.piece_type)
    return plan_reach(
        scene, start, end, title=f"Reaching for the {piece_name(piece)} on {place}", planner=planner
    )


def plan_carry(
    scene: Scene, transfer: Transfer, *, start: npt.ArrayLike | None = None, planner: str = DEFAULT_PLANNER
) -> Plan:
    """With the piece in the closed fingers from its source to where it is let go, just above its target.

    Args:
        scene: With the piece on its source, or without it.
        transfer: What to carry.
        start: The tool point (3,), when the piece is already held elsewhere than on its source.
        planner: Name of the planner.

    Raises:
        MotionError: the target is taken; the work space is too small; something would be touched.
    """
    return checked(*propose_carry(scene, transfer, start=start, planner=planner))


def propose_carry(
    scene: Scene, transfer: Transfer, *, start: npt.ArrayLike | None = None, planner: str = DEFAULT_PLANNER
) -> tuple[Leg, Plan]:
    """As `plan_carry`, unchecked: for comparing planners; never to be driven."""
    kind = transfer.piece.piece_type
    if scene.standing.get(transfer.source) == transfer.piece and start is None:
        scene = scene.without(transfer.source)
    if transfer.target in scene.standing:
        raise MotionError(
            f"{transfer.target} is taken by the {piece_name(scene.standing[transfer.target])}; the "
            f"{piece_name(transfer.piece)} from {transfer.source} cannot be set down there.",
            hint="Check the position on the table against the game.",
        )
    title = f"Carrying the {piece_name(transfer.piece)} from {transfer.source} to {transfer.target}"
    begin = scene.table.grip_point(transfer.source, kind) if start is None else start
    end = scene.table.release_point(transfer.target, kind)
    leg = Leg.between(scene, _point(begin), _point(end), scene.table.pieces[kind], title)
    return leg, propose(leg, planner)


def plan_leave(
    scene: Scene, start: npt.ArrayLike, end: npt.ArrayLike | None = None, *, planner: str = DEFAULT_PLANNER
) -> Plan:
    """With open fingers from where a piece was released to ``end`` (3,), or to the nearest parking point.

    Args:
        scene: With the released piece on its place.
        start: The tool point (3,).
        end: The tool point (3,) to go to.
        planner: Name of the planner.

    Raises:
        MotionError: the work space is too small; something would be touched.
    """
    start = np.asarray(start, dtype=np.float64)
    target = scene.table.park_point(start) if end is None else end
    return plan_reach(scene, start, target, title="Leaving", planner=planner)


def plan_reach(
    scene: Scene,
    start: npt.ArrayLike,
    end: npt.ArrayLike,
    *,
    title: str = "Moving the open hand",
    planner: str = DEFAULT_PLANNER,
) -> Plan:
    """With open fingers from any tool point (3,) to any other.

    Raises:
        MotionError: the work space is too small; something would be touched.
    """
    leg = Leg.between(scene, _point(start), _point(end), None, title)
    return checked(leg, propose(leg, planner))


def propose(leg: Leg, planner: str) -> Plan:
    """A planner's path for a leg, unchecked: never to be driven."""
    vertices = np.round(np.array(planner_named(planner)(leg)), DECIMALS)
    vertices[0], vertices[-1] = leg.start, leg.end
    seconds = travel_seconds(vertices, leg.scene.table.space)
    return Plan(vertices, seconds, race.least_seconds(leg), planner)


def contacts(leg: Leg, plan: Plan) -> list[Contact]:
    """What driving a plan would touch, by the swept test."""
    return sweep(plan.vertices, leg.scene, leg.held)


def checked(leg: Leg, plan: Plan) -> Plan:
    """The plan, if it touches nothing.

    Raises:
        MotionError: what would be touched, where and by how much.
    """
    touched = contacts(leg, plan)
    if touched:
        more = f" (and {len(touched) - 1} more)" if len(touched) > 1 else ""
        raise MotionError(
            f"{leg.title} ({plan.planner} planner): {touched[0]}{more}. Nothing was sent.",
            hint="Straighten the pieces named, check the calibration and the sizes of pieces and gripper"
            + ("." if plan.planner == DEFAULT_PLANNER else ", or use the asynchronous planner."),
        )
    return plan


def _point(point: npt.ArrayLike) -> Point:
    x, y, z = np.asarray(point, dtype=np.float64).tolist()
    return x, y, z
