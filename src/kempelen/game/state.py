"""The state of a game as its records give it.

The arbiter and the recovery after an exit use the same function, `GameState.after`, for every record: what
the program believes and what the journal says cannot differ.
"""

from dataclasses import dataclass, replace
from functools import singledispatch
from typing import Self

import chess

from kempelen.core.errors import JournalError, KempelenError
from kempelen.core.places import Layout, Transfer
from kempelen.core.protocols import Checkpoint
from kempelen.game.records import (
    Begun,
    Clocked,
    Committed,
    Ended,
    HandEmpty,
    Helped,
    Intended,
    Interrupted,
    LayoutChanged,
    Missed,
    ModeSwapped,
    OperatorNeeded,
    PairingSpec,
    Paused,
    Purpose,
    Record,
    Reopened,
    Resumed,
    Step,
    TableChanged,
    TakebackAsked,
    TakeOverSpec,
)


@dataclass(frozen=True, slots=True)
class Pending:
    """A move, or its taking back, that is being made on the table.

    Attributes:
        index: Of the transfer at hand; ``len(transfers)`` when all pieces stand on their targets.
        checkpoint: How far that transfer has come: None, GRIPPING or CARRYING.
        interrupted: Motion was cut off since the last step, so that the gripper's state proves less.
    """

    intent: Intended
    index: int = 0
    checkpoint: Checkpoint | None = None
    interrupted: bool = False

    @property
    def transfers(self) -> tuple[Transfer, ...]:
        """All transfers of the move."""
        return self.intent.transfers

    @property
    def at_hand(self) -> Transfer | None:
        """The transfer that is being made; None when all are done."""
        return self.transfers[self.index] if self.index < len(self.transfers) else None

    @property
    def done(self) -> tuple[Transfer, ...]:
        """Those whose piece stands on its target."""
        return self.transfers[: self.index]

    @property
    def carrying(self) -> bool:
        """Whether the piece of the transfer at hand is in the gripper."""
        return self.checkpoint is Checkpoint.CARRYING


@dataclass(frozen=True)
class GameState:
    """Everything about one game.

    Attributes:
        board: The committed moves; not to be changed.
        settled: What stands where, without the move in hand.
        pending: The move in hand.
        needed: What the operator was asked for and has not done.
        decided: A move or takeback that was decided on and waits for the operator.
        around: The last transfer, while the open gripper may still be around its piece.
        back_to: Half-moves are being taken back until so many are left.
        back_by_hand: Whether a person has done that on the board already.
        table: Digest of the table in use.
        touched: Whether any piece was ever meant to be moved.
        helps: Times that a person had to help the robot.
        clock: White's and Black's time left, s, as far as it is known; None without a clock.
    """

    begun: Begun
    board: chess.Board
    settled: Layout
    pairing: PairingSpec
    names: tuple[tuple[str, ...], tuple[str, ...]]
    take_over: TakeOverSpec | None = None
    pending: Pending | None = None
    needed: OperatorNeeded | None = None
    decided: OperatorNeeded | None = None
    around: Transfer | None = None
    back_to: int | None = None
    back_by_hand: bool = False
    paused: bool = False
    table: str = ""
    ended: Ended | None = None
    touched: bool = False
    helps: int = 0
    clock: tuple[float, float] | None = None

    @classmethod
    def begin(cls, begun: Begun) -> Self:
        """The state before the first move.

        Raises:
            JournalError: The position cannot be read.
        """
        try:
            board = chess.Board(begun.start_fen, chess960=begun.chess960)
        except ValueError as error:
            raise JournalError(f"The game begins from an unreadable position: {error}.") from error
        return cls(
            begun=begun,
            board=board,
            settled=begun.layout,
            pairing=begun.pairing,
            names=((begun.pairing.white.name,), (begun.pairing.black.name,)),
            take_over=begun.take_over,
            table=begun.table,
            clock=(begun.clock.seconds, begun.clock.seconds) if begun.clock else None,
        )

    @property
    def plies(self) -> int:
        """Half-moves committed."""
        return len(self.board.move_stack)

    @property
    def set_up(self) -> bool:
        """Whether the board is as the position says, the move in hand aside."""
        return self.settled.board_part() == self.board.piece_map()

    @property
    def layout(self) -> Layout:
        """What stands where now; a piece in the gripper counts where it came from."""
        layout = self.settled
        for transfer in self.pending.done if self.pending else ():
            layout = layout.after(transfer)
        return layout

    def after(self, record: Record) -> "GameState":
        """The state with one more record.

        Raises:
            JournalError: The record cannot follow.
        """
        if self.ended is not None:
            raise JournalError(f"A record of kind '{record.kind}' follows the end of the game.")
        try:
            return _apply(record, self)
        except JournalError:
            raise
        except (KempelenError, ValueError, IndexError) as error:
            raise JournalError(
                f"A record of kind '{record.kind}' does not fit the game so far: {error}"
            ) from error


def _in_hand(state: GameState) -> Pending:
    if state.pending is None:
        raise JournalError("A record speaks of a move in hand where there is none.")
    return state.pending


@singledispatch
def _apply(record: Record, state: GameState) -> GameState:
    raise JournalError(f"A record of kind '{record.kind}' follows ply {state.plies} of a game.")


@_apply.register
def _(_record: Reopened, state: GameState) -> GameState:
    return replace(state, paused=False)


@_apply.register
def _(record: OperatorNeeded, state: GameState) -> GameState:
    return replace(state, needed=record, decided=record)


@_apply.register
def _(record: LayoutChanged, state: GameState) -> GameState:
    layout = state.settled.without(record.place)
    if record.piece is not None:
        layout = layout.having(record.place, record.piece)
    return replace(state, settled=layout, needed=None)


@_apply.register
def _(record: Intended, state: GameState) -> GameState:
    if state.pending is not None:
        raise JournalError("A move is intended while another one is in hand.")
    return replace(state, pending=Pending(record), decided=None, needed=None, touched=True)


@_apply.register
def _(record: Step, state: GameState) -> GameState:
    pending = _in_hand(state)
    if record.index != pending.index or pending.at_hand is None:
        raise JournalError(f"A step names transfer {record.index}, at hand is {pending.index}.")
    if record.checkpoint is Checkpoint.RELEASED:
        return replace(state, pending=Pending(pending.intent, record.index + 1), around=pending.at_hand)
    here = Pending(pending.intent, record.index, record.checkpoint)
    return replace(state, pending=here, around=None if here.carrying else state.around)


@_apply.register
def _(record: Missed, state: GameState) -> GameState:
    """That transfer comes next; those made after it stay made."""
    pending = _in_hand(state)
    if record.index >= pending.index or pending.checkpoint is not None:
        raise JournalError(f"Transfer {record.index} was not done, so that it cannot have been missed.")
    again = pending.transfers[record.index]
    done = tuple(transfer for transfer in pending.done if transfer is not again)
    transfers = (*done, again, *pending.transfers[pending.index :])
    intent = pending.intent.model_copy(update={"transfers": transfers})
    return replace(state, pending=Pending(intent, len(done)))


@_apply.register
def _(_record: HandEmpty, state: GameState) -> GameState:
    pending = state.pending
    return replace(
        state, pending=pending and replace(pending, checkpoint=None, interrupted=False), around=None
    )


@_apply.register
def _(_record: Interrupted, state: GameState) -> GameState:
    return replace(state, pending=replace(_in_hand(state), interrupted=True))


@_apply.register
def _(_record: Helped, state: GameState) -> GameState:
    return replace(state, helps=state.helps + 1)


@_apply.register
def _(record: Committed, state: GameState) -> GameState:
    layout = state.settled
    for transfer in _in_hand(state).transfers:
        layout = layout.after(transfer)
    board = state.board.copy()
    if record.purpose is Purpose.MOVE:
        board.push(board.parse_uci(record.uci))
    elif record.purpose is Purpose.TAKEBACK:
        board.pop()
    still_back = state.back_to is not None and len(board.move_stack) > state.back_to
    return replace(
        state, board=board, settled=layout, pending=None, back_to=state.back_to if still_back else None
    )


@_apply.register
def _(record: TakebackAsked, state: GameState) -> GameState:
    return replace(state, back_to=record.plies, back_by_hand=record.by_hand)


@_apply.register(Paused)
@_apply.register(Resumed)
def _(record: Paused | Resumed, state: GameState) -> GameState:
    return replace(state, paused=isinstance(record, Paused))


@_apply.register
def _(record: Clocked, state: GameState) -> GameState:
    return replace(state, clock=(record.white, record.black))


@_apply.register
def _(record: ModeSwapped, state: GameState) -> GameState:
    specs = (record.pairing.white, record.pairing.black)
    white, black = (
        names if spec.name == names[-1] else (*names, spec.name)
        for names, spec in zip(state.names, specs, strict=True)
    )
    return replace(state, pairing=record.pairing, take_over=record.take_over, names=(white, black))


@_apply.register
def _(record: TableChanged, state: GameState) -> GameState:
    return replace(state, table=record.table)


@_apply.register
def _(record: Ended, state: GameState) -> GameState:
    return replace(state, ended=record)
