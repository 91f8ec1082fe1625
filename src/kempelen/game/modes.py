"""Modes: who plays whom. Each is a pairing of players; the arbiter treats all alike."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Self

import chess

from kempelen.core.errors import ConfigError, GameError
from kempelen.core.words import say
from kempelen.game.pgn import GameScore
from kempelen.game.players import Player, ReplayPlayer
from kempelen.game.records import PairingSpec, TakeOverSpec


class Mode(StrEnum):
    """The pairings that can be asked for."""

    PLAY = "play"  # a person against an engine
    WATCH = "watch"  # engine against engine
    REPLAY = "replay"  # a recorded game


@dataclass(frozen=True)
class Pairing:
    """A mode with its players; the same player may have both sides."""

    mode: Mode
    white: Player
    black: Player

    @classmethod
    def play(cls, person: Player, engine: Player, *, person_plays: chess.Color = chess.WHITE) -> Self:
        """A person against an engine."""
        return cls(Mode.PLAY, person, engine) if person_plays else cls(Mode.PLAY, engine, person)

    @classmethod
    def watch(cls, white: Player, black: Player) -> Self:
        """Engine against engine."""
        return cls(Mode.WATCH, white, black)

    @classmethod
    def replay(cls, score: GameScore) -> Self:
        """A recorded game, under the names of those who played it."""
        white, black = (
            ReplayPlayer(score, name=score.headers.get(side) or side) for side in ("White", "Black")
        )
        return cls(Mode.REPLAY, white, black)

    def __getitem__(self, colour: chess.Color) -> Player:
        return self.white if colour else self.black

    @property
    def spec(self) -> PairingSpec:
        """For the journal."""
        return PairingSpec(mode=self.mode.value, white=self.white.spec, black=self.black.spec)

    @property
    def claims_draws(self) -> bool:
        """Whether threefold repetition and fifty moves are claimed; a replay follows its score instead."""
        return self.mode is not Mode.REPLAY

    @property
    def people(self) -> tuple[chess.Color, ...]:
        """The sides that persons play."""
        return tuple(colour for colour in chess.COLORS if self[colour].spec.kind == "person")


def speaker(people: Sequence[chess.Color], turn: chess.Color) -> chess.Color:
    """The side that the person at hand speaks for: its own, or in a game of two persons the one to move.

    Raises:
        GameError: no side is a person's.
    """
    if not people:
        raise GameError(
            say("neither_side", "You play neither side."),
            hint=say("take_a_side", "Take the side to move with: mode play"),
        )
    return people[0] if len(people) == 1 else turn


@dataclass(frozen=True)
class TakeOver:
    """Another pairing that takes over when the position's ply (`chess.Board.ply`) is reached."""

    ply: int
    pairing: Pairing

    @classmethod
    def at_move(cls, number: int, pairing: Pairing, *, colour: chess.Color = chess.WHITE) -> Self:
        """Take over before ``colour``'s move ``number`` (from 1, as on the score sheet).

        Raises:
            ConfigError: The number is below 1.
        """
        if number < 1:
            raise ConfigError(f"Move {number} does not exist.", hint="Moves are counted from 1.")
        return cls(2 * (number - 1) + (colour == chess.BLACK), pairing)

    @property
    def spec(self) -> TakeOverSpec:
        """For the journal."""
        return TakeOverSpec(ply=self.ply, pairing=self.pairing.spec)


PLAYER_KINDS: Mapping[str, str] = {
    "person": "a person at the terminal or on a page",
    "engine": "a program that thinks",
    "replay": "the moves of a recorded game",
}
