"""Arms that the package has no file for: fewer joints, odd twists, tools off the roll axis, six joints."""

import numpy as np

from kempelen.kinematics import Arm, Drift, Link

QUARTER = np.pi / 2


def bare(
    name: str, links: list[Link], ranges_deg: list[tuple[float, float]], tool: Link | None = None
) -> Arm:
    n = len(links)
    ones = np.ones(n)
    return Arm(
        name=name,
        joint_names=tuple(f"joint {k + 1}" for k in range(n)),
        links=tuple(links),
        ranges=np.radians(ranges_deg),
        velocity=ones,
        acceleration=ones,
        jerk=ones,
        coupling=np.eye(n),
        steps_per_rad=ones * 1000,
        home=np.radians(ranges_deg).mean(axis=1),
        drift=Drift.none(n),
        tool=tool,
    )


THREE = bare(
    "three",
    [Link(10, QUARTER, 100), Link(150, 0, 0), Link(170, 0, 0, -0.4)],
    [(-170, 170), (-30, 140), (-150, 40)],
)
FOUR = bare(
    "four",
    [Link(0, QUARTER, 120), Link(150, 0, 0), Link(130, 0, 0), Link(20, QUARTER, 0)],
    [(-170, 170), (-30, 140), (-150, 150), (-120, 120)],
    tool=Link(0, 0, 60, 0.2),
)
TWISTED = bare(
    "twisted",
    [
        Link(20, -QUARTER, 130, 0.3),
        Link(180, 0, 12, -1.2),
        Link(140, 0, -30, 0.9),
        Link(15, -QUARTER, 6, -1.4),
        Link(9, 0, 110, 0.7),
    ],
    [(-170, 170), (-110, 110), (-120, 120), (-100, 100), (-400, 400)],
)
"""All that the family allows: a negative twist, unequal links, a lateral shift, a tool off the roll axis."""

SIX = bare(
    "six",
    [
        Link(0, QUARTER, 290),
        Link(270, 0, 0, QUARTER),
        Link(70, QUARTER, 0),
        Link(0, -QUARTER, 302),
        Link(0, QUARTER, 0),
        Link(0, 0, 72),
    ],
    [(-165, 165), (-110, 110), (-110, 70), (-160, 160), (-120, 120), (-180, 180)],
)
SCARA = bare(
    "scara", [Link(150, 0, 100), Link(150, 0, 0), Link(0, np.pi, 50)], [(-150, 150), (-150, 150), (-180, 180)]
)
