"""Games of a scripted person against the engine, every move physical, every move read by the camera.

The whole program plays: the person's moves are made by the twin's virtual hand and known by seeing them
alone; the engine's are made by the robot, and count once they are seen. The script knows what it made, which
is the truth that the named moves are compared with. Of a promotion whose squares were named, the new piece's
kind may be asked of the person, as designed: it counts as named, and such questions are counted apart.
"""

import asyncio
import random
import tempfile
from collections.abc import Coroutine, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import chess

from kempelen.app.cast import GameRequest
from kempelen.app.config import load_config
from kempelen.app.live_game import LiveGame
from kempelen.app.people import VirtualPerson
from kempelen.bench.result import Progress
from kempelen.bench.section import Section, counted
from kempelen.bench.special_games import special_game
from kempelen.bench.twin import nobody
from kempelen.core import events
from kempelen.core.errors import KempelenError
from kempelen.core.places import Place, Transfer
from kempelen.game.modes import Mode
from kempelen.game.players import PersonPlayer

GAMES = 50
MOVES = 30
"""Of the person, in each game at most."""
_MISSED_S = 60.0
"""Wall time after which a move that was made counts as never named."""
_BEFORE = 3
"""Every third game begins so many half-moves before something rare."""
_HESITATES, _WANDERS, _SLIDES = 0.2, 0.15, 0.3


@dataclass
class Tally:
    """Of one game, or of all.

    Attributes:
        made: Moves that the person made.
        named: Of these, named rightly with nobody's help, but perhaps for a promoted piece's kind.
        kinds: Times that the kind of a promoted piece was asked.
        told: Of those made, named after any other question.
        wrong: Of these, taken for another move.
        checked: Moves of the robot that counted.
        helps: Requests to put something right.
        differs: Where table and journal differ at the end.
    """

    made: int = 0
    named: int = 0
    kinds: int = 0
    told: int = 0
    wrong: int = 0
    checked: int = 0
    helps: int = 0
    differs: int = 0
    special: dict[str, int] = field(default_factory=dict)

    def add(self, other: "Tally") -> None:
        """Take in another game."""
        for name in ("made", "named", "kinds", "told", "wrong", "checked", "helps", "differs"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        for kind, count in other.special.items():
            self.special[kind] = self.special.get(kind, 0) + count


def played_games(seed: int, games: int, progress: Progress) -> Section:
    """Play so many games.

    Args:
        seed: Of moves, manners, tables and noise.
        games: How many.
        progress: Told before each.
    """
    total, rows = Tally(), []
    for number in range(games):
        progress(f"game {number + 1} of {games}, {total.named} of {total.made} named", number / games)
        game = asyncio.run(_game(seed + number, number))
        total.add(game)
        rows.append(_row(f"game {seed + number}", game))
    rows.append(_row("all", total))
    return Section(_figures(total), rows)


def _figures(total: Tally) -> dict[str, float]:
    return {
        "twin_moves": total.made,
        "twin_moves_named": total.named,
        "twin_kinds_asked": total.kinds,
        "twin_moves_told": total.told,
        "twin_wrong_accepts": total.wrong,
        "twin_robot_moves": total.checked,
        "twin_requests": total.helps,
        "twin_disagreements": total.differs,
        **{f"twin_{kind}": count for kind, count in sorted(total.special.items())},
    }


def _row(name: str, tally: Tally) -> dict[str, Any]:
    return {
        "data": "twin",
        "games": name,
        **counted(tally.named, tally.made),
        "kinds": tally.kinds,
        "told": tally.told,
        "wrong": tally.wrong,
        "robot_moves": tally.checked,
        "requests": tally.helps,
        "differs": tally.differs,
    }


async def _game(seed: int, number: int) -> Tally:
    with tempfile.TemporaryDirectory(prefix="kempelen-bench-") as folder:
        config = load_config(
            None,
            {
                "data.dir": folder, "robot.port": "twin", "twin.speed": "max", "twin.seed": seed,
                "twin.camera.seed": seed, "sensor.kind": "camera", "play.hands": "person",
                "engine.level": "1", "engine.move_time": 0.05,
            },
        )  # fmt: skip
        colour = bool(number % 2 == 0)
        fen = rare_position(seed, colour) if number % _BEFORE == _BEFORE - 1 else chess.STARTING_FEN
        async with LiveGame(config, GameRequest(Mode.PLAY, fen, person_plays=colour), nobody) as live:
            return await ScriptedGame(live, random.Random(seed), colour).play()  # noqa: S311 - a script


def rare_position(seed: int, colour: chess.Color) -> str:
    """A position of a seeded game shortly before ``colour`` castles, captures in passing or promotes."""
    score = special_game(seed)
    board = score.start_board()
    found = board.fen()
    for move in score.moves:
        rare = board.is_castling(move) or board.is_en_passant(move) or move.promotion is not None
        if rare and board.turn == colour:
            found = board.fen()
            if move.promotion is not None:
                break
        board.push(move)
    return found


class ScriptedGame:
    """A person who moves at random, but like a person: captures, castles, promotes, hesitates.

    Args:
        live: The game, entered.
        rng: Of moves and manners.
        colour: That the person plays.
    """

    def __init__(self, live: LiveGame, rng: random.Random, colour: chess.Color) -> None:
        self._live = live
        self._rng = rng
        self._colour = colour
        self._committed = asyncio.Event()
        self._named = ""
        self._asked: list[tuple[str, ...]] = []
        self.tally = Tally()

    async def play(self) -> Tally:
        """To its end, or until the person has made `MOVES` moves, or was misunderstood."""
        live = self._live
        if isinstance(live.person, VirtualPerson):
            live.person.manner = self._manner
        live.arbiter.events.listen(self._hear)
        playing = asyncio.create_task(live.play())
        try:
            await self._moves(playing)
            if playing.done():
                self.tally.differs += len(playing.result().disagreements)
        finally:
            playing.cancel()
            await asyncio.gather(playing, return_exceptions=True)
        return self.tally

    async def _moves(self, playing: "asyncio.Task[Any]") -> None:
        person = self._live.cast.person
        while self.tally.made < MOVES and await _wanted(person, playing):
            if not await self._move(person, playing):
                return
        if not playing.done():
            await self._live.arbiter.resign(self._colour)
            await playing

    def _hear(self, event: events.Event) -> None:
        match event:
            case events.MoveCommitted(colour=colour, uci=uci) if colour == self._colour:
                self._named = uci
                self._committed.set()
            case events.MoveCommitted():
                self.tally.checked += 1
            case events.SensorUnsure(candidates=candidates) if candidates:
                self._asked.append(candidates)
            case events.OperatorAsked():
                self.tally.helps += 1
            case _:
                pass

    async def _move(self, person: PersonPlayer, playing: "asyncio.Task[Any]") -> bool:
        """One move; whether the game can go on."""
        board = self._live.board.copy()
        move = chosen(board, self._rng)
        answered = getattr(person, "answered", 0)
        self._committed.clear()
        self._asked.clear()
        self._note(board, move)
        person.submit(move.uci())
        if not await _first(self._committed.wait(), playing):
            return False
        if self._named != move.uci():
            self.tally.wrong += 1
            return False
        told = getattr(person, "answered", 0) > answered
        kind = told and all(of_one_promotion(candidates) for candidates in self._asked)
        self.tally.named += kind or not told
        self.tally.kinds += kind
        self.tally.told += told and not kind
        return True

    def _note(self, board: chess.Board, move: chess.Move) -> None:
        self.tally.made += 1
        for kind, is_one in (
            ("captures", board.is_capture(move)), ("castlings", board.is_castling(move)),
            ("en_passants", board.is_en_passant(move)), ("promotions", move.promotion is not None),
        ):  # fmt: skip
            self.tally.special[kind] = self.tally.special.get(kind, 0) + is_one

    def _manner(self, transfer: Transfer) -> Mapping[str, object]:
        """Mostly briskly; sometimes with a pause on the way, over another square, or pushing a pawn."""
        chance = self._rng.random()
        if chance < _HESITATES:
            return {"pause": self._rng.uniform(0.2, 1.0)}
        if chance < _HESITATES + _WANDERS:
            square = self._live.session.table.centre(_beside(transfer, self._rng))
            return {"via": [[float(square[0]), float(square[1])]], "pause": self._rng.uniform(0.1, 0.6)}
        straight = transfer.source.name[0] == transfer.target.name[0] and transfer.target.is_square
        pawn = transfer.piece.piece_type == chess.PAWN and transfer.source.is_square
        return {"slide": True} if pawn and straight and chance > 1 - _SLIDES else {}


def of_one_promotion(candidates: Iterable[str]) -> bool:
    """Whether moves in UCI differ in nothing but the piece that a pawn becomes."""
    return all(len(uci) == len("e7e8q") for uci in candidates) and len({uci[:4] for uci in candidates}) == 1


def _beside(transfer: Transfer, rng: random.Random) -> Place:
    """Another square, near the target."""
    at = transfer.target.square or transfer.source.square or 0
    near = [square for square in chess.SQUARES if chess.square_distance(square, at) == 1]
    return Place.at(rng.choice(near))


def chosen(board: chess.Board, rng: random.Random) -> chess.Move:
    """A legal move, with a taste for captures, for what is rare, and for pawns that go ahead."""
    moves = sorted(board.legal_moves, key=chess.Move.uci)
    return rng.choices(moves, [_taste(board, move) for move in moves])[0]


def _taste(board: chess.Board, move: chess.Move) -> float:
    if board.is_castling(move) or board.is_en_passant(move):
        return 60.0
    if move.promotion is not None:
        return 40.0
    if board.is_capture(move):
        return 4.0
    return 1.5 if board.piece_type_at(move.from_square) == chess.PAWN else 1.0


async def _wanted(person: PersonPlayer, playing: "asyncio.Task[Any]") -> bool:
    """Until a move is wanted; False when the game is over first."""
    while not person.to_move:
        if not await _first(person.wanted.wait(), playing):
            return False
    return True


async def _first(waiting: Coroutine[Any, Any, object], playing: "asyncio.Task[Any]") -> bool:
    """Whether something came before the game's end, and in time."""
    task = asyncio.ensure_future(waiting)
    try:
        await asyncio.wait({task, playing}, timeout=_MISSED_S, return_when=asyncio.FIRST_COMPLETED)
        if playing.done() and playing.exception() is not None:
            raise KempelenError(f"The game broke off: {playing.exception()}")
        return bool(task.done())
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
