"""What `kempelen arm` does."""

from itertools import pairwise
from math import degrees, radians
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from kempelen.cli.arm_pictures import paths_picture, place_picture, workspace_picture
from kempelen.cli.showing import require_writable
from kempelen.core.geometry import Array
from kempelen.kinematics import Arm, forward, inverse, load_arm, manipulability, singularities
from kempelen.kinematics.workspace import best_placement, largest_square, workspace
from kempelen.motion.arm.guidance import bow_of, pose_of, straight

PATHS = (
    ("test 1", (190.0, 0.0, 331.0), (217.0, 120.0, 185.0)),
    ("test 2", (121.0, 120.0, 185.0), (346.0, -120.0, 185.0)),
)
"""The paper's motion tests, mm, gripper straight down, roll 0."""

_GRIP = 15.0  # mm: lowest that the tool point goes above the board, for a pawn of a small set
_TILTS = (0.0, 15.0, 30.0, 45.0)
_LOOKS = 64


def show_arm(name: str) -> None:
    """Print the numbers of an arm."""
    arm = load_arm(name)
    console = Console()
    console.print(f"[bold]{arm.title or arm.name}[/bold] ({arm.name}), {arm.n} joints", highlight=False)
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in (
        "joint",
        "a mm",
        "alpha °",
        "d mm",
        "offset °",
        "range °",
        "°/s",
        "°/s²",
        "steps/°",
        "home °",
    ):
        table.add_column(heading, justify="left" if heading == "joint" else "right")
    for k, link in enumerate(arm.links):
        low, high = np.degrees(arm.ranges[k])
        numbers = (link.a, degrees(link.alpha), link.d, degrees(link.offset))
        speed, push = np.degrees([arm.velocity[k], arm.acceleration[k]])
        steps, home = radians(arm.steps_per_rad[k]), degrees(arm.home[k])
        table.add_row(
            arm.joint_names[k],
            *(f"{number:.6g}" for number in numbers),
            f"{low:.6g} to {high:.6g}",
            *(f"{number:.4g}" for number in (speed, push, steps, home)),
        )
    console.print(table)
    x, y, z = forward(arm, arm.home)[:3, 3].round(1) + 0.0  # no minus before 0
    console.print(
        f"At home the tool point is at ({x:.1f}, {y:.1f}, {z:.1f}) mm; manipulability "
        f"{float(manipulability(arm, arm.home)):.3g} mm³.",
        highlight=False,
    )
    for one in singularities(arm, arm.home):
        console.print(f"At home singular ({one.name}): {one.told}.", highlight=False)
    console.print("[bold]Where the numbers come from[/bold]")
    for group, source in arm.sources.items():
        console.print(f"  {group}: {source}", highlight=False, markup=False)


def show_workspace(name: str, picture: Path | None, most_deg: float) -> None:
    """Print how far the tool reaches at some heights, and draw it."""
    arm, most = _begun(name, picture), max(radians(most_deg), 1e-3)
    space = workspace(arm, 10.0, most)
    table = Table("height mm", "from mm", "to mm", "straight down to mm", box=None, pad_edge=False)
    down = {up: reach for up, _, reach in space.rings(radians(0.01))}
    for up, inner, reach in space.rings(most)[::5]:
        alone = down.get(up)
        table.add_row(
            f"{up:.0f}", f"{inner:.0f}", f"{reach:.0f}", f"{alone:.0f}" if alone is not None else "-"
        )
    console = Console()
    console.print(
        f"{arm.title}: reach of the tool point with a tilt up to {most_deg:g}°, to 10 mm", highlight=False
    )
    console.print(table)
    _keep(console, picture, workspace_picture(arm, space, most) if picture else "")


def show_paths(name: str, picture: Path | None) -> None:
    """Print how far the two test paths leave the straight line, and draw them."""
    arm = _begun(name, picture)
    console, drawn = Console(), []
    table = Table("path", "motion", "steps", "off the line mm", box=None, pad_edge=False)
    for title, start, end in PATHS:
        ends = np.array([start, end])
        first = inverse(arm, start).joints
        together = np.stack([first, inverse(arm, end, near=first).joints])
        guided = straight(arm, pose_of(arm, together[0]), pose_of(arm, together[1]), title)
        for motion, knots in (("joints together", together), ("guided", guided)):
            table.add_row(title, motion, str(len(knots) - 1), f"{bow_of(arm, knots, *ends):.2f}")
        drawn.append((title, ends, _driven(arm, together), _driven(arm, guided)))
    console.print(f"{arm.title}: the two motion tests, gripper straight down, roll 0", highlight=False)
    console.print(table)
    _keep(console, picture, paths_picture(arm, drawn) if picture else "")


def show_place(
    name: str, picture: Path | None, *, square: float, surface: float, lift: float, most: float
) -> None:
    """Print the best place for a board, which squares need tilt, and the largest boards."""
    arm, greatest = _begun(name, picture), radians(most)
    heights = (_GRIP, lift)
    best = best_placement(arm, square, [surface], heights, greatest)
    console = Console()
    console.print(
        f"{arm.title}, squares of {square:g} mm, board {surface:g} mm above the arm's foot, pieces lifted by "
        f"{lift:g} mm: best with the middle of the nearest squares {best.distance:.0f} mm before the base's "
        "axis.",
        highlight=False,
    )
    if best.tilted:
        console.print(
            f"{best.tilted} of 64 squares need tilt, {degrees(best.worst):.1f}° at most:", highlight=False
        )
        for rank in reversed(range(8)):
            console.print(
                "  " + " ".join(f"{degrees(tilt):4.0f}" for tilt in best.tilts[rank]), highlight=False
            )
    else:
        console.print("No square needs tilt.", highlight=False)
    table = Table("tilt up to °", "largest square mm", box=None, pad_edge=False)
    for tilt in (one for one in _TILTS if one <= most):
        table.add_row(f"{tilt:g}", f"{largest_square(arm, [surface], heights, radians(tilt)):.1f}")
    console.print(table)
    _keep(console, picture, place_picture(arm, best, max(greatest, 1e-3)) if picture else "")


def _begun(name: str, picture: Path | None) -> Arm:
    if picture is not None:
        require_writable(picture)
    return load_arm(name)


def _driven(arm: Arm, knots: Array) -> Array:
    """(k, 3) tool points between knots: all joints in proportion."""
    share = np.linspace(0.0, 1.0, _LOOKS)[:, None]
    parts = [forward(arm, a + share * (b - a))[:, :3, 3] for a, b in pairwise(knots)]
    return np.concatenate(parts)


def _keep(console: Console, picture: Path | None, drawing: str) -> None:
    if picture is not None:
        picture.write_text(drawing, encoding="utf-8")
        console.print(f"Written: {picture}", highlight=False, markup=False, soft_wrap=True)
