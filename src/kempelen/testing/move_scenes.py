"""A board, a made-up sensor and a move reader, for tests that read like what happens at the table."""

from collections.abc import Iterable, Mapping

import chess

from kempelen.core.senses import Observation, Sight
from kempelen.sensing.moves.parameters import MoveParameters
from kempelen.sensing.moves.reader import MoveReader
from kempelen.sensing.moves.verdicts import Moved, TakenBack, Unchanged, Verdict
from kempelen.testing.observations import Sensor, with_changes


class Scene:
    """What happens at one table.

    Args:
        position: FEN, or moves in SAN from the initial position.
        sensor: Default: a good one.
        parameters: Of the reader.
        seconds: The standing position is watched that long at first.
    """

    def __init__(
        self,
        position: str = "",
        sensor: Sensor | None = None,
        parameters: MoveParameters | None = None,
        *,
        seconds: float = 1.0,
    ) -> None:
        self.board = board_of(position)
        self.sensor = sensor or Sensor()
        self.reader = MoveReader(self.board, parameters)
        self.verdicts: list[Verdict] = []
        if seconds:
            self.stands(seconds=seconds)

    def feed(self, observations: Iterable[Observation]) -> Verdict:
        """Observations one after the other; the last verdict."""
        self.verdicts += [self.reader.update(o) for o in observations]
        return self.verdicts[-1]

    def hand(self, seconds: float = 0.3) -> "Scene":
        """A hand comes and goes."""
        self.feed(self.sensor.hand(seconds))
        return self

    def blind(self, sight: Sight, seconds: float = 0.3) -> Verdict:
        """Nothing can be seen for a while."""
        return self.feed(self.sensor.blind(sight, seconds))

    def stands(self, changes: Mapping[str, str] | None = None, seconds: float = 0.8) -> Verdict:
        """The confirmed position is seen, with some squares otherwise."""
        return self.feed(self.sensor.watch(with_changes(self.board, changes or {}), seconds))

    def shows(self, position: chess.Board, seconds: float = 0.8) -> Verdict:
        """A position is seen."""
        return self.feed(self.sensor.watch(position, seconds))

    def after(self, *sans: str, seconds: float = 0.8) -> Verdict:
        """The confirmed position is seen after some moves."""
        board = self.board.copy()
        for san in sans:
            board.push_san(san)
        return self.shows(board, seconds)

    def confirm(self, *sans: str) -> "Scene":
        """These moves were played: that is the confirmed position now."""
        for san in sans:
            self.board.push_san(san)
        self.reader.confirm(self.board)
        return self

    @property
    def accepted(self) -> list[Moved | TakenBack]:
        """Every verdict that claims a change of the game."""
        return [v for v in self.verdicts if isinstance(v, Moved | TakenBack)]

    @property
    def quiet(self) -> bool:
        """Whether no verdict but "unchanged" was given since the first."""
        return all(isinstance(v, Unchanged) for v in self.verdicts)


def board_of(position: str) -> chess.Board:
    """A board of a FEN, or of SAN moves from the initial position."""
    if "/" in position:
        return chess.Board(position)
    board = chess.Board()
    for san in position.split():
        board.push_san(san)
    return board
