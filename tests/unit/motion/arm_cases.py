"""The arm at its table, for the tests of its motion."""

import chess
import numpy as np

from kempelen.core.arm_table import arm_table
from kempelen.core.geometry import Array
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.table import start_layout
from kempelen.kinematics import load_arm
from kempelen.motion.arm.plan import ARM_CLEARANCES
from kempelen.motion.scene import Scene

ARM = load_arm("labvolt-5150")
TABLE = arm_table()
START = start_layout(TABLE, chess.Board())


def transfer(symbol: str, source: str, target: str) -> Transfer:
    return Transfer(chess.Piece.from_symbol(symbol), Place(source), Place(target))


def scene(layout: Layout = START) -> Scene:
    return Scene(TABLE, layout, ARM_CLEARANCES)


def rates(joints: Array, times: Array) -> tuple[float, float]:
    """Highest speed and acceleration as shares of the joints' limits, seen at the path's own times."""
    step = np.diff(times)[:, None]
    speed = np.diff(joints, axis=0) / step
    rate = np.diff(speed, axis=0) / step[1:]
    return float((np.abs(speed) / ARM.velocity).max()), float((np.abs(rate) / ARM.acceleration).max())
