"""Reed switches under the squares, magnets under the pieces: which close which."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array, Transform
from kempelen.core.reed import squares_in


class Magnets:
    """Switches with a closing distance, a larger opening one, and contacts that bounce.

    Args:
        robot_from_board: Where the board is.
        square: Side of a square, mm.
        closing: A magnet nearer than this closes a switch, as a share of the square's side.
        opening: One farther than this lets it open again; more than ``closing``.
        bounce_ms: Contacts bounce for at most so long.
        seed: Of the bounces.

    Attributes:
        weak: Strength of single pieces' magnets, 0 to 1, by the piece's name; 1 when not named.
    """

    def __init__(
        self,
        robot_from_board: Transform,
        square: float,
        *,
        closing: float = 0.3,
        opening: float = 0.36,
        bounce_ms: float = 3.0,
        seed: int = 0,
    ) -> None:
        files, ranks = np.meshgrid(np.arange(8), np.arange(8))
        places = np.stack([files.ravel() + 0.5, ranks.ravel() + 0.5, np.zeros(64)], axis=1) * square
        self._places = robot_from_board @ places
        self._up = robot_from_board.rotation[:, 2]
        self._closing, self._opening = closing * square, opening * square
        self._bounce_ms = bounce_ms
        self._rng = np.random.default_rng(seed)
        self._closed = np.zeros(64, dtype=bool)
        self._until = np.zeros(64)
        self.weak: dict[str, float] = {}

    def settle(self, names: Sequence[str], positions: Array, axes: Array) -> int:
        """Everything as it is, at once and without bounces."""
        self._closed = self._near(names, positions, axes)
        self._until[:] = 0.0
        return _mask(self._closed)

    def move(self, now: float, names: Sequence[str], positions: Array, axes: Array) -> int:
        """Where the magnets are now; contacts that change begin to bounce.

        Args:
            now: ms.
            names: Of the pieces.
            positions: (n, 3) mm of their bases' centres, robot frame.
            axes: (n, 3) unit vectors from base to head.

        Returns:
            Squares over whose switch a magnet is.
        """
        closed = self._near(names, positions, axes)
        changed = closed != self._closed
        if changed.any():
            self._until[changed] = now + self._bounce_ms * self._rng.random(int(changed.sum()))
            self._closed = closed
        return _mask(closed)

    def reading(self, now: float) -> int:
        """Contacts at ``now`` ms: those that bounce are open or closed as it happens."""
        closed = _mask(self._closed)
        for square in squares_in(_mask(self._until > now)):
            if self._rng.random() < 0.5:  # noqa: PLR2004 - as often as not
                closed ^= 1 << square
        return closed

    def bouncing(self, now: float) -> bool:
        """Whether any contact is."""
        return bool((self._until > now).any())

    def _near(self, names: Sequence[str], positions: Array, axes: Array) -> npt.NDArray[np.bool_]:
        """(64,) booleans."""
        if not len(names):
            return np.zeros(64, dtype=bool)
        strength = np.array([self.weak.get(name, 1.0) for name in names])
        strength = strength * np.clip(axes @ self._up, 0.0, 1.0)  # a piece that lies turns its magnet away
        away = np.linalg.norm(self._places[:, None] - positions[None], axis=2)
        limit = np.where(self._closed, self._opening, self._closing)
        near: npt.NDArray[np.bool_] = (away < limit[:, None] * strength[None]).any(axis=1)
        return near


def _mask(flags: npt.NDArray[np.bool_]) -> int:
    return int.from_bytes(np.packbits(flags, bitorder="little").tobytes(), "little")
