"""The twin's reed board: the pieces' magnets over its switches, its line at a pseudo-terminal."""

import select
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import chess
import numpy as np

from kempelen.core.errors import TwinError
from kempelen.core.geometry import Array
from kempelen.core.reed import squares_in
from kempelen.twin.physics.scene import Scene
from kempelen.twin.physics.units import METRES
from kempelen.twin.reed.device import Device, Line
from kempelen.twin.reed.magnets import Magnets
from kempelen.twin.reed.matrix import Matrix
from kempelen.twin.reed.settings import ReedSpec
from kempelen.twin.wire import PtyWire

_CATCH_UP_MS = 60
"""A reading a millisecond for so long back at most: longer jumps of the clock happen at rest alone."""
_SENT_AT_ONCE = 2048
"""Bytes; a terminal holds no more than 4096, and what does not fit would be lost."""

Request = Mapping[str, Any]


class Stage(Protocol):
    """What of the world it feels."""

    @property
    def scene(self) -> Scene:
        """The pieces."""
        ...

    @property
    def data(self) -> Any:
        """MuJoCo's."""
        ...


class TwinReed:
    """A virtual board in a running twin.

    Args:
        spec: What it is like.
        scene: Where the squares are.
        seed: Of bounces and damaged bytes.
    """

    def __init__(self, spec: ReedSpec, scene: Scene, seed: int = 0) -> None:
        self.device = Device(
            spec.identity, matrix=Matrix(wiring=spec.wiring), version=spec.version, seed=seed
        )
        self.magnets = Magnets(
            scene.table.robot_from_board, scene.table.square, closing=spec.closing, opening=spec.opening,
            bounce_ms=spec.bounce_ms, seed=seed,
        )  # fmt: skip
        self._link = Path(spec.link) if spec.link else None
        self._wire: PtyWire | None = PtyWire(self._link)
        self._now = -1
        self._seen = np.empty(0)

    @property
    def address(self) -> str:
        """Where the host connects; empty while the cable is pulled."""
        return self._wire.address if self._wire else ""

    def filenos(self) -> list[int]:
        """Descriptors worth waiting for."""
        return self._wire.filenos() if self._wire else []

    def tell(self, stage: Stage, time: float) -> None:
        """Where everything is at that simulated time, s: scan, and serve the line."""
        now = int(1000 * time)
        names, positions, axes = _bodies(stage)
        if self._now < 0:
            self.device.power_up(self.magnets.settle(names, positions, axes))
        else:
            self._feel(now, names, positions, axes)
        self._now = now
        self._serve(now)

    def _feel(self, now: int, names: list[str], positions: Array, axes: Array) -> None:
        seen = np.hstack([positions, axes])
        if self.device.at_rest and np.array_equal(seen, self._seen):
            self.device.scan(now, self.magnets.reading(now))
            return
        self._seen = seen
        begin = max(self._now, now - _CATCH_UP_MS)
        self.magnets.move(begin, names, positions, axes)
        for moment in range(begin + 1, now + 1):
            self.device.scan(moment, self.magnets.reading(moment))

    def _serve(self, now: int) -> None:
        if self._wire is None:
            self.device.take_output()
            return
        self._wire.opened()
        if data := self._wire.read():
            self.device.receive(now, data)
        if (fileno := self._wire.filenos()) and select.select([], fileno, [], 0.0)[1]:
            self._wire.write(self.device.take_output(_SENT_AT_ONCE))
        elif not fileno:
            self.device.take_output()  # nobody listens

    def request(self, request: Request) -> dict[str, Any]:
        """What the side door asks: a fault, or how lamps and buzzer are.

        Args:
            request: ``stuck_closed``, ``stuck_open``, ``bare``: names of squares that are to be so, all
            others
                not; ``weak``: strength (0 to 1) by piece; ``damage``, ``loss``: rates of bytes and lines;
                ``unplug``: true pulls the cable, false plugs it in again.

        Raises:
            TwinError: no such square or piece, or a rate out of range.
        """
        matrix = self.device.matrix
        for name in ("stuck_closed", "stuck_open", "bare"):
            if name in request:
                setattr(matrix, name, _squares(request[name]))
        if "weak" in request:
            self.magnets.weak = {str(k): _share(v) for k, v in dict(request["weak"]).items()}
            self._seen = np.empty(0)
        if "damage" in request or "loss" in request:
            self.device.line = Line(_share(request.get("damage", 0)), _share(request.get("loss", 0)))
        if "unplug" in request:
            self._plug(out=bool(request["unplug"]))
        return {
            "lit": [chess.square_name(square) for square in squares_in(self.device.lit)],
            "sounds": [str(sound) for sound in self.device.sounds],
            "address": self.address,
        }

    def _plug(self, *, out: bool) -> None:
        if out:
            self.close()
        elif self._wire is None:
            self._wire = PtyWire(self._link)

    def close(self) -> None:
        """Give the terminal back."""
        if self._wire is not None:
            self._wire.close()
            self._wire = None


def _squares(names: Any) -> int:
    try:
        return sum(1 << chess.parse_square(str(name)) for name in names)
    except ValueError:
        raise TwinError(f"{names} are no squares.", hint="Name them as in e4.") from None


def _share(value: Any) -> float:
    share = float(value)
    if not 0 <= share <= 1:
        raise TwinError(f"{share} is no share.", hint="Give 0 to 1.")
    return share


def _bodies(stage: Stage) -> tuple[list[str], Array, Array]:
    """Names, (n, 3) mm and (n, 3) axes of all pieces."""
    pieces = stage.scene.pieces
    poses = np.array(stage.data.qpos[: 7 * len(pieces)]).reshape(-1, 7)
    w, x, y, z = poses[:, 3:].T
    axes = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    return [piece.piece_id for piece in pieces], poses[:, :3] / METRES, axes
