"""Ports, and what answers there."""

from typing import Annotated

from fastapi import APIRouter
from pydantic import Field

from kempelen.server.desk import DeskDep
from kempelen.server.house import OperatorDep
from kempelen.server.model import Model
from kempelen.server.operator_views import PortsView

router = APIRouter(prefix="/api/ports", tags=["operator"])


class ScanWish(Model):
    """What to look at beside this machine's serial ports.

    Attributes:
        address: ``socket://host:port`` or a device; empty for nothing more.
    """

    address: Annotated[str, Field(max_length=300)] = ""


@router.get("")
async def last_scan(desk: DeskDep, _: OperatorDep) -> PortsView:
    """The last scan; nothing is touched."""
    return desk.ports


@router.post("/scan")
async def scan(wish: ScanWish, desk: DeskDep, _: OperatorDep) -> PortsView:
    """Ask every port who is there; it takes up to some fifteen seconds. The one in use is left alone."""
    return await desk.scan(wish.address.strip())
