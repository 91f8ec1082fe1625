"""What the eyes see, and the numbers they read with. Numbers are set by the command ``eye_parameter``."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from kempelen.sensing.draw import Ground, Layer
from kempelen.server.desk import DeskDep, open_eyes
from kempelen.server.house import PlayerDep, StationDep
from kempelen.server.operator_views import ParameterView

router = APIRouter(prefix="/api/eyes", tags=["operator"])


@router.get("/picture", response_class=Response, responses={200: {"content": {"image/jpeg": {}}}})
async def picture(
    desk: DeskDep,
    _: PlayerDep,
    ground: Ground = Ground.COLOUR,
    layers: Annotated[frozenset[Layer], Query()] = frozenset(),
    width: Annotated[int, Query(ge=160, le=1600)] = 960,
) -> Response:
    """The newest frame as a JPEG file, with what is made of it drawn over it."""
    wanted = tuple(sorted(layer.value for layer in layers))
    return Response(await desk.picture(ground.value, wanted, width), media_type="image/jpeg")


@router.get("/parameters")
async def parameters(station: StationDep, _: PlayerDep) -> list[ParameterView]:
    """All numbers that the eyes read with."""
    found = await open_eyes(station).parameters()
    return [ParameterView.model_validate(parameter) for parameter in found]
