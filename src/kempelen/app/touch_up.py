"""A camera touch-up: pieces seen where an arm has set them down mend the account of its drift."""

from typing import TYPE_CHECKING

import numpy as np

from kempelen.app.careful_hand import CarefulHand
from kempelen.app.table_session import TableSession
from kempelen.core.events import Event, MoveCommitted
from kempelen.core.geometry import Array
from kempelen.core.places import Place
from kempelen.core.senses import Observation
from kempelen.core.table import Table

if TYPE_CHECKING:
    from kempelen.app.eyes import GameEyes


class TouchUp:
    """Looks on after each move; without an arm whose drift is kept account of it does nothing.

    Args:
        session: The table.
        eyes: That look at it.
    """

    def __init__(self, session: TableSession, eyes: "GameEyes") -> None:
        self._session = session
        self._eyes = eyes

    def hear(self, event: Event) -> None:
        """Take what the arbiter tells."""
        careful = self._session.careful
        if isinstance(event, MoveCommitted) and careful is not None:
            touch_up(careful, self._eyes.latest, self._session.table)


def touch_up(hand: CarefulHand, seen: Observation | None, table: Table) -> None:
    """Take in what was seen of the pieces that were set down since the last look.

    Args:
        hand: That has set them down.
        seen: The board after a move; nothing is learned without, or from one that does not measure places.
        table: Where the places are.
    """
    if seen is None or not seen.valid or seen.offsets is None:
        return
    offsets, rotation = seen.offsets, table.robot_from_board.rotation

    def off(place: Place) -> Array | None:
        if place.square is None or not np.isfinite(offsets[place.square]).all():
            return None
        x, y, _ = (rotation @ np.array([*offsets[place.square], 0.0])).tolist()
        return np.array([x, y, np.nan])

    hand.seen(off)
