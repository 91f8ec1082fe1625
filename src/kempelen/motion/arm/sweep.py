"""The independent check: what would the arm touch if it drove these joint angles?

Knows nothing of planners: only the polyline in joint space that the driver gets, the scene and what the
fingers hold. Everything is grown by what the machine may be off, as for any robot (`kempelen.motion.sweep`).

**Between samples.** Let a joint polyline's piece turn joint j by D_j. A point of the arm at most L from every
axis has, along the piece, a second derivative of at most L (sum |D_j|)², so it leaves the chord between its
two ends by at most e = L (sum |D_j|)² / 8. Until half of the time it is within c/2 + e of its start, after
that within c/2 + e of its end, where c is the longest chord of any point. So a piece at both ends of which
the distance to all else is more than c/2 + e touches nothing; one where it is not is cut into quarters and
looked at again, until it touches or c/2 + e is below `FINEST`, which counts as touching.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.core.pieces import PieceShape
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.chain import forward, frames
from kempelen.motion.arm import links
from kempelen.motion.arm.body import Hand, Prisms, hand, prisms
from kempelen.motion.arm.obstacles import FINEST, gaps, lacks, obstacles, point_of
from kempelen.motion.scene import Scene
from kempelen.motion.sweep import Contact, slack

_PARTS = 4  # into which a piece is cut to be looked at again
_LEVELS = 8


class Held(NamedTuple):
    """A piece between the fingers.

    Attributes:
        shape: Its sizes.
        tilt: Of the gripper when it was gripped, rad.
    """

    shape: PieceShape
    tilt: float = 0.0


def sweep_arm(arm: Arm, scene: Scene, joints: Array, held: Held | None) -> list[Contact]:
    """Everything that driving ``joints`` (n, k) rad would touch, deepest first; all at the coarsest look.

    Args:
        arm: Its chain and its links' capsules.
        scene: What stands, without what is held. A piece on whose place the tool point starts or ends is the
            one to be gripped or just released: it may be between the fingers.
        joints: The driver goes from each row to the next, all joints together.
        held: The piece in the closed fingers; None with open fingers.
    """
    sweeper = _Sweeper(arm, scene, joints, held)
    touched = [*sweeper.surfaces(), *links.against_table(arm, scene, sweeper.at), *sweeper.close()]
    deepest: dict[tuple[str, str], Contact] = {}
    for contact in touched:
        key = contact.part, contact.what
        if key not in deepest or contact.depth > deepest[key].depth:
            deepest[key] = contact
    return sorted(deepest.values(), key=lambda contact: -contact.depth)


class _Sweeper:
    """One path's check."""

    def __init__(self, arm: Arm, scene: Scene, joints: Array, held: Held | None) -> None:
        self.arm, self.scene, self.joints = arm, scene, joints
        self.spread = slack(scene)
        self.shape = hand(arm, scene.table.gripper, held.shape if held else None, held.tilt if held else 0.0)
        self.at = frames(arm, joints)
        self.parts = prisms(self.shape, self.at[:, -1])
        self.held = held
        self.obstacles = obstacles(scene, self.parts, open_hand=held is None)

    # --- pieces and the arm itself ------------------------------------------------------------------------

    def close(self) -> Iterator[Contact]:
        """Level by level, finer and finer, where something is near."""
        first, last = self.joints[:-1], self.joints[1:]
        at_first, at_last = self.at[:-1], self.at[1:]
        for level in range(_LEVELS):
            room = _room(self.arm, self.shape, (first, last), (at_first, at_last))
            near = np.zeros(len(first), dtype=bool)
            touched: list[Contact] = []
            for at in (at_first, at_last):
                flagged, contacts = self._look(at, room)
                near |= flagged
                touched += contacts
            if touched or not near.any():
                yield from touched
                return
            stuck = near & (room.max(axis=1) < FINEST)
            if stuck.any() or level == _LEVELS - 1:
                where = np.flatnonzero(near if level == _LEVELS - 1 else stuck)
                yield from self._look(at_first[where], room[where], finest=True)[1]
                return
            first, last = _cut(first[near], last[near])
            at_first, at_last = frames(self.arm, first), frames(self.arm, last)

    def _look(
        self, at: Array, room: Array, *, finest: bool = False
    ) -> tuple[npt.NDArray[np.bool_], list[Contact]]:
        """Which postures (s, n + 1, 4, 4) are nearer to something than ``room`` (s, 2), and which touch."""
        parts = prisms(self.shape, at[:, -1])
        sample, _, _, gap = gaps(parts, self.obstacles, room[:, 0] + self.spread)
        flagged = np.zeros(len(at), dtype=bool)
        flagged[sample] = True
        reach = self.spread + room[:, 0] * finest
        contacts = self._touching(parts, reach) if (gap < reach[sample]).any() else []
        margin = room[:, 1] + self.spread
        link_flags, link_contacts = links.close(
            self.arm,
            self.scene,
            self.obstacles,
            (at, self.shape),
            (margin, self.spread + finest * room[:, 1]),
        )
        return flagged | link_flags, contacts + link_contacts

    def _touching(self, parts: Prisms, reach: Array) -> list[Contact]:
        """What is nearer than ``reach`` (s,) mm, taken exactly there."""
        return [
            Contact(
                self.shape.names[part],
                self.scene.name(int(self.obstacles.piece[cylinder])),
                float(reach[sample] - gap),
                point_of(parts.tool[sample]),
            )
            for sample, part, cylinder, gap in zip(*gaps(parts, self.obstacles, reach), strict=True)
        ]

    # --- surfaces -----------------------------------------------------------------------------------------

    def surfaces(self) -> Iterator[Contact]:
        """The hand above board, trays and the table; heights are linear along a piece but for the bow."""
        joints = self._denser_at_ends()
        turn = np.abs(np.diff(joints, axis=0)).sum(axis=1)
        bow = np.concatenate((turn, [0.0])) ** 2
        bow = np.maximum(bow, np.concatenate(([0.0], bow[:-1]))) * links.reach(self.arm) / 8.0
        parts = prisms(self.shape, forward(self.arm, joints))
        for surface, lack in lacks(self.scene, self.shape, parts, self.spread + bow):
            sample, part = np.unravel_index(int(lack.argmax()), lack.shape)
            if lack[sample, part] > _ROUNDING:
                name, depth = self.shape.names[part], float(lack[sample, part])
                yield Contact(name, f"the {surface.name}", depth, point_of(parts.tool[sample]))

    def _denser_at_ends(self) -> Array:
        """The joints, with more of them between where a carried piece still stands: soon it may not."""
        if self.held is None:
            return self.joints
        tool = self.parts.tool[:, :2]
        reach = self.scene.clearances.align + self.spread
        near = (np.linalg.norm(tool[:, None] - tool[[0, -1]], axis=2) < reach).any(axis=1)
        way = np.linalg.norm(np.diff(tool, axis=0), axis=1)
        pieces = [
            first + np.linspace(0.0, 1.0, int(length / _STEP) + 2)[:-1, None] * (last - first)
            if close
            else first[None]
            for first, last, length, close in zip(
                self.joints[:-1], self.joints[1:], way.tolist(), (near[:-1] | near[1:]).tolist(), strict=True
            )
        ]
        return np.concatenate([*pieces, self.joints[-1:]])


_STEP = 0.2  # mm
_ROUNDING = 1e-6  # mm


def _room(arm: Arm, shape: Hand, joints: tuple[Array, Array], at: tuple[Array, Array]) -> Array:
    """(i, 2) half the longest chord plus the bow: of the hand's points, and of the links'."""
    turn = np.abs(joints[1] - joints[0]).sum(axis=1)
    bow = links.reach(arm) * turn * turn / 8.0
    tools = at[0][:, -1], at[1][:, -1]
    shift = np.linalg.norm(tools[1][:, :3, 3] - tools[0][:, :3, 3], axis=1)
    # A difference of rotations has two equal singular values: its norm is Frobenius' over the root of two.
    twist = np.linalg.norm(tools[1][:, :3, :3] - tools[0][:, :3, :3], axis=(1, 2)) / np.sqrt(2.0)
    own = links.chords(arm, at)
    return np.stack(((shift + twist * shape.extent) / 2 + bow, own / 2 + bow), axis=1)


def _cut(first: Array, last: Array) -> tuple[Array, Array]:
    """Each piece (i, n) in equal parts: starts and ends (parts * i, n)."""
    share = np.linspace(0.0, 1.0, _PARTS + 1)[:, None, None]
    knots = first + share * (last - first)
    n = first.shape[1]
    return knots[:-1].reshape(-1, n), knots[1:].reshape(-1, n)
