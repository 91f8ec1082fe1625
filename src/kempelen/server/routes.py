"""HTTP: what is, who is there, games, engines; and every command."""

import io
import re
from itertools import islice
from typing import Annotated

import segno
from fastapi import APIRouter, Path, Query, Response

from kempelen.app.paths import journal_path
from kempelen.core.errors import NotationError
from kempelen.core.words import say
from kempelen.game.game_log import pgn_of
from kempelen.game.journal import JournalReader
from kempelen.game.pgn import GameHeading, headings, parse_game
from kempelen.server.commands import AnyCommand, Pgn, Reply, Role
from kempelen.server.deeds import PGN_LIMITS
from kempelen.server.engines import EngineView, offered
from kempelen.server.house import HouseDep, StationDep, VisitorDep
from kempelen.server.hub import TOPICS, may_see
from kempelen.server.messages import Snapshot
from kempelen.server.model import Model
from kempelen.server.moves import MoveBook
from kempelen.server.problems import Problem
from kempelen.server.topics import MoveView

router = APIRouter(prefix="/api", responses={"4XX": {"model": Problem}})

GameNumber = Annotated[int, Path(ge=1, le=2**53)]


class Me(Model):
    """Who asks.

    Attributes:
        password: Whether there is a password by which one can become more.
    """

    role: Role
    password: bool


class GameEntry(Model):
    """A line in the list of games.

    Attributes:
        plies: Half-moves in it.
        result: ``*`` while it is not over.
        reason: Of its end; empty while it is not over.
        over: Whether it has ended, so that it cannot be gone on with.
    """

    game: int
    started: str
    last: str
    mode: str
    white: str
    black: str
    plies: int
    result: str
    reason: str
    over: bool


class GameList(Model):
    """Games of the journal, the newest first.

    Attributes:
        count: How many there are in all.
    """

    count: int
    games: tuple[GameEntry, ...]


class GameRecord(Model):
    """A game of the journal."""

    number: int
    mode: str
    white: str
    black: str
    start_fen: str
    moves: tuple[MoveView, ...]
    result: str
    reason: str


class Upload(Model):
    """A PGN file."""

    pgn: Pgn


class Heading(Model):
    """A game of an uploaded file.

    Attributes:
        number: In the file, from 1.
        title: Players, result, event and date as far as they are known.
    """

    number: int
    title: str
    white: str
    black: str
    result: str
    date: str
    event: str


class PgnList(Model):
    """What is in an uploaded file.

    Attributes:
        more: Whether there are more games than are listed.
    """

    games: tuple[Heading, ...]
    more: bool


_LISTED = 500
_NUMBERED = re.compile(r"\b1\s*\.")
"""The number of a first move."""
_NAME = 200


@router.get("/state", tags=["live"])
def state(house: HouseDep, visitor: VisitorDep) -> Snapshot:
    """Everything that pages show, as the WebSocket's first message has it."""
    topics = [topic for topic in TOPICS if may_see(visitor.role, topic)]
    return Snapshot.model_validate_json(house.hub.snapshot(visitor.role, topics))


@router.get("/me", tags=["session"])
def me(house: HouseDep, visitor: VisitorDep) -> Me:
    """Who asks."""
    return Me(role=visitor.role, password=house.sessions.has_password)


@router.post("/commands", tags=["live"])
async def obey(command: AnyCommand, house: HouseDep, visitor: VisitorDep) -> Reply:
    """Do something. A refusal is an answer like any other: ``ok`` is false and ``error`` says why."""
    return await house.dispatcher.obey(command, visitor)


@router.get("/games", tags=["games"])
def games(
    station: StationDep,
    first: Annotated[int, Query(ge=0, le=2**31)] = 0,
    count: Annotated[int, Query(ge=1, le=_LISTED)] = 100,
) -> GameList:
    """Games of the journal, the newest first."""
    path = journal_path(station.config.data_dir)
    if not path.exists():
        return GameList(count=0, games=())
    with JournalReader(path) as journal:
        rows = journal.games()
    shown = rows[first : first + count]
    return GameList(
        count=len(rows), games=tuple(GameEntry.model_validate(row, from_attributes=True) for row in shown)
    )


@router.get("/games/{number}", tags=["games"])
def game(station: StationDep, number: GameNumber) -> GameRecord:
    """One game."""
    with JournalReader(journal_path(station.config.data_dir)) as journal:
        kept = journal.state(number)
    ended = kept.ended
    return GameRecord(
        number=number, mode=kept.pairing.mode, white=kept.pairing.white.name, black=kept.pairing.black.name,
        start_fen=kept.begun.start_fen, moves=MoveBook().moves(kept.board),
        result=ended.result if ended else "*", reason=ended.reason if ended else "",
    )  # fmt: skip


class PgnResponse(Response):
    """A PGN file to keep."""

    media_type = "application/x-chess-pgn"


@router.get("/games/{number}/pgn", tags=["games"], response_class=PgnResponse)
def pgn(station: StationDep, number: GameNumber) -> PgnResponse:
    """One game as PGN."""
    with JournalReader(journal_path(station.config.data_dir)) as journal:
        text = pgn_of(journal.state(number))
    name = f'attachment; filename="kempelen-{number}.pgn"'
    return PgnResponse(text + "\n", headers={"Content-Disposition": name})


@router.post("/pgn", tags=["games"])
def contents(upload: Upload) -> PgnList:
    """Which games are in a PGN file."""
    stream = io.BytesIO(upload.pgn.encode("utf-8", "replace"))
    found = list(islice(headings(stream, "The file", limits=PGN_LIMITS), _LISTED + 1))
    if not found[0].headers:
        _require_moves(upload.pgn)
    return PgnList(games=tuple(map(_heading, found[:_LISTED])), more=len(found) > _LISTED)


def _require_moves(text: str) -> None:
    """A game without tags is told from any other text by its moves.

    Raises:
        NotationError: it has none, or one that cannot be played.
    """
    try:
        score = parse_game(text, limits=PGN_LIMITS)
    except NotationError:
        if _NUMBERED.search(text):
            raise
        raise _no_game() from None
    if not score.moves:
        raise _no_game()


def _no_game() -> NotationError:
    return NotationError(
        say("no_pgn_text", "This is no game in PGN: there is no move in it."),
        hint=say("pgn_looks_like", "A game looks like this: 1. e4 e5 2. Nf3 Nc6"),
    )


def _heading(found: GameHeading) -> Heading:
    white, black, result, date, event = (
        found.headers.get(tag, "")[:_NAME] for tag in ("White", "Black", "Result", "Date", "Event")
    )
    return Heading(
        number=found.index, title=found.title[:_NAME],
        white=white, black=black, result=result, date=date, event=event,
    )  # fmt: skip


@router.get("/engines", tags=["games"])
def engines(station: StationDep) -> list[EngineView]:
    """Which engines can be chosen."""
    return list(offered(station.config))


class QrResponse(Response):
    """A picture."""

    media_type = "image/svg+xml"


def qr_code(text: str) -> str:
    """An SVG picture."""
    picture = io.BytesIO()
    made = segno.make(text, error="m")
    made.save(picture, kind="svg", scale=8, border=2, svgclass=None, lineclass=None, xmldecl=False)
    return picture.getvalue().decode()


@router.get("/qr.svg", tags=["live"], response_class=QrResponse)
def qr(house: HouseDep) -> QrResponse:
    """The address of the spectators' page, for phones."""
    return QrResponse(qr_code(f"{house.settings.origin}/spectator"))
