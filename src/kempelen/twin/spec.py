"""What a twin is started with: the table, what stands on it, and how fast time runs."""

from pathlib import Path
from typing import Annotated, Literal, Self

import chess
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from kempelen.core.geometry import Transform
from kempelen.core.pieces import PieceSet
from kempelen.core.places import Layout, Place
from kempelen.core.table import Gripper, Table, Tray, WorkSpace
from kempelen.twin.cameras.settings import CameraSpec
from kempelen.twin.flaws import ArmFlaws
from kempelen.twin.look import DEFAULT_LOOK, Look
from kempelen.twin.reed.settings import ReedSpec

CONTROL_FOLDER = "kempelen-twin-"
"""Prefix of a folder for a control socket alone; the twin removes it in the end: a dead parent cannot."""


class ArmSpec(BaseModel):
    """The arm at the end of the wire.

    The base stands at the robot frame's origin. At roll 0 the fingers close along the tool frame's y axis:
    horizontally, across the arm's vertical plane.

    Attributes:
        arm: Name or path of its parameter file, see `kempelen.kinematics.load_arm`.
        controller: What it is driven by: a multi-axis G-code controller, whose axes are the motors' angles in
            degrees, or the older machine's latch-and-phase board behind its serial bridge.
        flaws: How it truly is.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    arm: Annotated[str, Field(min_length=1, max_length=500)] = "labvolt-5150"
    controller: Literal["grblhal", "latch"] = "grblhal"
    flaws: ArmFlaws = ArmFlaws()


class TwinSpec(BaseModel):
    """Everything that a twin process needs, as it crosses the process boundary (JSON).

    Attributes:
        robot_from_board: (4, 4) row-major matrix, mm.
        layout: Place name to piece symbol (``"e2": "P"``).
        speed: Time scale; 0 means as fast as the machine can.
        wire: ``"pty"`` or ``"tcp:PORT"`` on the loopback interface (port 0: any free one).
        link: Where a stable symbolic link to the pseudo-terminal is kept; empty for none.
        state: File in which the world is kept while no process runs it; empty for none.
        resume: Continue from ``state`` instead of setting the table anew.
        baud: Speed of the serial line to model, bit/s; 0 for an instantaneous one.
        cameras: Over the table; each has a process and a ring of frames.
        look: Colours, for the cameras.
        person: Whose side the virtual person sits at.
        arm: The machine, if it is an arm; None for the gantry of ``space``.
        reed: Switches under the squares; None for a board that feels nothing.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    robot_from_board: tuple[tuple[float, ...], ...]
    square: float
    trays: tuple[Tray, ...]
    pieces: PieceSet
    gripper: Gripper
    space: WorkSpace
    layout: dict[str, str]
    seed: int = 0
    scatter: Annotated[float, Field(ge=0, le=6)] = 3.0
    speed: Annotated[float, Field(ge=0, le=1000)] = 1.0
    wire: Annotated[str, Field(pattern=r"^(pty|tcp:\d{1,5})$")] = "pty"
    link: str = ""
    control: str
    state: str = ""
    resume: bool = False
    baud: Annotated[int, Field(ge=0, le=10_000_000)] = 0
    cameras: Annotated[tuple[CameraSpec, ...], Field(max_length=4)] = ()
    look: Look = DEFAULT_LOOK
    person: Literal["white", "black"] = "white"
    arm: ArmSpec | None = None
    reed: ReedSpec | None = None

    @model_validator(mode="after")
    def _own_rings(self) -> Self:
        names = [camera.ring for camera in self.cameras if camera.ring]
        if len(set(names)) != len(names):
            raise ValueError(f"two cameras write to the same ring: {', '.join(sorted(names))}")
        return self

    @classmethod
    def of(cls, table: Table, layout: Layout, *, control: Path, **options: object) -> Self:
        """The spec of a table with that layout; ``options`` are further fields."""
        return cls.model_validate(
            {
                "robot_from_board": table.robot_from_board.matrix.tolist(),
                "square": table.square,
                "trays": table.trays,
                "pieces": table.pieces,
                "gripper": table.gripper,
                "space": table.space,
                "layout": {place.name: piece.symbol() for place, piece in layout.items()},
                "control": str(control),
                **options,
            }
        )

    def table(self) -> Table:
        """The table described."""
        matrix = np.array(self.robot_from_board)
        return Table(
            robot_from_board=Transform(matrix[:3, :3], matrix[:3, 3]),
            square=self.square,
            trays=self.trays,
            pieces=self.pieces,
            gripper=self.gripper,
            space=self.space,
        )

    def standing(self) -> Layout:
        """What stands where at the start."""
        return Layout({Place(name): chess.Piece.from_symbol(symbol) for name, symbol in self.layout.items()})
