"""Positions set up on the twin's table, and a camera over them."""

from collections import defaultdict
from collections.abc import Iterator
from types import TracebackType
from typing import Self

import chess
import numpy as np

from kempelen.bench.twin import famous_games
from kempelen.core.camera import Frame
from kempelen.core.places import Place
from kempelen.core.table import Table, start_layout
from kempelen.twin.cameras.camera import VirtualCamera
from kempelen.twin.cameras.noise import NOMINAL, Noise
from kempelen.twin.physics.scene import Scene
from kempelen.twin.physics.world import World

_SCATTER = 4.0  # mm off the centre that people put pieces down
_RATE = 30.0


class Stage:
    """A table on which any position can be set up at once, and a virtual camera. Context manager.

    Args:
        seed: Of where on its square each piece is put, and of the camera's noise.
        camera: Default a Kinect v2 in its usual place.
    """

    def __init__(self, seed: int, camera: VirtualCamera | None = None) -> None:
        self.table = Table()
        self.world = World(Scene.from_layout(self.table, start_layout(self.table, chess.Board()), seed=seed))
        self.camera = camera or VirtualCamera(seed=seed)
        self._rng = np.random.default_rng(seed)
        self._shots = 0
        self._by_kind: dict[tuple[str, bool], list[str]] = defaultdict(list)
        for piece in self.world.pieces():
            self._by_kind[piece.kind, piece.white].append(piece.piece_id)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the camera back."""
        self.camera.close()

    def show(self, board: chess.BaseBoard) -> None:
        """Put the pieces of a position on their squares, not quite in the middle, and the others aside."""
        left = {key: list(names) for key, names in self._by_kind.items()}
        for square, piece in board.piece_map().items():
            name = left[piece.symbol().upper(), piece.color].pop(0)
            x, y, _ = self.table.centre(Place.at(square))
            radius, angle, turn = _SCATTER * np.sqrt(self._rng.random()), *self._rng.uniform(0, 2 * np.pi, 2)
            self.world.place(name, x + radius * np.cos(angle), y + radius * np.sin(angle), turn=float(turn))
        for name in (name for names in left.values() for name in names):
            self.world.remove(name)

    def shoot(self, noise: Noise = NOMINAL) -> Frame:
        """The next frame, a thirtieth of a second after the last one."""
        self._shots += 1
        self.camera.change(noise=noise)
        return self.camera.shoot(self.world, self._shots / _RATE)


def game_positions(every: int) -> Iterator[chess.Board]:
    """Each so many plies of the five famous games, as far as the set's pieces go."""
    for score in famous_games():
        board = score.start_board()
        for ply, move in enumerate(score.moves, 1):
            board.push(move)
            if ply % every == 0:
                yield board.copy(stack=False)
