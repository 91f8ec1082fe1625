"""How a reed board's observations are read by `kempelen.sensing.moves`."""

from kempelen.sensing.moves.parameters import MoveParameters

REED_PARAMETERS = MoveParameters(plies=1, pairs=False, misread=1e-5, turned=1e-7, glitch=1e-5)
"""A switch errs for good far more rarely than a camera, and tells nothing about several plies at once that
the order of what was lifted and set has not told already."""
