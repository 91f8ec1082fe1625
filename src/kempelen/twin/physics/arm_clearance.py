"""How far an arm may move before it can touch anything: as `clearance`, for links that lie anyhow."""

import math
from collections.abc import Sequence

import numpy as np

from kempelen.core.geometry import Array, Transform
from kempelen.core.pieces import PieceShape
from kempelen.kinematics import Arm, Body, frames
from kempelen.twin.physics.clearance import MARGIN, Resting
from kempelen.twin.physics.gripper import PALM_HEIGHT, Jaw

_SPACING = 12.0
"""Between the balls that stand for a capsule, mm."""


class ArmClearance:
    """Distances between the whole arm and pieces at rest.

    Every capsule is taken for balls that cover it, every piece for an upright cylinder that holds it.

    Args:
        arm: As it truly is.
        base: Where it stands.
        jaw: The gripper's sizes.
        shapes: Of the pieces.
    """

    def __init__(self, arm: Arm, base: Transform, jaw: Jaw, shapes: Sequence[PieceShape]) -> None:
        self._arm, self._base = arm, base
        self._resting = Resting(shapes)
        moving = [body for body in arm.bodies if body.link > 0]
        balls = [_balls(body) for body in [*moving, *_hand(arm.n, jaw)]]
        self._links = np.concatenate([np.full(len(points), link) for link, points, _ in balls])
        self._points = np.concatenate([points for _, points, _ in balls])
        self._radii = np.concatenate([np.full(len(points), radius) for _, points, radius in balls])

    def __len__(self) -> int:
        return len(self._resting)

    def update(self, positions: Array, axes: Array) -> None:
        """Take note of the pieces: (n, 3) bases' centres, mm, and (n, 3) unit vectors from base to head."""
        self._resting.update(positions, axes)

    def slack(self, joints: Array, *, opened: bool) -> float:
        """How far every point of the arm may go in any direction without a touch, mm."""
        del opened  # a piece between open fingers counts as touched: there physics has its say
        resting = self._resting
        chain = frames(self._arm, joints)[self._links]
        points = np.einsum("pij,pj->pi", chain[:, :3, :3], self._points) + chain[:, :3, 3]
        points = self._base @ points
        away = np.hypot(*(points[:, None, :2] - resting.positions[None]).transpose(2, 0, 1)) - resting.radii
        above = points[:, 2, None] - resting.tops
        gaps = np.hypot(np.maximum(away, 0.0), np.maximum(above, 0.0)) - self._radii[:, None]
        return float(gaps.min(initial=math.inf)) - MARGIN


def _hand(last: int, jaw: Jaw) -> list[Body]:
    """Fingers and palm as capsules; the approach vector is the last frame's z."""
    fingers = math.hypot(jaw.outside_open, jaw.half_width)
    top = jaw.length + PALM_HEIGHT
    return [
        Body(last, (0.0, 0.0, jaw.below), (0.0, 0.0, -jaw.length), fingers),
        Body(last, (0.0, 0.0, -jaw.length), (0.0, 0.0, -top), jaw.palm_radius),
    ]


def _balls(body: Body) -> tuple[int, Array, float]:
    """Frame number, (m, 3) centres and radius of balls that together hold a capsule, mm."""
    start, end = np.array(body.start), np.array(body.end)
    count = math.ceil(float(np.linalg.norm(end - start)) / _SPACING) + 1
    half = float(np.linalg.norm(end - start)) / max(count - 1, 1) / 2
    return body.link, np.linspace(start, end, count), math.hypot(body.radius, half)
