"""Where is the piece? What the journal and the robot say together after any exit.

The journal tells the last phase of the transfer at hand. A controller that kept running also remembers its
gripper, and finished by itself what it had been sent: it may be one group of motions ahead of the journal.
One that was reset has let its gripper close, which is its state without current, wherever the hand was.

==========  ==================  ====================  ==========================
phase       kept, gripper open  kept, gripper closed  reset, or gripper unknown
==========  ==================  ====================  ==========================
none, clear nothing in the hand (the gripper is opened after homing)
standing    on its source       on its source         on its source
gripping    on its source       held (1)              ask (2)
carrying    on its target (3)   held                  held (4)
released    on its target       ask (5)               ask (2)
==========  ==================  ====================  ==========================

1. The gripper is open when GRIPPING is written, and is closed at the grip only; but when this program cut the
   motion off, and its way of stopping may have reset outputs: ask.
2. The gripper closed by itself, at the piece or away from it.
3. It is opened over the target only.
4. It is opened only after CARRYING and the hand stays there until RELEASED is written, so that a gripper that
   opened and fell shut has caught the piece again.
5. Nothing that this program does leads here.
"""

from enum import Enum

from kempelen.core.protocols import GripperState, RobotState
from kempelen.game.records import Phase
from kempelen.game.state import Pending


class Whereabouts(Enum):
    """Where the piece of the transfer at hand is."""

    SOURCE = "on its source"
    HELD = "in the gripper"
    TARGET = "on its target"
    UNKNOWN = "only a person can see it"


def whereabouts(pending: Pending, robot: RobotState) -> Whereabouts:
    """The table above.

    Args:
        pending: The move in hand.
        robot: After connecting, before any motion.
    """
    gripper = robot.gripper if robot.memory_kept else GripperState.UNKNOWN
    match pending.phase, gripper:
        case ((None | Phase.STANDING | Phase.CLEAR), _):
            return Whereabouts.SOURCE
        case Phase.GRIPPING, GripperState.OPEN:
            return Whereabouts.SOURCE
        case Phase.GRIPPING, GripperState.CLOSED if not pending.interrupted:
            return Whereabouts.HELD
        case ((Phase.CARRYING | Phase.RELEASED), GripperState.OPEN):
            return Whereabouts.TARGET
        case Phase.CARRYING, _:
            return Whereabouts.HELD
        case _:
            return Whereabouts.UNKNOWN
