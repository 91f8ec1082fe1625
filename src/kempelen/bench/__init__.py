"""Measurements against bounds and peers: `kempelen bench NAME`."""

BENCHES = ("motion", "twin", "vision")
