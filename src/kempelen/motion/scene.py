"""What the hand must not touch: the standing pieces and the surfaces they stand on."""

from dataclasses import dataclass, field
from math import hypot
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from kempelen.core.geometry import Array
from kempelen.core.pieces import piece_name
from kempelen.core.places import Layout, Place
from kempelen.core.surfaces import Point
from kempelen.core.table import Table


class Clearances(BaseModel):
    """How far to stay away, mm.

    Attributes:
        vertical: Over standing pieces.
        lateral: Beside standing pieces.
        near: Under a carried piece's base, and over the head of the piece that is about to be gripped.
        align: How exactly the hand is above its piece or place when it goes down around or onto it.
        off_centre: How far from the centre of its place a piece may stand.
        servo_lag: How far the machine may be from where the controller has it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    vertical: Annotated[float, Field(ge=1, le=50)] = 10.0
    lateral: Annotated[float, Field(ge=0.5, le=20)] = 3.0
    near: Annotated[float, Field(ge=1, le=20)] = 3.0
    align: Annotated[float, Field(ge=0.05, le=1)] = 0.1
    off_centre: Annotated[float, Field(ge=0, le=10)] = 3.0
    servo_lag: Annotated[float, Field(ge=0, le=3)] = 0.3


@dataclass(frozen=True, eq=False)
class Scene:
    """The table with its standing pieces, as arrays.

    Each piece is two upright cylinders that contain it wherever it may stand: its base from the surface
    to the grip height, its head from there to the top. The first n rows of the cylinders' arrays are
    bases, the next n heads, in the order of ``places``.

    Attributes:
        standing: What stands where; without a piece that is being carried.
        places: n places with a piece.
        axis: (n, 2) x, y of each piece's place, where the tool comes down, robot frame, mm.
        centre: (2n, 2) x, y of each cylinder, robot frame, mm.
        radius: (2n,) of each cylinder, mm; off-centre and lean included.
        bottom: (2n,) z of its lower end, robot frame, mm.
        top: (2n,) z of its upper end, robot frame, mm.
    """

    table: Table
    standing: Layout
    clearances: Clearances = field(default_factory=Clearances)
    places: tuple[Place, ...] = field(init=False)
    axis: Array = field(init=False)
    centre: Array = field(init=False)
    radius: Array = field(init=False)
    bottom: Array = field(init=False)
    top: Array = field(init=False)

    def __post_init__(self) -> None:
        table, slack = self.table, self.clearances.off_centre
        up = [float(v) for v in table.upwards]
        lean = hypot(up[0], up[1])
        shapes = {kind: table.pieces[kind] for kind in {piece.piece_type for piece in self.standing.values()}}
        rows = []
        for place, piece in self.standing.items():
            shape = shapes[piece.piece_type]
            grip, height = shape.grip_height, shape.height
            x, y, z = table.centre(place).tolist()
            waist = z + up[2] * grip
            rows.append((
                x, y,
                x + 0.5 * up[0] * grip, y + 0.5 * up[1] * grip,
                x + 0.5 * up[0] * (grip + height), y + 0.5 * up[1] * (grip + height),
                0.5 * shape.base_diameter + slack + 0.5 * lean * grip,
                0.5 * max(shape.head_diameter, shape.grip_diameter) + slack + 0.5 * lean * (height - grip),
                z, waist, waist, z + up[2] * height,
            ))  # fmt: skip
        data = np.array(rows, dtype=np.float64).reshape(len(rows), 12)
        stacked = {
            "axis": data[:, 0:2],
            "centre": np.concatenate((data[:, 2:4], data[:, 4:6])),
            "radius": data[:, 6:8].T.ravel(),
            "bottom": data[:, 8:10].T.ravel(),
            "top": data[:, 10:12].T.ravel(),
        }
        object.__setattr__(self, "places", tuple(self.standing))
        for name, value in stacked.items():
            object.__setattr__(self, name, value)

    def name(self, index: int) -> str:
        """``"the black pawn on f2"``: of piece ``index`` or of either of its cylinders."""
        place = self.places[index % len(self.places)]
        return f"the {piece_name(self.standing[place])} on {place}"

    def without(self, place: Place) -> "Scene":
        """The scene with that place empty."""
        return Scene(self.table, self.standing.without(place), self.clearances)

    def gripped_at(self, point: Point) -> int | None:
        """Index of the piece around which the open fingers are when the tool point is at ``point``."""
        if not self.places:
            return None
        away = np.abs(self.axis - point[:2]).max(axis=1)
        index = int(away.argmin())
        tips = point[2] - self.table.gripper.below_tool
        around = away[index] <= self.clearances.align and tips < self.top[len(self.places) + index]
        return index if around else None
