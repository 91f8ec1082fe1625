"""Words between the twin's loop and its cameras' processes.

A packet socket: a message arrives whole or not at all, and a sender that would have to wait leaves the
message out. The loop tells where everything is some thirty times a second; a camera draws the newest it has.
"""

import base64
import contextlib
import json
import select
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import pydantic

from kempelen.core.errors import TwinError
from kempelen.core.geometry import Array
from kempelen.twin.cameras.settings import CameraSpec
from kempelen.twin.physics.scene import StandingPiece

Message = dict[str, Any]

LONGEST = 1 << 18
"""Bytes of a message."""
START_S = 60.0
_END_S = 5.0
_CHANGEABLE = ("placement", "lighting", "noise")


def pack(numbers: Array) -> str:
    """Numbers as text."""
    return base64.b64encode(np.ascontiguousarray(numbers, dtype="<f8").tobytes()).decode()


def unpack(text: str) -> Array:
    """What was packed."""
    return np.frombuffer(base64.b64decode(text), dtype="<f8")


def patched(spec: CameraSpec, patch: Mapping[str, Any]) -> CameraSpec:
    """The spec with some of its settings changed: ``{"lighting": {"on": false}}`` leaves all others.

    Raises:
        TwinError: there is no such setting, or its value is out of range.
    """
    if unknown := sorted(set(patch) - set(_CHANGEABLE)):
        raise TwinError(
            f"A running camera's {', '.join(unknown)} cannot be changed.",
            hint=f"These can: {', '.join(_CHANGEABLE)}.",
        )
    whole = spec.model_dump()
    for part, values in patch.items():
        whole[part] |= dict(values)
    try:
        return CameraSpec.model_validate(whole)
    except pydantic.ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise TwinError(f"A camera's {where} cannot be {first['input']!r}: {first['msg']}.") from None


class CameraProcess:
    """The twin's end of one camera.

    Args:
        spec: Of the camera; its ring has a name.
        table: JSON of the twin's spec.
    """

    def __init__(self, spec: CameraSpec, table: str) -> None:
        self.spec = spec
        self.backend = ""
        self._pieces: Sequence[StandingPiece] | None = None
        self._due = 0.0
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, LONGEST)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "kempelen.twin.cameras", str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=(theirs.fileno(),),
            )
        self._socket = ours
        self._send({"camera": spec.model_dump(mode="json"), "twin": json.loads(table)})
        ours.setblocking(False)  # noqa: FBT003 - the standard library's signature

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return self._process.poll() is None

    @property
    def pid(self) -> int:
        """Its process."""
        return self._process.pid

    def wait(self) -> None:
        """Until it can take pictures.

        Raises:
            TwinError: it cannot; the message holds the reason.
        """
        ready, _, _ = select.select([self._socket], [], [], START_S)
        answer = self._socket.recv(LONGEST) if ready else b""
        told: Message = json.loads(answer) if answer else {"error": "it ended without a word"}
        if "error" in told:
            self.close()
            raise TwinError(f"The twin's camera '{self.spec.ring}' did not start: {told['error']}")
        self.backend = str(told["backend"])

    def _started(self) -> bool:
        """Whether it can take pictures by now; one that cannot start is left for gone."""
        if not self.backend and select.select([self._socket], [], [], 0.0)[0]:
            with contextlib.suppress(TwinError):
                self.wait()
        return bool(self.backend)

    def tell(self, pieces: Sequence[StandingPiece], moment: float, qpos: Array, mocap: Array) -> None:
        """Where everything is now, unless the camera was told a moment ago.

        Args:
            pieces: Of the scene.
            moment: Simulated time, s.
            qpos: All joints.
            mocap: (n, 7) places and attitudes of what is moved from outside.
        """
        now = time.monotonic()
        if now < self._due or not self._started():
            return
        if pieces is not self._pieces and self._send({"pieces": [asdict(piece) for piece in pieces]}):
            self._pieces = pieces
        if self._send({"time": moment, "qpos": pack(qpos), "mocap": pack(mocap)}):
            self._due = max(self._due + 1 / self.spec.optics.rate, now)

    def change(self, patch: Mapping[str, Any]) -> None:
        """Other settings from the next frame on.

        Raises:
            TwinError: there are no such settings, or the camera is gone or hangs.
        """
        changed = patched(self.spec, patch)
        if not self._send({"change": changed.model_dump(mode="json")}):
            raise TwinError(f"The twin's camera '{self.spec.ring}' does not listen.", hint="Restart it.")
        self.spec = changed

    def _send(self, message: Message) -> bool:
        """Whether it was taken."""
        try:
            self._socket.send(json.dumps(message).encode())
        except (BlockingIOError, BrokenPipeError, ConnectionResetError):
            return False
        return True

    def close(self) -> None:
        """End it."""
        self._socket.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_END_S)
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
