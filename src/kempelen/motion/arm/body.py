"""What moves with the arm, at many postures at once: fingers, palm, the piece between them, and the links.

The hand's parts are slanted prisms: a rectangle with rounded corners, pulled along an axis, with level ends
that hold whatever the tilt does to the true ones. A horizontal slice of a prism is then the same rectangle at
every height, shifted along the axis. Links are capsules from the arm's parameter file.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.core.pieces import PieceShape
from kempelen.core.table import Gripper
from kempelen.kinematics.arm import Arm

_LEVEL = 1e-3
"""Least cosine of the approach vector's angle from straight down that a slice is made at."""


@dataclass(frozen=True, slots=True, eq=False)
class Hand:
    """How the hand looks in the tool's frame, sizes in mm.

    Attributes:
        names: (p,) of the parts, for messages.
        along: (p, 2) from where to where along the approach vector, from the tool point.
        across: (p, 2) from where to where along the closing direction.
        half: (p,) half width the other way.
        rounding: (p,) radius of the rounded corners.
        upright: (p,) whether the part is of a piece, upright at ``tilt``; the others lean with the hand.
        tilt: At which the piece was gripped, rad.
        plumb: Whether the pads keep it upright at any tilt.
        extent: Of the farthest point from the tool point.
        closing: Angle of the closing direction from the tool's y axis, rad.
    """

    names: tuple[str, ...]
    along: Array
    across: Array
    half: Array
    rounding: Array
    upright: npt.NDArray[np.bool_]
    tilt: float
    plumb: bool
    extent: float
    closing: float


def hand(arm: Arm, gripper: Gripper, held: PieceShape | None, tilt: float = 0.0) -> Hand:
    """The hand with open fingers, or closed on a piece gripped at ``tilt`` rad."""
    inner = gripper.opening / 2 if held is None else held.grip_diameter / 2
    outer, half = inner + gripper.finger_thickness, gripper.finger_width / 2
    high, low = -gripper.finger_length, gripper.below_tool
    wrist = -max(abs(arm.links[-1].d), gripper.finger_length)
    rows = [
        ("a finger", high, low, inner, outer, half, 0.0, False),
        ("a finger", high, low, -outer, -inner, half, 0.0, False),
        ("the palm", wrist, high, 0.0, 0.0, 0.0, gripper.palm_radius, False),
    ]
    if held is not None:
        grip, head = held.grip_height, max(held.head_diameter, held.grip_diameter) / 2
        rows += [
            ("the carried piece", 0.0, grip, 0.0, 0.0, 0.0, held.base_diameter / 2, True),
            ("the carried piece", grip - held.height, 0.0, 0.0, 0.0, 0.0, head, True),
        ]
    sizes = np.array([row[1:7] for row in rows])
    far = np.abs(sizes[:, :2]).max(axis=1)
    wide = np.hypot(np.abs(sizes[:, 2:4]).max(axis=1), sizes[:, 4]) + sizes[:, 5]
    return Hand(
        names=tuple(row[0] for row in rows),
        along=sizes[:, :2],
        across=sizes[:, 2:4],
        half=sizes[:, 4],
        rounding=sizes[:, 5],
        upright=np.array([row[7] for row in rows]),
        tilt=tilt,
        plumb=gripper.plumb,
        extent=float(np.hypot(far, wide).max()),
        closing=gripper.closing_axis,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Prisms:
    """The hand's p parts at s postures, robot frame, mm.

    Attributes:
        tool: (s, 3) the tool point.
        turn: (s, 3, 3) robot_from_tool.
        closing: (s, 2) horizontal unit vector along which the fingers close.
        lean: (s, p, 2) how far the axis, which leads through the tool point, goes sideways per mm of height.
        bottom: (s, p) z of the lowest point.
        top: (s, p) z of the highest point.
        across: (s, p, 2) range along the closing direction from the axis.
        half: (s, p) half width the other way.
        rounding: (s, p).
    """

    tool: Array
    turn: Array
    closing: Array
    lean: Array
    bottom: Array
    top: Array
    across: Array
    half: Array
    rounding: Array


def prisms(shape: Hand, pose: Array) -> Prisms:
    """The parts at poses (s, 4, 4), robot_from_tool.

    Conservative where closing is not level or a piece leans: what leaning can make of the part is added.
    """
    tool, turn = pose[:, :3, 3], pose[:, :3, :3]
    c, s = np.cos(shape.closing), np.sin(shape.closing)
    closing = c * turn[:, :, 1] - s * turn[:, :, 0]
    level = np.hypot(closing[:, 0], closing[:, 1])
    flat = closing[:, :2] / np.maximum(level, _LEVEL)[:, None]
    fingers, piece = _leaning(shape, pose, closing), _upright(shape, pose)
    both = (np.concatenate(pair, axis=1) for pair in zip(fingers, piece, strict=True))
    return Prisms(tool, turn, flat, *both)


_Parts = tuple[Array, Array, Array, Array, Array, Array]  # lean, bottom, top, across, half, rounding


def _leaning(shape: Hand, pose: Array, closing: Array) -> _Parts:
    """Fingers and palm, which lean with the approach vector."""
    mine = ~shape.upright
    along, across, half = shape.along[mine], shape.across[mine], shape.half[mine]
    rounding = shape.rounding[mine]
    approach = pose[:, :3, 2]
    down = np.maximum(-approach[:, 2:], _LEVEL)  # (s, 1) cosine of the tilt
    lean = np.repeat((approach[:, :2] / -down)[:, None, :], len(half), axis=1)
    slope = np.hypot(lean[..., 0], lean[..., 1])
    off_level = np.abs(closing[:, 2:])
    level = np.sqrt(1.0 - np.minimum(off_level, 1.0) ** 2)
    widest = np.abs(across).max(axis=1) + rounding
    more = off_level * slope * widest
    inner, outer = across[:, 0], across[:, 1]
    sides = (
        np.where(inner > 0, inner * level, inner) - more,
        np.where(outer < 0, outer * level, outer) + more,
    )
    ends = pose[:, 2, 3, None, None] + along * approach[:, 2, None, None]  # (s, p, 2)
    rise = (half + rounding) * np.sqrt(np.maximum(1.0 - down * down, 0.0)) + off_level * widest
    bottom, top = ends.min(axis=2) - rise, ends.max(axis=2) + rise
    return lean, bottom, top, np.stack(sides, axis=2), half / down + more, rounding / down


def _upright(shape: Hand, pose: Array) -> _Parts:
    """The carried piece: upright at the tilt at which it was gripped; where the pads hang plumb, always."""
    along, radius = shape.along[shape.upright], shape.rounding[shape.upright]
    outwards = pose[:, :2, 3] / np.maximum(np.linalg.norm(pose[:, :2, 3], axis=1), _LEVEL)[:, None]
    tilt = np.arctan2((pose[:, :2, 2] * outwards).sum(axis=1), -pose[:, 2, 2])
    lean = np.zeros((len(pose), 1)) if shape.plumb else np.abs(np.sin(tilt - shape.tilt))[:, None]
    height, zeros = pose[:, 2, 3, None], np.zeros((len(pose), len(radius)))
    wide = radius + lean * np.abs(along).max(axis=1, initial=0.0)
    bottom, top = (
        height - along.max(axis=1, initial=0.0) - radius * lean,
        height - along.min(axis=1, initial=0.0),
    )
    nowhere = np.zeros((*zeros.shape, 2))
    return nowhere, bottom, top + radius * lean, nowhere, zeros, wide


@dataclass(frozen=True, slots=True, eq=False)
class Capsules:
    """The arm's b links at s postures, robot frame, mm.

    Attributes:
        start: (s, b, 3).
        end: (s, b, 3).
        radius: (b,).
    """

    start: Array
    end: Array
    radius: Array


def capsules(arm: Arm, at: Array) -> Capsules:
    """The arm's own bodies at frames (s, n + 1, 4, 4)."""
    link = np.array([body.link for body in arm.bodies], dtype=np.intp)
    ends = np.array([(body.start, body.end) for body in arm.bodies]).reshape(-1, 2, 3)
    pose = at[:, link]  # (s, b, 4, 4)
    placed = np.einsum("sbij,bej->sbei", pose[..., :3, :3], ends) + pose[:, :, None, :3, 3]
    return Capsules(placed[:, :, 0], placed[:, :, 1], np.array([body.radius for body in arm.bodies]))


def hand_capsule(shape: Hand, pose: Array) -> tuple[Array, Array, float]:
    """One capsule around the whole hand at poses (s, 4, 4): ends (s, 3), radius; for the arm's own links."""
    leaning = ~shape.upright
    wide = np.hypot(np.abs(shape.across).max(axis=1), shape.half)[leaning] + shape.rounding[leaning]
    along = shape.along[leaning]
    ends = [pose[:, :3, 3] + float(d) * pose[:, :3, 2] for d in (along.min(), along.max())]
    return ends[0], ends[1], float(wide.max())
