"""Plans for an arm: approach a piece, carry it, leave it.

Each plan is swept, with all of the arm, before anyone sees it: one that would touch something is an error and
is never sent.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.core.pieces import piece_name
from kempelen.core.places import Transfer
from kempelen.core.table import Table
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.chain import forward
from kempelen.motion.arm.grasp import park_joints, pose_over, transfer_rolls, transfer_tilts
from kempelen.motion.arm.guidance import BOW, pose_of, posture, straight
from kempelen.motion.arm.pacing import paced, rounded
from kempelen.motion.arm.sweep import Held, sweep_arm
from kempelen.motion.arm.synchrony import TimedPath, least_seconds, require_ranges
from kempelen.motion.arm.trapezoid import Task, corner_over, paths
from kempelen.motion.scene import Clearances, Scene
from kempelen.motion.sweep import Contact

PLANNER = "slanted-trapezoid"
ARM_CLEARANCES = Clearances(align=1.0, off_centre=1.5)
"""Where whole steps end is less exact than a gantry's millimetres, and small squares leave less room for
pieces off their centres."""
_TRIES = 4
"""Ways that kept their clearances and are swept before giving up."""


@dataclass(frozen=True, slots=True, eq=False)
class ArmPlan:
    """A motion that may be driven.

    Attributes:
        joints: (n, k) rad, from the start to the end.
        times: (n,) s, from 0.
        seconds: How long it takes, from rest to rest.
        bound: No motion of these joints between these ends is faster, s.
        vertices: (n, 3) mm, the tool point at each of them, robot frame: for pictures.
        tilt: Of the gripper at the end, rad.
        planner: Name of the planner.
    """

    joints: Array
    times: Array
    seconds: float
    bound: float
    vertices: Array
    tilt: float
    planner: str = PLANNER


def plan_arm_approach(
    arm: Arm, scene: Scene, start: npt.ArrayLike, transfer: Transfer, *, bow: float = BOW
) -> ArmPlan:
    """With open fingers from joint angles (n,) rad to the grip of the piece on ``transfer.source``.

    The tilt is the least at which the piece can also be let go on ``transfer.target``, see `transfer_tilts`.
    ``start`` may also be where another piece has just been released: the hand then rises off that one first.

    Raises:
        MotionError: nothing stands there; out of reach; a joint's limit on the way; something touched.
    """
    piece = scene.standing.get(transfer.source)
    if piece is None:
        raise MotionError(
            f"Nothing stands on {transfer.source}, so nothing can be gripped there.",
            hint="Check the position on the table against the game.",
        )
    title = f"Reaching for the {piece_name(piece)} on {transfer.source}"
    tilt, _ = tilts = transfer_tilts(arm, scene.table, transfer)
    roll, _ = transfer_rolls(arm, scene, transfer, tilts)
    point = scene.table.grip_point(transfer.source, piece.piece_type)
    end = posture(arm, pose_over(point, tilt, roll), title)
    return plan_arm_reach(arm, scene, start, end, title=title, bow=bow)


def plan_arm_carry(
    arm: Arm, scene: Scene, transfer: Transfer, start: npt.ArrayLike, *, bow: float = BOW
) -> ArmPlan:
    """With the piece in the closed fingers from joint angles (n,) rad to where it is let go.

    Args:
        arm: Whose.
        scene: With the piece on its source, or without it.
        transfer: What to carry.
        start: Where the joints are: at the end of the approach, or elsewhere when the piece is already held.
        bow: How far guided motion may leave its line, mm.

    Raises:
        MotionError: the target is taken; out of reach; a joint's limit on the way; something touched.
    """
    kind = transfer.piece.piece_type
    if transfer.target in scene.standing:
        raise MotionError(
            f"{transfer.target} is taken by the {piece_name(scene.standing[transfer.target])}; the "
            f"{piece_name(transfer.piece)} from {transfer.source} cannot be set down there.",
            hint="Check the position on the table against the game.",
        )
    title = f"Carrying the {piece_name(transfer.piece)} from {transfer.source} to {transfer.target}"
    gripped, tilt = tilts = transfer_tilts(arm, scene.table, transfer)
    _, roll = transfer_rolls(arm, scene, transfer, tilts)
    end = posture(arm, pose_over(scene.table.release_point(transfer.target, kind), tilt, roll), title)
    held = Held(scene.table.pieces[kind], gripped)
    if scene.standing.get(transfer.source) == transfer.piece:
        scene = scene.without(transfer.source)
    return checked(Task(arm, scene, _joints(start), end, held, title, bow))


def plan_arm_leave(
    arm: Arm, scene: Scene, start: npt.ArrayLike, end: npt.ArrayLike | None = None, *, bow: float = BOW
) -> ArmPlan:
    """With open fingers from joint angles (n,) rad, where a piece was released, to ``end`` or where it waits.

    Raises:
        MotionError: a joint at its limit on the way; something would be touched.
    """
    first = _joints(start)
    last = park_joints(arm, scene.table, first) if end is None else _joints(end)
    return plan_arm_reach(arm, scene, first, last, title="Leaving", bow=bow)


def plan_arm_lift(arm: Arm, table: Table, start: npt.ArrayLike, *, bow: float = BOW) -> ArmPlan | None:
    """Straight up from joint angles (n,) rad, whatever stands there, until clear of all; None where it is.

    Where the arm cannot go straight up it leans outwards or inwards as little as it can.

    Raises:
        MotionError: a joint at its limit on the way.
    """
    first = _joints(start)
    pose = pose_of(arm, first)
    if pose.height >= table.park_height:
        return None
    above = corner_over(arm, pose, pose, table.park_height, 0.0)
    return _plan(arm, paced(arm, rounded(arm, straight(arm, pose, above, "Lifting the hand", bow))))


def plan_arm_reach(
    arm: Arm,
    scene: Scene,
    start: npt.ArrayLike,
    end: npt.ArrayLike,
    *,
    title: str = "Moving the open hand",
    bow: float = BOW,
) -> ArmPlan:
    """With open fingers from any joint angles (n,) rad to any others.

    Raises:
        MotionError: a joint at its limit on the way; something would be touched.
    """
    return checked(Task(arm, scene, _joints(start), _joints(end), None, title, bow))


def checked(task: Task) -> ArmPlan:
    """The first way that touches nothing, by the swept test.

    Raises:
        MotionError: what would be touched, where and by how much, or which joint comes to its limit.
    """
    require_ranges(task.arm, np.stack((task.start, task.end)), task.title)
    touched: list[Contact] = []
    for _, path in zip(range(_TRIES), paths(task), strict=False):
        timed = paced(task.arm, path)
        touched = sweep_arm(task.arm, task.scene, timed.joints, task.held)
        if not touched:
            return _plan(task.arm, timed)
    what = f": {touched[0]}" if touched else ": no way keeps the clearances"
    more = f" (and {len(touched) - 1} more)" if len(touched) > 1 else ""
    raise MotionError(
        f"{task.title} ({PLANNER} planner){what}{more}. Nothing was sent.",
        hint="Straighten the pieces named, check the calibration and the sizes of pieces and gripper.",
    )


def _plan(arm: Arm, timed: TimedPath) -> ArmPlan:
    first, last = timed.joints[0], timed.joints[-1]
    return ArmPlan(
        joints=timed.joints,
        times=timed.times,
        seconds=timed.seconds,
        bound=least_seconds(arm, first, last),
        vertices=forward(arm, timed.joints)[:, :3, 3],
        tilt=pose_of(arm, last).tilt,
    )


def _joints(angles: npt.ArrayLike) -> Array:
    return np.asarray(angles, dtype=np.float64)
