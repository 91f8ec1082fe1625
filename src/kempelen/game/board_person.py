"""A person who moves the pieces: on the board by hand, or by writing a move, whichever comes first."""

import asyncio
from typing import Any, Protocol

import chess

from kempelen.core.protocols import OnThinking
from kempelen.game.players import PersonPlayer, Proposal, Propose, TakenBack

_KIND_WORDS = {
    **{chess.piece_name(kind): kind for kind in chess.PIECE_TYPES},
    **{chess.piece_symbol(kind): kind for kind in chess.PIECE_TYPES},
}


class BoardReader(Protocol):
    """Reads moves off the board.

    Attributes:
        on: Whether anything is being read; else moves are written only.
        candidates: Moves that may have been made, while a question is open.
        stuck: Set while a question or advice is open: from here on only a person can help. Set again by each
            look that finds it open still.
    """

    on: bool
    candidates: tuple[chess.Move, ...]
    stuck: asyncio.Event

    async def read(self, board: chess.Board) -> Propose | TakenBack:
        """Wait until the person has made a move on the board, or taken some back; may be cancelled."""
        ...


class Maker(Protocol):
    """Somebody who makes written moves on the board by hand."""

    async def __call__(self, board: chess.Board, move: chess.Move) -> None:
        """Make it; what is already done is left as it is."""
        ...


class BoardPerson(PersonPlayer):
    """A person at a board that is watched.

    Written moves are carried by the arbiter, unless there is a ``maker``: then they are made by hand, and it
    is up to the reader to see it. A written move that answers the reader's question is not carried again.

    Args:
        reader: Reads moves off the board.
        name: Shown.
        maker: Makes written moves by hand.

    Attributes:
        maker: As given; may be found only when the table is up.
        answered: How often the person had to tell what was made.
    """

    def __init__(self, reader: BoardReader, name: str = "Person", maker: Maker | None = None) -> None:
        super().__init__(name)
        self._reader = reader
        self.maker = maker
        self.answered = 0

    def submit(self, text: str) -> chess.Move:
        """Take a move, or the answer to the reader's question: "e4", "knight", or the move itself.

        Raises:
            NotationError: as `PersonPlayer.submit`.
        """
        return super().submit(self._as_answer(text))

    def _as_answer(self, text: str) -> str:
        """The one candidate that a short answer names, in UCI; the text itself where it names none."""
        word = text.strip().lower().removeprefix("a ")
        kind = _KIND_WORDS.get(word)
        named = [
            move
            for move in self._reader.candidates
            if word == chess.square_name(move.to_square) or (kind is not None and move.promotion == kind)
        ]
        return named[0].uci() if len(named) == 1 else text

    async def propose(self, board: chess.Board, on_thinking: OnThinking) -> Proposal:
        """What is seen or written first."""
        reading = asyncio.ensure_future(self._reader.read(board.copy()))
        try:
            return await self._seen_or_written(board, on_thinking, reading)
        finally:
            reading.cancel()
            await asyncio.gather(reading, return_exceptions=True)

    async def _seen_or_written(
        self, board: chess.Board, on_thinking: OnThinking, reading: "asyncio.Future[Propose | TakenBack]"
    ) -> Proposal:
        while not reading.done():
            move = await self._written(board, on_thinking, reading)
            if move is None:
                break
            if self._settles(move):
                return self._told(move)
            if self.maker is None or not self._reader.on:
                return Propose(move)
            await self.maker(board, move)
            if self._reader.on and not self._settles(move):
                self._reader.stuck.clear()  # what was open before the whole move is there, was of half of it
            await self._read_or_stuck(reading)
            if not reading.done() and (self._settles(move) or not self._reader.on):
                return self._told(move)
        return reading.result()

    async def _written(
        self, board: chess.Board, on_thinking: OnThinking, reading: "asyncio.Future[Propose | TakenBack]"
    ) -> chess.Move | None:
        """The next written move; None when one is seen first."""
        writing = asyncio.ensure_future(super().propose(board, on_thinking))
        try:
            await _first(reading, writing)
            proposal = writing.result() if writing.done() else None
            return proposal.move if isinstance(proposal, Propose) else None
        finally:
            writing.cancel()
            await asyncio.gather(writing, return_exceptions=True)

    async def _read_or_stuck(self, reading: "asyncio.Future[Propose | TakenBack]") -> None:
        stuck = asyncio.ensure_future(self._reader.stuck.wait())
        try:
            await _first(reading, stuck)
        finally:
            stuck.cancel()

    def _settles(self, move: chess.Move) -> bool:
        return move in self._reader.candidates

    def _told(self, move: chess.Move) -> Propose:
        self.answered += 1
        return Propose(move, made=True)


async def _first(*futures: "asyncio.Future[Any]") -> None:
    """Until one of them is done."""
    await asyncio.wait(futures, return_when=asyncio.FIRST_COMPLETED)
