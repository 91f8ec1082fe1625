"""The 3D view over HTTP: its geometry. Where everything is comes by the WebSocket's topic ``scene``."""

from fastapi import APIRouter

from kempelen.app.arm_setup import arm_setup
from kempelen.server.house import StationDep
from kempelen.server.scene import SceneGeometry, scene_geometry
from kempelen.server.scene_source import table_in_view

router = APIRouter(prefix="/api/scene", tags=["scene"])


@router.get("")
def scene(station: StationDep) -> SceneGeometry:
    """All that stands still, and the shapes of what moves; mm, robot frame."""
    config = station.config
    setup = arm_setup(config)
    return scene_geometry(
        table_in_view(station),
        robot_kind=config.robot.kind,
        live=config.on_twin,
        arm=None if setup is None else setup.arm,
    )
