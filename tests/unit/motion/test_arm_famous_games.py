"""Every transfer of the famous games, planned and swept; a command of its own, for it takes half a minute."""

import io
import time
from collections.abc import Iterator
from importlib.resources import files
from statistics import median

import chess.pgn
import pytest
from tests.unit.motion.arm_cases import ARM, TABLE, scene

from kempelen.core.places import Layout, Transfer
from kempelen.core.table import start_layout
from kempelen.game.transfers import move_transfers
from kempelen.motion.arm.grasp import park_joints
from kempelen.motion.arm.plan import plan_arm_approach, plan_arm_carry, plan_arm_leave


def moves() -> Iterator[tuple[tuple[Transfer, ...], Layout, bool]]:
    """Transfers of each move, the layout before it, and whether a game begins."""
    text = io.StringIO((files("kempelen") / "data" / "famous.pgn").read_text(encoding="utf-8"))
    while (game := chess.pgn.read_game(text)) is not None:
        board = game.board()
        layout, begins = start_layout(TABLE, board), True
        for move in game.mainline_moves():
            transfers = move_transfers(board, move, layout, TABLE)
            assert isinstance(transfers, tuple)
            yield transfers, layout, begins
            for transfer in transfers:
                layout = layout.after(transfer)
            board.push(move)
            begins = False


@pytest.mark.soak
def test_every_transfer_of_the_famous_games_is_planned_clear_and_soon() -> None:
    waiting = park_joints(ARM, TABLE, ARM.home)
    at, planning, seconds = waiting, [], []
    for transfers, before, begins in moves():
        at, layout = waiting if begins else at, before
        for transfer in transfers:
            began = time.process_time()
            approach = plan_arm_approach(ARM, scene(layout), at, transfer)
            middle = time.process_time()
            carry = plan_arm_carry(ARM, scene(layout), transfer, approach.joints[-1])
            planning += [middle - began, time.process_time() - middle]
            seconds.append(approach.seconds + carry.seconds)
            layout, at = layout.after(transfer), carry.joints[-1]
        at = plan_arm_leave(ARM, scene(layout), at).joints[-1]
    assert len(seconds) > 400
    assert median(planning) < 0.04
    assert median(seconds) < 4.0
