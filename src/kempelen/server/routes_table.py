"""The table: what stands where, whether it fits, and where the board was measured."""

from fastapi import APIRouter

from kempelen.app.calibration_file import load_calibration
from kempelen.app.station import Station
from kempelen.app.station_types import Phase
from kempelen.app.table_form import TableForm, built, save_form
from kempelen.core.errors import GameError
from kempelen.core.words import joined, say
from kempelen.server.house import OperatorDep, StationDep, VisitorDep
from kempelen.server.operator_views import FitView, MeasuredView, TableView

router = APIRouter(prefix="/api", tags=["operator"])


@router.get("/table")
async def table(station: StationDep, _: VisitorDep) -> TableView:
    """The table in force, what may be edited of it, and what does not fit."""
    return _view(station)


@router.post("/fit")
async def fit(form: TableForm, station: StationDep, _: OperatorDep) -> FitView:
    """What would come of an edited form; nothing is changed."""
    config = form.applied(station.config)
    return FitView.of(config, *built(config))


@router.put("/table")
async def save(form: TableForm, station: StationDep, _: OperatorDep) -> TableView:
    """Keep an edited form, and use it from now on."""
    if refusal := _refusal(station):
        raise GameError(refusal, hint=say("leave_or_wait", "Leave the game or wait, then save the table."))
    built(form.applied(station.config))  # what cannot be built is not kept
    await station.change_table(save_form(form, station.config))
    return _view(station)


@router.get("/calibration")
async def calibration(station: StationDep, _: VisitorDep) -> MeasuredView:
    """Where the board was measured to be."""
    config = station.config
    measured = load_calibration(config.calibration_path)
    return MeasuredView.of(measured, config.build_table(measured))


def _view(station: Station) -> TableView:
    config = station.config
    calibrated = load_calibration(config.calibration_path) is not None
    return TableView.of(config, *built(config), calibrated=calibrated, why_not=_refusal(station))


def _refusal(station: Station) -> str:
    if station.busy:
        return joined(say("not_now", "Not now:"), station.busy)
    if station.phase in {Phase.OFF, Phase.READY}:
        return ""
    return say("table_in_use", "A game is being played on this table, and its pieces stand in these trays.")
