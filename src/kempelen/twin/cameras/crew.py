"""All cameras of a twin: started together, told together."""

from collections.abc import Mapping, Sequence
from typing import Any

from kempelen.core.errors import TwinError
from kempelen.frames.ring import ring_name
from kempelen.twin.cameras.link import CameraProcess
from kempelen.twin.cameras.render import Stage, mocap_poses
from kempelen.twin.cameras.settings import CameraSpec


class CameraCrew:
    """The cameras' processes.

    Args:
        specs: Of the cameras.
        table: JSON of the twin's spec.
    """

    def __init__(self, specs: Sequence[CameraSpec], table: str) -> None:
        named = [spec if spec.ring else spec.model_copy(update={"ring": ring_name("twin")}) for spec in specs]
        self._table = table
        self._cameras = [CameraProcess(spec, table) for spec in named]

    @property
    def rings(self) -> list[str]:
        """Names, in the order of the specs."""
        return [camera.spec.ring for camera in self._cameras]

    def wait(self) -> None:
        """Until all can take pictures.

        Raises:
            TwinError: one cannot.
        """
        try:
            for camera in self._cameras:
                camera.wait()
        except TwinError:
            self.close()
            raise

    def tell(self, stage: Stage, time: float) -> None:
        """Where everything is at that simulated time, s."""
        if self._cameras:
            qpos, mocap = stage.data.qpos, mocap_poses(stage.data)
            for camera in self._cameras:
                camera.tell(stage.scene.pieces, time, qpos, mocap)

    def state(self) -> list[Mapping[str, Any]]:
        """Of each camera: its ring, way of drawing, process, and whether that lives."""
        return [
            {"ring": camera.spec.ring, "backend": camera.backend, "pid": camera.pid, "alive": camera.alive}
            for camera in self._cameras
        ]

    def change(self, number: int, patch: Mapping[str, Any]) -> None:
        """Other settings of a camera.

        Raises:
            TwinError: there is no such camera or setting.
        """
        self._cameras[self._known(number)].change(patch)

    def restart(self, number: int) -> None:
        """Another process for a camera, with its present settings, in the place of one that is gone or hangs.

        Its start is not waited for: the controller's time must not stand still meanwhile.

        Raises:
            TwinError: there is no such camera.
        """
        before = self._cameras[self._known(number)]
        before.close()
        self._cameras[number] = CameraProcess(before.spec, self._table)

    def _known(self, number: int) -> int:
        if not 0 <= number < len(self._cameras):
            raise TwinError(
                f"The twin has no camera {number}.", hint=f"It has {len(self._cameras)}, counted from 0."
            )
        return number

    def close(self) -> None:
        """End them all."""
        for camera in self._cameras:
            camera.close()
