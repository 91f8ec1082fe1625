"""Measurements against bounds and peers: `kempelen bench NAME`."""

BENCHES = ("arm", "cluster", "eyes", "frames", "motion", "page", "setup", "spectators", "twin", "vision")
