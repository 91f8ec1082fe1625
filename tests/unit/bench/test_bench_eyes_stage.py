"""The stage that `kempelen bench eyes` measures on: what a camera sees of a world of physics."""

import chess

from kempelen.bench.eyes_stage import Stage
from kempelen.sensing.board.finder import BoardFinder
from kempelen.sensing.sighting import BoardSighting


def test_the_board_is_found_on_it() -> None:
    """It is painted, although physics has no need of that."""
    with Stage(0) as stage:
        stage.show(chess.Board())
        assert isinstance(BoardFinder().find(stage.shoot(), chess.Board()), BoardSighting)
