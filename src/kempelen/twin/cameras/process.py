"""A camera beside the twin: draws where everything is said to be, and writes its frames to a ring."""

import json
import select
import signal
import socket
import time
from dataclasses import replace

from kempelen.core.errors import KempelenError
from kempelen.frames.ring import RingWriter
from kempelen.twin.cameras.camera import VirtualCamera
from kempelen.twin.cameras.link import LONGEST, Message, unpack
from kempelen.twin.cameras.settings import CameraSpec
from kempelen.twin.cameras.still import Still
from kempelen.twin.machine import make_scene
from kempelen.twin.physics.scene import StandingPiece
from kempelen.twin.spec import TwinSpec

SLOTS = 5
_IDLE_S = 0.5
"""Without a reader a picture is taken this often, so that one who comes finds something."""
_BYTES = 3 + 4
"""Of a colour and a depth pixel, generously as if both pictures were of the larger size."""


class Puppets(Still):
    """The table as told.

    Args:
        scene: As it was at first.
    """

    heard = False

    def hear(self, message: Message) -> None:
        """Take in a message."""
        if "pieces" in message:
            pieces = tuple(StandingPiece(**piece) for piece in message["pieces"])
            if pieces != self.scene.pieces:
                super().__init__(replace(self.scene, pieces=pieces))
        if "qpos" in message:
            self.data.qpos[:] = unpack(message["qpos"])
            mocap = unpack(message["mocap"]).reshape(-1, 7)
            self.data.mocap_pos[:], self.data.mocap_quat[:] = mocap[:, :3], mocap[:, 3:]
            self.data.time, self.heard = message["time"], True


class CameraLoop:
    """Draws as long as the twin lives.

    Args:
        link: To the twin.
        spec: Of the camera.
        twin: Of the twin.
    """

    def __init__(self, link: socket.socket, spec: CameraSpec, twin: TwinSpec) -> None:
        self._link = link
        self._puppets = Puppets(make_scene(twin))
        self._camera = VirtualCamera.of(spec)
        pixels = max(lens.width * lens.height for lens in (spec.optics.colour, spec.optics.depth))
        self._ring = RingWriter(spec.ring, SLOTS, _BYTES * pixels)
        self._shown = (-1.0, -1.0)  # simulated and wall time of the last frame

    def run(self) -> None:
        """Until the twin ends."""
        with self._camera, self._ring:
            self._camera.shoot(self._puppets)  # what cannot be drawn is known before anybody waits for it
            self._answer({"ring": self._ring.name, "backend": self._camera.backend})
            while self._listen():
                self._show()

    def _answer(self, message: Message) -> None:
        self._link.send(json.dumps(message).encode())

    def _listen(self) -> bool:
        """Take in all that has been said, waiting for something; whether the twin is still there."""
        select.select([self._link], [], [])
        self._link.setblocking(False)  # noqa: FBT003 - the standard library's signature
        try:
            while heard := self._link.recv(LONGEST):
                self._hear(json.loads(heard))
        except BlockingIOError:
            return True
        except ConnectionResetError:
            return False
        return False

    def _hear(self, message: Message) -> None:
        if "change" in message:
            spec = CameraSpec.model_validate(message["change"])
            self._camera.change(placement=spec.placement, lighting=spec.lighting, noise=spec.noise)
        else:
            self._puppets.hear(message)

    def _show(self) -> None:
        simulated, wall = float(self._puppets.data.time), time.monotonic()
        idle = not self._ring.readers and wall - self._shown[1] < _IDLE_S
        if idle or not self._puppets.heard or simulated == self._shown[0]:
            return
        self._shown = (simulated, wall)
        self._ring.write_frame(self._camera.shoot(self._puppets))


def main(descriptor: int) -> int:
    """Read the spec, say when pictures can be taken, take them."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the twin ends its cameras
    with socket.socket(fileno=descriptor) as link:
        told = link.recv(LONGEST)
        if not told:
            return 1
        message = json.loads(told)
        try:
            spec = CameraSpec.model_validate(message["camera"])
            CameraLoop(link, spec, TwinSpec.model_validate(message["twin"])).run()
        except KempelenError as error:
            link.send(json.dumps({"error": str(error)}).encode())
            return 1
    return 0
