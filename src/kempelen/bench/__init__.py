"""Measurements against bounds and peers: `kempelen bench NAME`."""

BENCHES = (
    "arm",
    "cluster",
    "eyes",
    "frames",
    "kinematics",
    "motion",
    "nodes",
    "page",
    "reed",
    "setup",
    "spectators",
    "tracking",
    "twin",
    "vision",
)
