"""What journal and robot say together of the hand after an exit: the table of `kempelen.game.recovery`."""

from dataclasses import replace

import chess
import pytest

from kempelen.core.places import Place, Transfer
from kempelen.core.protocols import Checkpoint, GripperState, RobotState
from kempelen.core.table import Table, start_layout
from kempelen.game.records import (
    Begun,
    HandEmpty,
    Intended,
    Interrupted,
    PairingSpec,
    PlayerSpec,
    Purpose,
    Record,
    Step,
)
from kempelen.game.recovery import AT_GRIP, Held, held
from kempelen.game.state import GameState

TABLE = Table()
E4 = Transfer(chess.Piece(chess.PAWN, chess.WHITE), Place("e2"), Place("e4"))
GRIP = TABLE.grip_point(E4.source, chess.PAWN)
CLOSED = RobotState(
    homed=True,
    gripper=GripperState.CLOSED,
    memory_kept=True,
    reported_position=(float(GRIP[0]), float(GRIP[1]), float(GRIP[2])),
)
OPEN = replace(CLOSED, gripper=GripperState.OPEN)
AWAY = replace(CLOSED, reported_position=(float(GRIP[0]), float(GRIP[1]), float(GRIP[2]) + AT_GRIP + 0.1))
RESET = replace(CLOSED, memory_kept=False)
GRIPPING, CARRYING, RELEASED = (
    Step(index=0, checkpoint=one) for one in (Checkpoint.GRIPPING, Checkpoint.CARRYING, Checkpoint.RELEASED)
)


def after(*records: Record) -> GameState:
    pairing = PairingSpec(
        mode="watch", white=PlayerSpec(kind="engine", name="A"), black=PlayerSpec(kind="engine", name="B")
    )
    state = GameState.begin(Begun(headers={}, pairing=pairing, layout=start_layout(TABLE, chess.Board())))
    for record in (Intended(purpose=Purpose.MOVE, ply=1, uci="e2e4", transfers=(E4,)), *records):
        state = state.after(record)
    return state


@pytest.mark.parametrize(
    ("records", "robot", "found"),
    [
        ((), CLOSED, Held.NOTHING),
        ((GRIPPING,), OPEN, Held.NOTHING),
        ((GRIPPING,), CLOSED, Held.PIECE),
        ((GRIPPING,), AWAY, Held.PIECE),  # as far as the journal knows it was not cut off
        ((GRIPPING,), RESET, Held.UNKNOWN),
        ((GRIPPING, Interrupted()), OPEN, Held.NOTHING),
        ((GRIPPING, Interrupted()), CLOSED, Held.PIECE),
        ((GRIPPING, Interrupted()), AWAY, Held.UNKNOWN),
        ((GRIPPING, Interrupted()), replace(CLOSED, homed=False), Held.UNKNOWN),
        ((GRIPPING, Interrupted()), replace(CLOSED, reported_position=None), Held.UNKNOWN),
        ((GRIPPING, Interrupted()), RESET, Held.UNKNOWN),
        ((GRIPPING, CARRYING), CLOSED, Held.PIECE),
        ((GRIPPING, CARRYING), RESET, Held.PIECE),
        ((GRIPPING, CARRYING), OPEN, Held.ARRIVED),
        ((GRIPPING, CARRYING, RELEASED), CLOSED, Held.UNKNOWN),
        ((GRIPPING, CARRYING, RELEASED), OPEN, Held.NOTHING),
        ((GRIPPING, CARRYING, RELEASED, HandEmpty()), CLOSED, Held.NOTHING),
    ],
)
def test_what_is_in_the_hand(records: tuple[Record, ...], robot: RobotState, found: Held) -> None:
    assert held(after(*records), robot, TABLE) is found
