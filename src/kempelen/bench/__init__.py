"""Measurements against bounds and peers: `kempelen bench NAME`."""

BENCHES = ("eyes", "frames", "motion", "page", "setup", "spectators", "twin", "vision")
