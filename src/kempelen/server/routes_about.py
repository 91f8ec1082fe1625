"""The program and the machine it runs on. Nothing is asked of anybody else."""

import platform
from importlib.metadata import PackageNotFoundError, version

from fastapi import APIRouter

from kempelen import __version__
from kempelen.server.desk import DeskDep
from kempelen.server.house import OperatorDep, StationDep, VisitorDep
from kempelen.server.operator_views import AboutView, DoctorView

router = APIRouter(prefix="/api/about", tags=["operator"])
_LIBRARIES = ("chess", "mujoco", "numpy", "opencv-python-headless", "fastapi", "pydantic")


@router.get("")
async def about(desk: DeskDep, station: StationDep, _: VisitorDep) -> AboutView:
    """Versions, and what is connected."""
    config = station.config
    return AboutView(
        version=__version__,
        licence="GPL-3.0-or-later",
        python=platform.python_version(),
        system=f"{platform.system()} {platform.machine()}",
        libraries={name: found for name in _LIBRARIES if (found := _installed(name))},
        robot=config.robot.kind,
        port=config.robot.port,
        camera=config.camera_source,
        started=desk.started,
    )


@router.get("/doctor")
async def last_findings(desk: DeskDep, _: OperatorDep) -> DoctorView | None:
    """What the doctor found last; null before the first time."""
    return desk.doctor


@router.post("/doctor")
async def examine(desk: DeskDep, _: OperatorDep) -> DoctorView:
    """Let the doctor look at this machine; it takes some seconds, at most two minutes."""
    return await desk.examine()


def _installed(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
