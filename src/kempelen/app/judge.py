"""Is what the robot or a person has done as it should be? The comparing itself is `sensing.moves`'s."""

from collections.abc import Iterable, Sequence

import chess

from kempelen.core.geometry import Array
from kempelen.core.pieces import PieceSet
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.senses import EMPTY, Observation
from kempelen.core.words import joined, say
from kempelen.game.verify import Fault
from kempelen.sensing.moves.check import Agrees, CannotTell, CheckParameters, Disagrees, PositionCheck
from kempelen.sensing.moves.hypotheses import colour_state
from kempelen.sensing.moves.stance import StanceParameters
from kempelen.sensing.moves.verdicts import Difference

FAULT_FRAMES = 4
"""Consecutive looks that must find the same kind of fault: a hand may just be leaving."""
DOUBT_FRAMES, DOUBT_S = 15, 3.0
"""What cannot be made out for so long, a person is asked about."""


class BoardJudge:
    """Weighs observations for `kempelen.game.verify.SensorVerifier`.

    Args:
        transfers: Just made.
        standing: What should stand where.
        pieces: Their sizes.
        centred: How far from the centre of its square a piece may stand, mm.
        look: (64, 3) how each square looked before; None when nobody knows.
    """

    def __init__(
        self,
        transfers: Sequence[Transfer],
        standing: Layout,
        pieces: PieceSet,
        centred: float,
        look: Array | None = None,
    ) -> None:
        stance = StanceParameters(centred=centred)
        parameters = CheckParameters(stance=stance)
        self._check = PositionCheck(
            standing.board_part(), transfers, pieces=pieces, look=look, parameters=parameters
        )
        self._transfers = tuple(transfers)
        self._faults = self._doubts = 0
        self._since = 0.0

    def update(self, seen: Observation) -> bool | Fault:
        """With one more observation: True when all is right, False when that cannot be told yet."""
        verdict = self._check.update(seen)
        if isinstance(verdict, Agrees):
            return True
        if not seen.valid:
            self._faults = self._doubts = 0
            return False
        if isinstance(verdict, Disagrees):
            return self._fault(verdict)
        return self._doubt(verdict, seen.time)

    def _fault(self, verdict: Disagrees) -> bool | Fault:
        self._faults += 1
        if self._faults < FAULT_FRAMES:
            return False
        piece, place = absent(verdict.differences)
        missed = missed_of(self._transfers, verdict.differences)
        return Fault(verdict.sentence, missed, piece=piece, place=place)

    def _doubt(self, verdict: CannotTell, time: float) -> bool | Fault:
        if not self._doubts:
            self._since = time
        self._faults, self._doubts = 0, self._doubts + 1
        if self._doubts < DOUBT_FRAMES or time - self._since < DOUBT_S:
            return False
        return Fault(
            joined(verdict.reason, say("look_at_it", "Look at it, and put it right if need be.")),
            doubtful=True,
        )


def absent(found: Iterable[Difference]) -> tuple[chess.Piece, Place] | tuple[None, None]:
    """The first piece that is not where it belongs, and its place; nothing when there are only too many."""
    for difference in found:
        if difference.expected is not None:
            return difference.expected, Place(chess.square_name(difference.square))
    return None, None


def missed_of(transfers: Iterable[Transfer], found: Sequence[Difference]) -> tuple[Transfer, ...]:
    """Transfers whose piece was seen where it came from, when that explains everything that is wrong."""
    wrong = {difference.square: difference.seen for difference in found}
    missed = [transfer for transfer in transfers if _stays(transfer, wrong)]
    explained = {place.square for transfer in missed for place in (transfer.source, transfer.target)}
    return tuple(missed) if missed and wrong.keys() <= explained else ()


def _stays(transfer: Transfer, wrong: dict[int, int]) -> bool:
    source, target = transfer.source.square, transfer.target.square
    if source is None or wrong.get(source) != colour_state(transfer.piece.color):
        return False
    return target is None or wrong.get(target) == EMPTY
