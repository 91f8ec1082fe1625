"""Who plays: engines started when needed, people, replays; and the same cast again from the journal."""

from collections.abc import Callable
from contextlib import AsyncExitStack
from dataclasses import dataclass

import chess
from pydantic import JsonValue

from kempelen.app.config import Config
from kempelen.app.minds import engine_of
from kempelen.core.errors import ConfigError
from kempelen.core.places import Layout
from kempelen.core.protocols import Engine
from kempelen.core.words import say
from kempelen.game.clock import TimeControl
from kempelen.game.modes import Mode, Pairing, TakeOver
from kempelen.game.pgn import GameScore
from kempelen.game.players import EnginePlayer, PersonPlayer, Player, ReplayPlayer
from kempelen.game.records import PairingSpec, PlayerSpec, TakeOverSpec


@dataclass(frozen=True)
class GameRequest:
    """What the user asked for.

    Attributes:
        score: The game to replay; needed by mode ``replay``.
        person_plays: The person's colour in mode ``play``, and after a take-over.
        take_over_move: Number of the move at which the person takes the replayed game over; None: never.
        opponent: Engine of the second side in mode ``watch``; empty for the same.
        clock: Time control; None: the game is played without a clock.
        standing: Where the pieces stand, if not where the game begins: the robot sets that up first.
    """

    mode: Mode
    start_fen: str = chess.STARTING_FEN
    score: GameScore | None = None
    person_plays: chess.Color = chess.WHITE
    take_over_move: int | None = None
    opponent: str = ""
    opponent_level: str = ""
    clock: TimeControl | None = None
    standing: Layout | None = None


@dataclass(frozen=True)
class EngineWish:
    """What the engines of a game that goes on shall be from now on; None: as they were."""

    path: str | None = None
    level: str | None = None
    move_time: float | None = None


def score_of(spec: PlayerSpec) -> GameScore | None:
    """The score that a player replays; None for other players."""
    return ReplayPlayer.from_spec(spec).score if spec.kind == "replay" else None


class Cast:
    """Makes players; the engines live as long as ``stack``.

    Args:
        config: For the engine and its time.
        stack: Ends what is started here.
        wish: For the engines of a game of the journal.
        person: Who plays; None for one who types moves and nothing else.

    Attributes:
        person: The one who types moves.
        time_left: Tells a side's time on the clock, s; None without a clock.
    """

    def __init__(
        self,
        config: Config,
        stack: AsyncExitStack,
        wish: EngineWish | None = None,
        person: PersonPlayer | None = None,
    ) -> None:
        self._wish = wish or EngineWish()
        self._config = config
        self._stack = stack
        self._usual = (config.engine.path, config.engine.level, config.engine.move_time)
        self._engines: dict[tuple[str, str, float], Engine] = {}
        self.person = person or PersonPlayer("Person")
        self.time_left: Callable[[chess.Color], float | None] = lambda _: None

    async def engine(
        self, path: str | None = None, level: str | None = None, seconds: float | None = None
    ) -> EnginePlayer:
        """An engine's player; None means as configured, or as in the game that goes on.

        Raises:
            EngineError: no such engine, or it does not start.
            ConfigError: the level is out of range.
        """
        usual = self._usual
        key = (
            usual[0] if path is None else path,
            level or usual[1],
            usual[2] if seconds is None else seconds,
        )
        if key not in self._engines:
            self._engines[key] = await self._stack.enter_async_context(
                engine_of(self._config, *key, self._left)
            )
        details: dict[str, JsonValue] = {"engine": key[0], "level": key[1], "move_time": key[2]}
        return EnginePlayer(self._engines[key], seconds=key[2], details=details, time_left=self._left)

    def _left(self, colour: chess.Color) -> float | None:
        return self.time_left(colour)

    async def pairing(self, request: GameRequest) -> Pairing:
        """The players of a mode.

        Raises:
            ConfigError: a replay without a game.
        """
        match request.mode:
            case Mode.PLAY:
                return Pairing.play(self.person, await self.engine(), person_plays=request.person_plays)
            case Mode.WATCH:
                white = await self.engine()
                black = await self.engine(request.opponent or None, request.opponent_level or None)
                return Pairing.watch(white, black)
            case _ if request.score is not None:
                return Pairing.replay(request.score)
        raise ConfigError(
            say("no_pgn", "A replay needs a game."), hint="Name a PGN file: kempelen replay FILE.pgn"
        )

    async def take_over(self, request: GameRequest) -> TakeOver | None:
        """The pairing that takes a replay over, if it was asked for."""
        if request.take_over_move is None:
            return None
        pairing = Pairing.play(self.person, await self.engine(), person_plays=request.person_plays)
        return TakeOver.at_move(request.take_over_move, pairing, colour=request.person_plays)

    async def again(self, spec: PairingSpec) -> Pairing:
        """The players that the journal names.

        Raises:
            EngineError: its engine is not there any more.
        """
        return Pairing(Mode(spec.mode), await self._player(spec.white), await self._player(spec.black))

    async def take_over_again(self, spec: TakeOverSpec | None) -> TakeOver | None:
        """A take-over that the journal still has before it."""
        return TakeOver(spec.ply, await self.again(spec.pairing)) if spec else None

    async def _player(self, spec: PlayerSpec) -> Player:
        match spec.kind:
            case "person":
                return self.person
            case "replay":
                return ReplayPlayer.from_spec(spec)
            case _:
                return await self._engine_again(spec)

    async def _engine_again(self, spec: PlayerSpec) -> Player:
        was, wish = spec.details, self._wish
        self._usual = (
            str(was["engine"]) if wish.path is None else wish.path,
            wish.level or str(was["level"]),
            float(str(was["move_time"])) if wish.move_time is None else wish.move_time,
        )
        return await self.engine()
