"""From a reed board's messages to observations: pure, no clock but the board's own."""

from collections.abc import Callable

import chess
import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.pieces import piece_name
from kempelen.core.reed import ALL_SQUARES, NUMBERS, Change, Finding, Snapshot, squares_in
from kempelen.core.senses import EMPTY, Observation, Sight
from kempelen.sensing.reed.faults import SwitchFault, SwitchFaults, occupied
from kempelen.sensing.reed.men import STRANGER, Men

QUIET_MS = 500
"""After so long without news the hand has gone."""
HELD_MS = 8000
"""A piece that was lifted is in the hand for so long at most; then it is asked for."""
JUST_NOW_MS = 1000
"""What has moved so shortly before a position is confirmed may belong to the next move already."""
SUSPECT_MS = 2000
"""A switch that reads otherwise than a confirmed position for so long is at fault."""
_MISSED, _FEIGNED = 1e-4, 1e-5
"""Probability that a piece is not felt on its square, and that an empty square reads closed."""
_PERHAPS_STUCK = 0.13
"""The same when a piece has come from nowhere: likely enough for a question, not for an answer."""
_LEAST = 1e-5


class Reading:
    """What stands on the board as far as the switches tell.

    Args:
        board: What stands there at first.
        tell: Takes what is wrong with the switches.

    Attributes:
        faults: Of the switches.
        lost: Set when events were lost, so that the order of some changes is not known.
    """

    def __init__(
        self, board: chess.Board | None = None, tell: Callable[[SwitchFault], None] = lambda _: None
    ) -> None:
        self._board = board or chess.Board()
        self._men = Men(self._board)
        self.faults = SwitchFaults(tell)
        self.lost = 0
        self._number: int | None = None
        self._closed = self._doubtful = 0
        self._since: list[Change] = []
        self._suspects, self._suspected_at = 0, 0
        self._news, self._now = -HELD_MS, 0

    @property
    def closed(self) -> int:
        """Squares whose switch reads closed."""
        return self._closed

    @property
    def doubtful(self) -> int:
        """Those of them that may be feigned."""
        return self._doubtful

    @property
    def board(self) -> chess.Board:
        """What was confirmed last."""
        return self._board.copy()

    # --- what the game says ---

    def stands(self, board: chess.Board) -> None:
        """A position has been confirmed, seen or told."""
        if self._number is not None:
            fresh = sum({1 << each.square for each in self._since if each.time > self._now - JUST_NOW_MS})
            self._suspects = (self._closed ^ occupied(board)) & ~self._doubtful & ~fresh
            self._suspected_at = self._now
        self._begin(board)

    def expect(self, board: chess.Board) -> None:
        """A position is about to be compared with the board; nothing is known of it yet."""
        self._begin(board)

    def _begin(self, board: chess.Board) -> None:
        """Go on from a position; what has moved since, and is not part of it, is followed again."""
        self._board = board.copy()
        self._men.begin(self._board)
        after = [] if self._number is None else self._not_in(occupied(board))
        self._since = []
        for change in after:
            self._follow(change)

    def _not_in(self, standing: int) -> list[Change]:
        """The latest news of each square that does not read as the position has it, in order."""
        unlike = (standing ^ self._closed) & ~self.faults.left_out & ~self._doubtful
        known = {change.square: change for change in self._since if unlike >> change.square & 1}
        rest = unlike & ~sum(1 << square for square in known)
        placed = [Change(0, self._now, square, placed=True) for square in squares_in(rest & self._closed)]
        lifted = [Change(0, self._now, square, placed=False) for square in squares_in(rest & ~self._closed)]
        return [*lifted, *sorted(known.values(), key=lambda change: change.time), *placed]

    # --- what the board says ---

    def take(self, message: Change | Snapshot | Finding) -> None:
        """In the order of the lines."""
        if isinstance(message, Snapshot):
            self._snapshot(message)
            return
        if self._number is not None and message.number != (self._number + 1) % NUMBERS:
            self.lost += 1
        self._number = message.number
        if isinstance(message, Finding):
            self.faults.take(message)
        else:
            self._change(message)

    def _change(self, change: Change) -> None:
        if bool(self._closed >> change.square & 1) == change.placed:
            return  # the other half of this was lost; the next snapshot has put it right already
        self._closed ^= 1 << change.square
        if change.doubtful:
            self._doubtful |= 1 << change.square
        self._news = max(self._news, change.time)
        self._suspects &= ~(1 << change.square)
        self.faults.moved(change.square)
        self._follow(change)

    def _follow(self, change: Change) -> None:
        self._since.append(change)
        self._men.follow(change, self._doubtful | self.faults.left_out)

    def _snapshot(self, snapshot: Snapshot) -> None:
        first = self._number is None
        if not first and snapshot.number != self._number:
            self.lost += 1
        self._number, self._now = snapshot.number, snapshot.time
        if self._news > snapshot.time:
            self._news = snapshot.time - HELD_MS  # switched off and on again: its clock began anew
        unlike = self._closed ^ snapshot.closed
        self._doubtful = snapshot.doubtful
        if first:
            self._closed = snapshot.closed
            self._begin(self._board)
            return
        for square in [*squares_in(unlike & ~snapshot.closed), *squares_in(unlike & snapshot.closed)]:
            placed = bool(snapshot.closed >> square & 1)
            doubtful = bool(snapshot.doubtful >> square & 1)
            self._change(Change(snapshot.number, snapshot.time, square, placed, doubtful))
        self._name_suspects()

    def _name_suspects(self) -> None:
        """What has read otherwise since the position was confirmed is no hand's doing."""
        if self._suspects and self._now - max(self._news, self._suspected_at) >= SUSPECT_MS:
            self.faults.name(self._suspects & ~self._doubtful, self._board)
            self._suspects = 0
            self._begin(self._board)

    # --- what is seen ---

    def observation(self) -> Observation:
        """Of now."""
        time, quiet = self._now / 1000.0, self._now - self._news
        if self._number is None:
            return Observation.blind(time, Sight.STARTING, "The reed board has said nothing yet.")
        if quiet < QUIET_MS:
            return Observation.blind(time, Sight.HAND, "A hand is moving pieces.")
        if quiet < HELD_MS and (held := self._men.awaited):
            name = "piece" if held[0] == STRANGER else piece_name(chess.Piece.from_symbol(held[0]))
            return Observation.blind(time, Sight.HAND, f"The {name} from {held[1:]} is in the hand.")
        return Observation(self._likelihoods(), time)

    def _likelihoods(self) -> Array:
        """(64, 3) log p(reading and order | empty, white, black)."""
        colours = np.maximum(self._men.colours(), _LEAST)
        unsure = self._doubtful | self.faults.left_out
        closed, believed = _bits(self._closed), _bits(ALL_SQUARES & ~unsure)
        felt, unfelt = np.empty((64, 3)), np.empty((64, 3))
        felt[:, EMPTY] = np.where(_bits(self._perhaps_stuck()), _PERHAPS_STUCK, _FEIGNED)
        felt[:, 1:] = colours
        unfelt[:, EMPTY], unfelt[:, 1:] = 1.0, _MISSED
        out = np.where(closed[:, None], felt, unfelt)
        hidden = np.full((64, 3), 1 / 3)
        hidden[:, 1:] = 2 / 3 * colours
        told: Array = np.log(np.where(believed[:, None], out, hidden))
        return told

    def _perhaps_stuck(self) -> int:
        """Closed squares that a piece may have left all the same: one has come, and none has gone."""
        known = ~(self._doubtful | self.faults.left_out)
        before = occupied(self._board)
        come, gone = self._closed & ~before & known, before & ~self._closed & known
        return self._men.comes_from(come) if come and not gone else 0


def _bits(mask: int) -> Array:
    """(64,) booleans."""
    return np.unpackbits(np.frombuffer(mask.to_bytes(8, "little"), np.uint8), bitorder="little").astype(bool)
