"""The world at the end of the wire: table, pieces, gantry, gripper and a person's hand, in MuJoCo."""

from kempelen.twin.physics.scene import Scene, StandingPiece
from kempelen.twin.physics.truth import PieceTruth
from kempelen.twin.physics.world import World

__all__ = ["PieceTruth", "Scene", "StandingPiece", "World"]
