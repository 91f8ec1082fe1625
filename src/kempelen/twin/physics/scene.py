"""What is to be simulated: the table and the pieces that stand on it at the start."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import chess
import numpy as np

from kempelen.core.errors import FitError
from kempelen.core.geometry import Transform
from kempelen.core.pieces import PieceShape
from kempelen.core.places import Layout
from kempelen.core.table import Table
from kempelen.kinematics import Arm
from kempelen.twin.look import DEFAULT_LOOK, Look

TRAY_THICKNESS = 10.0
KINDS_BY_LETTER = {chess.piece_symbol(kind).upper(): kind for kind in chess.PIECE_TYPES}


@dataclass(frozen=True, slots=True)
class StandingPiece:
    """A piece and where it stands at the start.

    Attributes:
        piece_id: Unique in its scene, letters and digits: ``"wP3"``.
        kind: One of ``K Q R B N P``, whatever the colour.
        white: Its colour.
        x: Of the base's centre, robot frame, mm.
        y: Of the base's centre, robot frame, mm.
        z: Of the surface under it, robot frame, mm.
        turn: About its own axis, rad.
    """

    piece_id: str
    kind: str
    white: bool
    x: float
    y: float
    z: float = 0.0
    turn: float = 0.0


@dataclass(frozen=True, eq=False)
class StandingArm:
    """An arm and where it stands.

    Attributes:
        arm: As it truly is.
        robot_from_base: True pose of its base.
    """

    arm: Arm
    robot_from_base: Transform = field(default_factory=Transform.identity)


@dataclass(frozen=True)
class Scene:
    """Everything the simulation is built from.

    Attributes:
        table: Board pose, squares, trays, piece set, gripper and work space.
        pieces: All free bodies.
        board_thickness: The board's playing surface above the table top, mm.
        look: Colours, for cameras.
        person: Whose side the virtual person sits at: ``"white"`` or ``"black"``.
        arm: The robot, if it is an arm; None for the gantry of the table's work space.
    """

    table: Table
    pieces: tuple[StandingPiece, ...]
    board_thickness: float = 20.0
    look: Look = DEFAULT_LOOK
    person: str = "white"
    arm: StandingArm | None = None

    def __post_init__(self) -> None:
        twice = [name for name, n in Counter(p.piece_id for p in self.pieces).items() if n > 1]
        if twice:
            raise FitError(f"Two pieces are called {', '.join(twice)}.", hint="Give each its own piece_id.")
        for piece in self.pieces:
            if piece.kind not in KINDS_BY_LETTER:
                raise FitError(
                    f"Piece {piece.piece_id} is of kind '{piece.kind}'.",
                    hint=f"Kinds are {' '.join(KINDS_BY_LETTER)}.",
                )
            if not all(map(math.isfinite, (piece.x, piece.y, piece.z, piece.turn))):
                raise FitError(
                    f"Piece {piece.piece_id} stands at a position that is not finite.",
                    hint="Check the scene.",
                )

    @classmethod
    def from_layout(cls, table: Table, layout: Layout, *, seed: int = 0, scatter: float = 3.0) -> Self:
        """Pieces on their places, up to ``scatter`` mm off centre and turned at random.

        Args:
            table: Where the places are.
            layout: What stands on them.
            seed: Of the offsets (uniform over the disc) and turns.
            scatter: Greatest distance from the place's centre, mm.
        """
        rng = np.random.default_rng(seed)
        count: Counter[str] = Counter()
        pieces = []
        for place, piece in sorted(layout.items()):
            name = f"{'w' if piece.color else 'b'}{piece.symbol().upper()}"
            count[name] += 1
            radius, angle, turn = scatter * math.sqrt(rng.random()), *rng.uniform(0, math.tau, 2)
            x, y, level = table.centre(place)
            x, y = float(x + radius * math.cos(angle)), float(y + radius * math.sin(angle))
            z = _surface(table, x, y, otherwise=float(level))
            pieces.append(
                StandingPiece(f"{name}{count[name]}", name[1], name[0] == "w", x, y, z, float(turn))
            )
        return cls(table, tuple(pieces))

    def shape(self, piece: StandingPiece) -> PieceShape:
        """Its measures."""
        return self.table.pieces[KINDS_BY_LETTER[piece.kind]]

    def surface(self, x: float, y: float) -> float:
        """Height of what lies under a point: tray, board or table top, robot frame, mm."""
        return _surface(self.table, x, y, otherwise=self.table_top)

    @property
    def depth(self) -> float:
        """From the playing surface down to the table top at a1's corner, mm."""
        return max([self.board_thickness, *(TRAY_THICKNESS - tray.height for tray in self.table.trays)])

    @property
    def table_top(self) -> float:
        """Height of the table top, robot frame, mm."""
        return float((self.table.robot_from_board @ np.array([0.0, 0.0, -self.depth]))[2])

    def with_pieces(self, more: Sequence[StandingPiece]) -> "Scene":
        """The scene with further pieces, say some in a drawer far aside."""
        return replace(self, pieces=(*self.pieces, *more))


def _surface(table: Table, x: float, y: float, *, otherwise: float) -> float:
    for surface in reversed(table.surfaces):
        along, across = surface.local(x, y)
        if 0 <= along <= surface.size[0] and 0 <= across <= surface.size[1]:
            return surface.height(x, y)
    return otherwise
