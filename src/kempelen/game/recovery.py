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
   off, and its way of stopping may have reset outputs: ask.
4. It closed by itself: at the piece, at that of the last transfer, or between.
5. It is opened over the target only.
6. It is opened only after CARRYING and the hand stays there until RELEASED is written, so that a gripper that
   opened and fell shut has caught the piece again.
"""

from enum import Enum

from kempelen.core.protocols import Checkpoint, GripperState, RobotState
from kempelen.game.state import GameState


class Held(Enum):
    """What is in the hand."""

    NOTHING = "nothing: the piece of the transfer at hand stands on its source"
    PIECE = "the piece of the transfer at hand"
    ARRIVED = "nothing: the piece of the transfer at hand stands on its target"
    UNKNOWN = "only a person can see it"


def held(state: GameState, robot: RobotState) -> Held:
    """The table above.

    Args:
        state: From the journal.
        robot: After connecting, before any motion.
    """
    pending = state.pending
    checkpoint = pending.checkpoint if pending else None
    gripper = robot.gripper if robot.memory_kept else GripperState.UNKNOWN
    if checkpoint is Checkpoint.CARRYING:
        return Held.ARRIVED if gripper is GripperState.OPEN else Held.PIECE
    if gripper is GripperState.OPEN or (checkpoint is None and state.around is None):
        return Held.NOTHING
    closed_here = gripper is GripperState.CLOSED and checkpoint is Checkpoint.GRIPPING
    return Held.PIECE if closed_here and pending and not pending.interrupted else Held.UNKNOWN
