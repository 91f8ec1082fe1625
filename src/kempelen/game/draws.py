"""Draw offers (FIDE Laws of Chess 2023, article 9.1): open until the opponent answers or moves."""

import asyncio

import chess

from kempelen.core import events
from kempelen.core.errors import GameError
from kempelen.core.words import say
from kempelen.game.observers import EventBus
from kempelen.game.players import Player


class DrawOffers:
    """The offer that is open, if one is."""

    def __init__(self, bus: EventBus) -> None:
        self._bus = bus
        self._by: chess.Color | None = None
        self._question: asyncio.Task[bool] | None = None

    async def offer(self, by: chess.Color, opponent: Player, board: chess.Board) -> bool:
        """Put the offer to the opponent; whether it is agreed.

        Raises:
            GameError: An offer is open already.
        """
        if self._question is not None:
            raise GameError(
                say("draw_open", "A draw is on offer already."),
                hint=say("wait_for_it", "Wait for the answer."),
            )
        self._by, self._question = by, asyncio.ensure_future(opponent.answer_draw(board))
        self._bus.emit(events.DrawOffered(by))
        try:
            agreed = await self._answer(self._question)
        finally:
            self._by = self._question = None
        if not agreed:
            self._bus.emit(events.DrawDeclined(by))
        return agreed

    async def _answer(self, question: "asyncio.Task[bool]") -> bool:
        try:
            await asyncio.wait({question})
        finally:
            question.cancel()
        return not question.cancelled() and question.result()

    def moved(self, colour: chess.Color) -> None:
        """``colour`` has moved: an offer to it has lapsed."""
        if self._by is (not colour):
            self.close()

    def close(self) -> None:
        """Any offer has lapsed."""
        if self._question is not None:
            self._question.cancel()
