"""The table of a small arm: the Lab-Volt 5150 at a board of 35 mm squares, as far as no file says otherwise.

The arm stands opposite White, beyond the eighth rank, whose near edge is 105 mm from the axis of its base;
the base turns far enough for trays on both sides, beside the board and beside itself. The playing surface is
66 mm above the table that the arm stands on, z = 0 of the robot's frame. Straight down the arm reaches every
place but the far corners, which it grips with the gripper tilted by about 6°.
"""

from math import pi

from kempelen.core.geometry import Transform
from kempelen.core.pieces import PRESETS
from kempelen.core.table import Gripper, Table, Tray, WorkSpace

ARM_SQUARE = 35.0
"""Side of a square, mm."""
ARM_PIECES = "small"
"""Preset of the pieces."""
ARM_BOARD = (385.0, -140.0, 66.0)
"""Where a1's outer corner is, robot frame, mm."""
ARM_TURN_DEGREES = 90.0
"""Turn of the board: the first rank runs across the arm, at the far end."""
ARM_TRAYS = (
    Tray(name="left", origin=(-57.5, 87.5), rows=8, columns=2, pitch=35.0),
    Tray(name="right", origin=(302.5, 87.5), rows=8, columns=2, pitch=35.0),
)
ARM_GRIPPER = Gripper(
    tangential=True,
    plumb=True,
    opening=23.9,
    finger_thickness=5.8,
    finger_width=10.0,
    below_tool=5.0,
    finger_length=60.0,
    palm_radius=22.0,
)
"""Fingers that pass between neighbours on 35 mm squares at any turn of the base."""
ARM_SPACE = WorkSpace(
    lower=(-600.0, -600.0, 60.0),
    upper=(600.0, 600.0, 420.0),
    velocity=(200.0, 200.0, 200.0),
    acceleration=(800.0, 800.0, 800.0),
)
"""A box around whatever the arm reaches; what it reaches within depends on its joints."""


def arm_table() -> Table:
    """Board, trays, pieces and gripper of a small arm."""
    return Table(
        robot_from_board=Transform.about_z(ARM_TURN_DEGREES * pi / 180, ARM_BOARD),
        square=ARM_SQUARE,
        trays=ARM_TRAYS,
        pieces=PRESETS[ARM_PIECES],
        gripper=ARM_GRIPPER,
        space=ARM_SPACE,
    )
