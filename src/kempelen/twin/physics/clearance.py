"""How far the hand may move before it can touch anything.

While nothing but the hand moves, physics has nothing to say as long as the hand stays clear of every piece:
the gantry goes where it is told. The slack found here bounds how far that holds, so that it need not be
looked for at every step.
"""

import math
from collections.abc import Sequence

import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.pieces import PieceShape
from kempelen.twin.physics.bodies import base_height
from kempelen.twin.physics.gripper import Jaw

UPRIGHT = 0.02
"""Sine of the lean up to which a piece fits between the open fingers."""
MARGIN = 1.0
"""Kept free around everything, mm."""


class Resting:
    """Pieces at rest, each as an upright cylinder that holds it.

    Args:
        shapes: Of the pieces.

    Attributes:
        positions: (n, 2) of the axes, robot frame, mm.
        tops: (n,) mm.
        radii: (n,) mm.
        upright: (n,) whether it stands.
    """

    def __init__(self, shapes: Sequence[PieceShape]) -> None:
        self._heights = np.array([shape.height for shape in shapes])
        self._bases = np.array([shape.base_diameter / 2 for shape in shapes])
        self.positions = np.zeros((len(shapes), 2))
        self.tops = np.zeros(len(shapes))
        self.radii = self._bases
        self.upright = np.ones(len(shapes), dtype=bool)

    def __len__(self) -> int:
        return len(self._heights)

    def update(self, positions: Array, axes: Array) -> None:
        """Take note of where the pieces rest.

        Args:
            positions: (n, 3) of the bases' centres, robot frame, mm.
            axes: (n, 3) unit vectors from base to head.
        """
        lean = np.hypot(axes[:, 0], axes[:, 1])
        self.positions = positions[:, :2]
        self.tops = positions[:, 2] + self._heights * np.abs(axes[:, 2]) + self._bases * lean
        self.radii = self._bases + self._heights * lean
        self.upright = lean < UPRIGHT


class Clearance:
    """Distances between the gantry's hand and pieces at rest.

    Args:
        jaw: The gripper's sizes.
        shapes: Of the pieces.
    """

    def __init__(self, jaw: Jaw, shapes: Sequence[PieceShape]) -> None:
        self._jaw = jaw
        self._resting = Resting(shapes)
        self._heads = np.array([max(shape.head_diameter, shape.grip_diameter) / 2 for shape in shapes])
        self._discs = np.array([base_height(shape) for shape in shapes])
        self._reach = math.hypot(jaw.outside_open, jaw.half_width)
        self._free = jaw.free_radius
        self._base_tops = np.zeros(len(shapes))

    def __len__(self) -> int:
        return len(self._resting)

    def update(self, positions: Array, axes: Array) -> None:
        """Take note of the pieces: (n, 3) bases' centres, mm, and (n, 3) unit vectors from base to head."""
        self._resting.update(positions, axes)
        self._base_tops = positions[:, 2] + self._discs

    def slack(self, tool: Array, *, opened: bool) -> float:
        """How far the tool point may go in any direction without a touch, mm; 0 or less: it may touch now.

        Args:
            tool: (3,) tool point, robot frame, mm.
            opened: Whether the jaw is fully open, so that a piece may stand inside of it.
        """
        jaw, resting = self._jaw, self._resting
        away = np.hypot(resting.positions[:, 0] - tool[0], resting.positions[:, 1] - tool[1])
        below_palm = tool[2] + jaw.length - resting.tops
        beside_fingers = np.minimum(away - resting.radii - self._reach, below_palm)
        beside = np.maximum(beside_fingers, away - resting.radii - jaw.palm_radius)
        slack = np.maximum(tool[2] - jaw.below - resting.tops, beside)
        if opened:
            inside = np.minimum(self._free - self._heads - away, below_palm)
            inside = np.minimum(inside, tool[2] - jaw.below - self._base_tops)
            slack = np.where(resting.upright, np.maximum(slack, inside), slack)
        return float(slack.min(initial=math.inf)) - MARGIN
