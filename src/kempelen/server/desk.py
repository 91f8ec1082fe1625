"""What the operator's pages need beside the station: the last scan of ports, logs, the doctor, pictures.

One desk for a server, entered with it. Whatever takes a while is done once for all who ask meanwhile.
"""

import asyncio
import logging
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Annotated, Self

from fastapi import Depends
from fastapi.requests import HTTPConnection

from kempelen.app.discreet import without_paths
from kempelen.app.doctor import examine_machine
from kempelen.app.eye import Eye
from kempelen.app.logbook import Heard, Logbook, kept
from kempelen.app.port_scan import scan_ports
from kempelen.app.station import Station
from kempelen.app.station_types import Change, Phase
from kempelen.app.table_session import robot_kinds
from kempelen.core.errors import SensorError
from kempelen.core.words import say
from kempelen.server.messages import WireLine
from kempelen.server.operator_views import CheckView, DoctorView, PortsView, PortView

DOCTOR_S = 120.0
FRESH_S = 0.1
"""A picture so new is given to whoever asks next."""
_FEW = 8
_log = logging.getLogger(__name__)


class Desk:
    """Context manager: logs are kept while it is entered.

    Args:
        station: The table.
        on_line: Called with each line on the robot's wire.

    Attributes:
        started: When, s since the epoch.
        ports: The last scan.
        doctor: What the doctor found last; None before the first time.
    """

    def __init__(self, station: Station, on_line: Callable[[WireLine], None]) -> None:
        self._station = station
        self._on_line = on_line
        self._stack = ExitStack()
        self._scanning, self._examining, self._drawing = asyncio.Lock(), asyncio.Lock(), asyncio.Lock()
        self._pictures: dict[tuple[str, tuple[str, ...], int], tuple[float, bytes]] = {}
        self._noted: tuple[object, ...] = ()
        self.started = time.time()
        self.ports = PortsView(kinds=tuple(robot_kinds()))
        self.doctor: DoctorView | None = None

    def __enter__(self) -> Self:
        """Begin to keep logs."""
        self._book = self._stack.enter_context(kept())
        self._book.wire.ring.listeners.append(self._hear)
        self._stack.callback(self._station.listen(self._note))
        _log.info("The server has begun.")
        return self

    def __exit__(self, *_exc: object) -> None:
        """End it."""
        self._stack.close()

    @property
    def book(self) -> Logbook:
        """The logs."""
        return self._book

    def _hear(self, line: Heard) -> None:
        self._on_line(wire_line(line))

    def _note(self, change: Change) -> None:
        """What becomes of the station goes into the log, once."""
        if change is not Change.STATION:
            return
        news = (self._station.phase, self._station.busy, self._station.faults)
        if news != self._noted:
            for fault in self._station.faults:
                _log.warning("%s: %s", fault.title, fault.text)
            _log.info("Station: %s", self._station.busy or self._station.phase)
            self._noted = news

    # --- ports ----------------------------------------------------------------------------------------------

    async def scan(self, address: str) -> PortsView:
        """Look which ports there are and what answers there; the port in use is left alone.

        Args:
            address: Of another one to look at; empty for none.
        """
        before = self.ports
        async with self._scanning:
            if self.ports is before or address:
                in_use = self._station.config.robot.port if self._station.session is not None else ""
                found = await scan_ports(in_use, address)
                kinds = tuple(robot_kinds())
                self.ports = PortsView(kinds=kinds, at=time.time(), ports=tuple(map(PortView.of, found)))
        return self.ports

    # --- doctor ---------------------------------------------------------------------------------------------

    async def examine(self) -> DoctorView:
        """Let the doctor look at this machine, in a thread, for he waits for disks and programs."""
        before = self.doctor
        async with self._examining:
            if self.doctor is before:
                at_play = self._station.phase is not Phase.OFF
                rows = await asyncio.to_thread(self._rows, at_play)
                self.doctor = DoctorView(at=time.time(), rows=rows)
        return self.doctor or DoctorView(at=time.time(), rows=())

    def _rows(self, at_play: bool) -> tuple[CheckView, ...]:  # noqa: FBT001 - for to_thread
        config = self._station.config
        found: list[CheckView] = []

        async def look() -> None:
            async with asyncio.timeout(DOCTOR_S):
                async for check in examine_machine(config, at_play=at_play):
                    found.append(_without_paths(CheckView.of(check)))  # noqa: PERF401 - what was found before the time is up counts

        try:
            asyncio.run(look())
        except TimeoutError:
            late = f"not done within {DOCTOR_S:.0f} s"
            found.append(CheckView(name="doctor", status="warn", found=late, todo="Try again later."))
        return tuple(found)

    # --- eyes -----------------------------------------------------------------------------------------------

    async def picture(self, ground: str, layers: tuple[str, ...], width: int) -> bytes:
        """What the eyes see, a JPEG file.

        Raises:
            SensorError: there are no eyes at work, or nothing has been seen yet.
        """
        wish = (ground, layers, width)
        async with self._drawing:  # the eye has better things to do than to draw for a crowd
            drawn = self._pictures.get(wish)
            if drawn is not None and time.monotonic() - drawn[0] < FRESH_S:
                return drawn[1]
            picture = await open_eyes(self._station).layers(ground, layers, width)
            if len(self._pictures) >= _FEW:
                self._pictures.clear()
            self._pictures[wish] = (time.monotonic(), picture)
            return picture


def open_eyes(station: Station) -> Eye:
    """The eye that looks at the board now.

    Raises:
        SensorError: none does.
    """
    eyes = station.eyes
    if eyes is None or station.session is None or eyes.camera is None:
        raise SensorError(
            say("no_eyes", "No camera is looking at the board."),
            hint=say("switch_eyes_on", "Switch the eyes on, or begin a game."),
        )
    return eyes.camera


def wire_line(line: Heard) -> WireLine:
    """As it is sent."""
    return WireLine(number=line.number, at=line.at, way=line.way, text=line.text)


def _without_paths(row: CheckView) -> CheckView:
    return row.model_copy(update={"found": without_paths(row.found), "todo": without_paths(row.todo)})


def desk_of(connection: HTTPConnection) -> Desk:
    """The desk of the server that a request came to."""
    desk = connection.app.state.desk
    if not isinstance(desk, Desk):
        raise TypeError("this application has no desk")
    return desk


DeskDep = Annotated[Desk, Depends(desk_of)]
