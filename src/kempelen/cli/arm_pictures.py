"""The pictures of `kempelen arm`: workspace, paths, placement of a board."""

from collections.abc import Sequence
from math import degrees

import numpy as np

from kempelen.cli.svg_sheet import INKS, Panel, shade, sheet
from kempelen.core.geometry import Array
from kempelen.kinematics import Arm
from kempelen.kinematics.workspace import Placement, Workspace

_TURNS = 96
_VIEW = np.radians(25.0)  # from above, for the drawing in space


def workspace_picture(arm: Arm, space: Workspace, most: float) -> str:
    """Beside each other: the upright plane with the least tilts, and the surface in space."""
    step = float(space.radial[1] - space.radial[0])
    rings = space.rings(most)
    out, low, high = float(rings[:, 2].max()) + 20, float(rings[0, 0]) - 20, float(rings[-1, 0]) + 20
    plane = Panel("the arm's upright plane", (0, out), (low, high), "from the base's axis, mm", "up, mm", 340)
    for row, up in enumerate(space.up):
        for column, radial in enumerate(space.radial):
            tilt = space.tilt[row, column]
            if np.isfinite(tilt):
                corner = np.array([radial, up])
                plane.cell(corner - step / 2, corner + step / 2, shade(abs(tilt) / most))
    plane.line([[0.0, 0.0], [out, 0.0]], "#555", dash="4 3")
    drop = out * float(np.sin(_VIEW))
    surface = Panel(
        "the surface, seen from in front", (-out, out), (low - drop, high + drop), "mm", "mm", 560
    )
    low_turn, high_turn = arm.ranges[0]
    turns = np.linspace(low_turn, high_turn, _TURNS)
    for number, (up, inner, reach) in enumerate(rings):
        if number % 3 == 0:
            surface.line(_seen(turns, reach, up), INKS[2], width=0.9)
            surface.line(_seen(turns, inner, up), INKS[1], width=0.6)
    for turn in turns[::8]:
        surface.line(np.array([_seen(turn, reach, up) for up, _, reach in rings]), INKS[2], width=0.5)
    surface.dot((0.0, 0.0), "#000", "base")
    legend = [("straight down", shade(0)), (f"tilt of {degrees(most):.0f}°", shade(1))]
    legend += [("outer surface", INKS[2]), ("inner surface", INKS[1])]
    return sheet(f"Workspace of the {arm.title}", [plane, surface], legend)


def _seen(turn: Array | float, radius: float, up: float) -> Array:
    """(..., 2) on the paper: x to the right, seen from in front and above."""
    across, away = -radius * np.sin(turn), radius * np.cos(turn)
    return np.stack([across, up * np.cos(_VIEW) - away * np.sin(_VIEW)], axis=-1)


def paths_picture(arm: Arm, tests: Sequence[tuple[str, Array, Array, Array]]) -> str:
    """Tests from above and aside, each a name, wanted ends (2, 3), joint-synchronous and guided points."""
    panels = []
    for name, ends, together, guided in tests:
        every = np.concatenate([ends, together, guided])
        for what, axes, across, upwards in (
            ("from above", [1, 0], "y, mm", "x, mm"),
            ("from the side", [1, 2], "y, mm", "z, mm"),
        ):
            low, high = every[:, axes].min(axis=0) - 15, every[:, axes].max(axis=0) + 15
            ends_x, ends_y = (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))
            panel = Panel(f"{name}, {what}", ends_x, ends_y, across, upwards, 300, 300)
            panel.line(ends[:, axes], "#888", dash="5 4", width=1.2)
            panel.line(together[:, axes], INKS[1])
            panel.line(guided[:, axes], INKS[0])
            for end in ends:
                panel.dot(end[axes], "#333", f"({end[0]:g}, {end[1]:g}, {end[2]:g})")
            panels.append(panel)
    legend = [("straight line", "#888"), ("joints together", INKS[1]), ("guided", INKS[0])]
    return sheet(f"Test paths of the {arm.title}", panels, legend)


def place_picture(arm: Arm, best: Placement, most: float) -> str:
    """From above: the base, the board with the tilt of each square."""
    side, square = 8 * best.square, best.square
    far = best.distance - square / 2 + side
    wide = max(side / 2, 80.0) + 30
    panel = Panel("from above", (-wide, wide), (-60.0, far + 30), "across, mm", "away, mm", 420)
    for rank in range(8):
        for file in range(8):
            away = best.distance + rank * square
            across = -(file - 3.5) * square
            tilt = float(best.tilts[rank, file])
            told = f"{degrees(tilt):.0f}" if np.isfinite(tilt) else "x"
            corner = np.array([across, away])
            panel.cell(corner - square / 2 + 0.5, corner + square / 2 - 0.5, shade(abs(tilt) / most), told)
    panel.dot((0.0, 0.0), "#000", "base axis")
    where = f"nearest {best.distance:.0f} mm before the axis"
    title = f"{arm.title}: squares of {square:g} mm, {where}; tilt in degrees"
    return sheet(title, [panel], [("straight down", shade(0)), (f"{degrees(most):.0f}°", shade(1))])
