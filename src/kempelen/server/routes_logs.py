"""Logs: lines on the robot's wire, and what the program says of itself. New lines come over the WebSocket."""

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import Field

from kempelen.server.desk import DeskDep, wire_line
from kempelen.server.house import OperatorDep
from kempelen.server.model import Model
from kempelen.server.operator_views import LogLine, LogView, WireView

router = APIRouter(prefix="/api/logs", tags=["operator"])


class Wanted(Model):
    """Which lines.

    Attributes:
        after: Those with a greater number.
        limit: The newest of them.
        match: That hold this text, capitals or not.
    """

    after: Annotated[int, Field(ge=0)] = 0
    limit: Annotated[int, Field(ge=1, le=5000)] = 500
    match: Annotated[str, Field(max_length=100)] = ""


WantedDep = Annotated[Wanted, Query()]


@router.get("/wire")
async def wire(desk: DeskDep, _: OperatorDep, wanted: WantedDep) -> WireView:
    """The newest lines after a number that hold a text."""
    return WireView(
        lines=tuple(map(wire_line, desk.book.wire.ring.find(wanted.after, wanted.limit, wanted.match)))
    )


@router.get("/program")
async def program(desk: DeskDep, _: OperatorDep, wanted: WantedDep) -> LogView:
    """The newest records after a number that hold a text."""
    found = desk.book.program.ring.find(wanted.after, wanted.limit, wanted.match)
    return LogView(
        lines=tuple(
            LogLine(number=line.number, at=line.at, level=line.level, name=line.name, text=line.text)
            for line in found
        )
    )
