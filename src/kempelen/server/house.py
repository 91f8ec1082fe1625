"""All of a server together, and what routes need of it.

Routes take what they need as parameters: `HouseDep`, `StationDep`, `HubDep`, `VisitorDep`; `OperatorDep` and
`PlayerDep` refuse everybody else.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from fastapi import Depends, HTTPException
from fastapi.requests import HTTPConnection

from kempelen.app.station import Station
from kempelen.server.commands import Role
from kempelen.server.dispatch import Dispatcher
from kempelen.server.hub import Hub
from kempelen.server.limits import Limiter, Rate
from kempelen.server.problems import Tally
from kempelen.server.sessions import Sessions, Visitor, allows

_PAGE = Path(__file__).with_name("page")
COOKIE = "kempelen_session"
_ENTRIES = Rate(per_second=0.2, burst=5)
_MESSAGES = Rate(per_second=60, burst=120)
_GARBAGE = Rate(per_second=0.5, burst=8)


@dataclass(frozen=True)
class Settings:
    """How the server is reached.

    Attributes:
        origin: Where it is, as a browser writes it: ``http://127.0.0.1:8000``.
        secure: Whether over TLS.
        names: Host names that lead here, beside localhost and addresses.
        sessions: File that sessions are kept in over a restart; None for nowhere.
        passwords: What lets somebody in as this role.
        page: Directory of the built page.
        send_s: A client that takes nothing for so long is let go of.
    """

    origin: str = "http://127.0.0.1:8000"
    secure: bool = False
    names: frozenset[str] = frozenset()
    sessions: Path | None = None
    passwords: dict[Role, str] = field(default_factory=dict)
    page: Path = _PAGE
    send_s: float = 10.0


class House:
    """A server's parts.

    Attributes:
        entries: Limits tries at passwords and tokens, by address.
        messages: Limits what comes over a WebSocket, by socket.
        garbage: Of it, what cannot be understood.
    """

    def __init__(self, station: Station, settings: Settings, epoch: str) -> None:
        self.station = station
        self.settings = settings
        self.epoch = epoch
        self.tally = Tally()
        self.hub = Hub(epoch)
        self.sessions = Sessions(settings.sessions, settings.passwords)
        self.dispatcher = Dispatcher(station, self.tally)
        self.entries = Limiter(_ENTRIES)
        self.messages = Limiter(_MESSAGES)
        self.garbage = Limiter(_GARBAGE)

    def visitor(self, connection: HTTPConnection) -> Visitor:
        """Whoever asks."""
        return self.sessions.visitor(connection.cookies.get(COOKIE), address(connection))


def address(connection: HTTPConnection) -> str:
    """Where a connection comes from."""
    return connection.client.host if connection.client else "nowhere"


def house_of(connection: HTTPConnection) -> House:
    """The server that a request came to."""
    house = connection.app.state.house
    if not isinstance(house, House):
        raise TypeError("this application was not made by create_app")
    return house


HouseDep = Annotated[House, Depends(house_of)]


def _station(house: HouseDep) -> Station:
    return house.station


def _hub(house: HouseDep) -> Hub:
    return house.hub


def _visitor(house: HouseDep, connection: HTTPConnection) -> Visitor:
    return house.visitor(connection)


StationDep = Annotated[Station, Depends(_station)]
HubDep = Annotated[Hub, Depends(_hub)]
VisitorDep = Annotated[Visitor, Depends(_visitor)]


def not_allowed(needed: Role) -> str:
    """Why somebody else may not."""
    return f"This is for {needed}s." if needed == "operator" else f"This is for {needed}s and operators."


def _at_least(needed: Role, visitor: Visitor, house: House) -> Visitor:
    if not allows(visitor.role, needed):
        house.tally.refused("role", visitor.role)
        raise HTTPException(403, not_allowed(needed))
    return visitor


def _operator(house: HouseDep, visitor: VisitorDep) -> Visitor:
    return _at_least("operator", visitor, house)


def _player(house: HouseDep, visitor: VisitorDep) -> Visitor:
    return _at_least("player", visitor, house)


OperatorDep = Annotated[Visitor, Depends(_operator)]
PlayerDep = Annotated[Visitor, Depends(_player)]
