"""The twin's cameras: what a Kinect v2 or a D435 over the table would see, noise and all.

Nothing here tells where a piece is: what leaves is frames, with the intrinsics that a real camera's own
software would give. Settings are light to import; `VirtualCamera` brings MuJoCo and OpenCV with it.
"""

from typing import Any

from kempelen.twin.cameras.models import D435, KINECT_V2, CameraModel
from kempelen.twin.cameras.noise import NOMINAL, OFF, Noise
from kempelen.twin.cameras.settings import CameraSpec, Lighting, Placement

__all__ = [
    "D435",
    "KINECT_V2",
    "NOMINAL",
    "OFF",
    "CameraModel",
    "CameraSpec",
    "Lighting",
    "Noise",
    "Placement",
    "VirtualCamera",
]


def __getattr__(name: str) -> Any:
    if name == "VirtualCamera":
        from kempelen.twin.cameras.camera import VirtualCamera  # noqa: PLC0415 - heavy, and not for the spec

        return VirtualCamera
    raise AttributeError(name)
