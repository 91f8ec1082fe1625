"""Where is the piece? What the journal and the robot say together after any exit.

The journal tells the last phase of the transfer at hand. A controller that kept running also remembers its
gripper, and finished by itself what it had been sent: it may be one group of motions ahead of the journal.
One that was reset has let its gripper close, which is its state without current, wherever the hand was.

==========  ==================  ====================  =================
checkpoint  kept, gripper open  kept, gripper closed  reset, or unknown
==========  ==================  ====================  =================
none (1)    empty               ask (2)               ask (2)
gripping    empty               held (3)              ask (4)
carrying    arrived (5)         held                  held (6)
==========  ==================  ====================  =================

1. After a transfer the hand stays around the piece until its next motion; once it was parked or prepared, it
   is certainly empty, and nothing is asked.
2. It may have closed around the piece of the last transfer.
3. It is opened before GRIPPING is written, and closed at the grip only; but when this program cut the motion
   off, or lost the robot, its way of stopping may have reset outputs: ask, unless the hand is at the grip.
4. It closed by itself: at the piece, at that of the last transfer, or between.
5. It is opened over the target only.
6. It is opened only after CARRYING and the hand stays there until RELEASED is written, so that a gripper that
   opened and fell shut has caught the piece again.
"""

import math
from enum import Enum

from kempelen.core.protocols import Checkpoint, GripperState, RobotState
from kempelen.core.table import Table
from kempelen.game.state import GameState, Pending


class Held(Enum):
    """What is in the hand."""

    NOTHING = "nothing: the piece of the transfer at hand stands on its source"
    PIECE = "the piece of the transfer at hand"
    ARRIVED = "nothing: the piece of the transfer at hand stands on its target"
    UNKNOWN = "only a person can see it"


AT_GRIP = 3.0
"""A closed gripper so near to where it takes the piece is around it, mm."""


def held(state: GameState, robot: RobotState, table: Table) -> Held:
    """The table above.

    Args:
        state: From the journal.
        robot: After connecting, before any motion.
        table: Says where pieces are gripped.
    """
    pending = state.pending
    checkpoint = pending.checkpoint if pending else None
    gripper = robot.gripper if robot.memory_kept else GripperState.UNKNOWN
    if checkpoint is Checkpoint.CARRYING:
        return Held.ARRIVED if gripper is GripperState.OPEN else Held.PIECE
    if gripper is GripperState.OPEN or (checkpoint is None and state.around is None):
        return Held.NOTHING
    closed_here = gripper is GripperState.CLOSED and checkpoint is Checkpoint.GRIPPING
    if closed_here and pending and (not pending.interrupted or _at_grip(pending, robot, table)):
        return Held.PIECE
    return Held.UNKNOWN


def _at_grip(pending: Pending, robot: RobotState, table: Table) -> bool:
    transfer, position = pending.at_hand, robot.reported_position
    if transfer is None or position is None or not robot.homed:
        return False
    grip = table.grip_point(transfer.source, transfer.piece.piece_type)
    return math.dist(position, grip.tolist()) <= AT_GRIP
