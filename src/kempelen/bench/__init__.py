"""Measurements against bounds and peers: `kempelen bench NAME`."""

BENCHES = ("eyes", "frames", "motion", "page", "spectators", "twin", "vision")
