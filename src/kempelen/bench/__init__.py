"""Measurements against bounds and peers: `kempelen bench NAME`."""

BENCHES = ("frames", "motion", "twin", "vision")
