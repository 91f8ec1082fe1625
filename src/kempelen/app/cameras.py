"""Cameras by what a person types: ``uvc:0``, ``realsense``, ``recording:game.zip``.

::

    twin[:MODEL]                       a twin of its own, with a camera over it: kinect2, d435
    uvc[:N] or /dev/videoN             webcam; width, height, fps, fourcc
    realsense[:SERIAL]                 Intel RealSense D4xx; fps
    kinect2                            Kinect v2
    azure[:N]                          Azure Kinect
    recording:PATH                     folder or file of `kempelen record`; speed, loop
    picture:FILE                       one picture; depth, depth_unit, frames
    ring:NAME                          a ring that another program writes
    NAME[:WHAT]                        a driver that was installed besides

Further options follow as ``,name=value``. Drivers are found by their entry points, ``kempelen.cameras``.
"""

import re
import tempfile
import time
from collections.abc import Mapping
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

import chess

from kempelen.app.config import NODE_PORT, Config, RobotConfig, load_config
from kempelen.app.table_session import TableSession
from kempelen.core.camera import Camera, Frame
from kempelen.core.errors import CameraError, ConfigError
from kempelen.core.table import start_layout
from kempelen.frames.attached import AttachedCamera
from kempelen.frames.condition import CameraState, CameraStatus
from kempelen.frames.host import CameraProcess
from kempelen.twin.cameras.models import MODELS
from kempelen.twin.cameras.settings import CameraSpec
from kempelen.twin.spec import CONTROL_FOLDER

CAMERAS = "kempelen.cameras"
TWIN = "twin"
RING = "ring"
_TWIN_S = 10.0
_DEVICE = re.compile(r"/dev/video(\d+)")
_ANY_OPTION = re.compile(r",(?=[a-z_]+(?:=|,|$))")


@dataclass(frozen=True, slots=True)
class _Kind:
    """How the specification of a driver is read.

    Attributes:
        subject: Name of what follows the colon.
        required: Whether something must.
        types: Of that, and of the options.
    """

    subject: str = ""
    required: bool = False
    types: Mapping[str, type] = field(default_factory=dict)


_KINDS: Mapping[str, _Kind] = {
    TWIN: _Kind("model", types={"model": str}),
    RING: _Kind("ring", required=True, types={"ring": str, "patience": float}),
    "uvc": _Kind("device", types={"device": int, "width": int, "height": int, "fps": float, "fourcc": str}),
    "realsense": _Kind("serial", types={"serial": str, "fps": int}),
    "kinect2": _Kind(),
    "azure": _Kind("device", types={"device": int}),
    "recording": _Kind("path", required=True, types={"path": str, "speed": float, "loop": bool}),
    "picture": _Kind(
        "path", required=True, types={"path": str, "depth": str, "depth_unit": float, "frames": int}
    ),
}


@dataclass(frozen=True, slots=True)
class CameraSource:
    """A camera that somebody asked for.

    Attributes:
        spec: As it was typed.
        kind: Name of the driver.
        options: For the driver.
    """

    spec: str
    kind: str
    options: Mapping[str, Any]

    @property
    def factory(self) -> str:
        """``package.module:factory`` of the driver."""
        return _point(self.kind).value

    def driver(self) -> Camera:
        """The driver itself, for use in this process; no I/O yet.

        Raises:
            ConfigError: it does not take these options.
        """
        try:
            camera: Camera = _point(self.kind).load()(**self.options)
        except (TypeError, ValueError) as error:
            raise ConfigError(f"The camera '{self.spec}' cannot be: {error}.", hint=_hint()) from error
        return camera


class OpenCamera(Protocol):
    """Async context manager: a camera at work, wherever it runs."""

    @property
    def ring(self) -> str:
        """Where its frames are; empty as long as it is lost."""
        ...

    @property
    def status(self) -> CameraStatus:
        """How it is going."""
        ...

    async def __aenter__(self) -> Self: ...

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    async def newest(self, after: int = -1, within: float = 0.0) -> Frame | None:
        """The newest frame with a higher sequence than ``after``, waited for ``within`` s."""
        ...


def camera_kinds() -> list[str]:
    """Names of the installed drivers, and the twin."""
    return sorted({point.name for point in entry_points(group=CAMERAS)} | {TWIN})


def _point(kind: str) -> EntryPoint:
    found = entry_points(group=CAMERAS, name=kind)
    if not found:
        raise ConfigError(f"There is no camera of kind '{kind}'.", hint=_hint())
    return next(iter(found))


def _hint() -> str:
    return f"Cameras: {', '.join(camera_kinds())}; such as uvc:0, /dev/video0, recording:game.zip or twin."


def parse_camera(spec: str) -> CameraSource:
    """What a specification asks for; nothing is opened.

    Raises:
        ConfigError: it names no camera, or an option that this one has not; the message lists what there is.
    """
    if spec.startswith(NODE_PORT):
        raise ConfigError(
            f"The frames of {spec} stay on its machine.",
            hint="Look there: kempelen see. A game sees through it by what it tells: "
            f"kempelen node arbiter --table {spec.removeprefix(NODE_PORT)} --sensor camera",
        )
    if match := _DEVICE.match(spec):
        spec = f"uvc:{match[1]}{spec[match.end() :]}"
    head, colon, rest = spec.partition(":")
    kind, *early = head.split(",")
    if kind not in camera_kinds():
        raise ConfigError(f"'{spec}' names no camera.", hint=_hint())
    subject, *options = _split(kind, rest) if colon else ("", *early)
    return CameraSource(spec, kind, _options(kind, subject, options))


def _split(kind: str, text: str) -> list[str]:
    """What follows the colon, and options; a file's name may hold commas, so that only options split it."""
    known = _KINDS.get(kind)
    names = "|".join(known.types) if known else ""
    return re.split(rf",(?=(?:{names})(?:=|,|$))" if names else _ANY_OPTION, text)


def _options(kind: str, subject: str, options: list[str]) -> dict[str, Any]:
    known = _KINDS.get(kind)
    if known is None:
        given = {"device": subject} if subject else {}
        return given | {name: value for name, _, value in (option.partition("=") for option in options)}
    if known.required and not subject:
        raise ConfigError(
            f"The camera '{kind}' needs a {known.subject}.", hint=f"{kind}:{known.subject.upper()}"
        )
    if subject and not known.subject:
        raise ConfigError(f"The camera '{kind}' has no '{subject}'.", hint=f"Write only {kind}.")
    out = {known.subject: _value(known.subject, subject, known.types[known.subject])} if subject else {}
    for option in options:
        name, equals, value = option.partition("=")
        if name not in known.types:
            raise ConfigError(
                f"The camera '{kind}' has no option '{name}'.",
                hint=f"It has: {', '.join(known.types) or 'none'}.",
            )
        out[name] = _value(name, value if equals else "true", known.types[name])
    return out


def _value(name: str, text: str, wanted: type) -> Any:
    if wanted is bool:
        if text not in {"true", "false"}:
            raise ConfigError(
                f"A camera's {name} is true or false, not '{text}'.", hint=f"Write {name}=true."
            )
        return text == "true"
    try:
        value = wanted(text)
    except ValueError:
        raise ConfigError(f"A camera's {name} is a number, not '{text}'.", hint=f"Write {name}=1.") from None
    if wanted is not str and not 0 <= value < float("inf"):
        raise ConfigError(f"A camera's {name} cannot be {text}.", hint="Numbers from 0 on.")
    return value


def open_camera(
    camera: str | CameraSource,
    config: Config | None = None,
    *,
    patient: bool = False,
    board: chess.Board | None = None,
) -> OpenCamera:
    """A camera to be entered: a driver in a process of its own, a ring, or a twin of our own.

    Args:
        camera: What was asked for.
        config: Of the twin's table.
        patient: Whether a camera that cannot be opened yet is waited for.
        board: What the twin's table is laid with; None: the start position.

    Raises:
        ConfigError: ``camera`` names none.
    """
    source = parse_camera(camera) if isinstance(camera, str) else camera
    if source.kind == TWIN:
        config = config or load_config(None)
        return TwinCamera(config, _over_the_twin(config, source), board or chess.Board())
    if source.kind == RING:
        return AttachedCamera(source.options["ring"], source.options.get("patience", 0.0))
    return CameraProcess(source.factory, source.options, patient=patient)


def open_view(config: Config, board: chess.Board, *, patient: bool = False) -> OpenCamera:
    """The configured camera, to be looked through outside of a game.

    Args:
        config: Which camera; on a twin also the table.
        board: What the twin's table is laid with.
        patient: As for `open_camera`.

    Raises:
        ConfigError: no camera is named, or there is none of that name.
    """
    if not config.camera_source:
        raise ConfigError("No camera is named.", hint="Name one: --camera uvc:0")
    return open_camera(config.camera_source, config, patient=patient, board=board)


def twin_camera(config: Config) -> CameraSpec | None:
    """The camera that a game's twin must have over its table; None when another one looks.

    Raises:
        ConfigError: there is no camera as configured.
    """
    if config.felt_only or not (config.on_twin and config.camera_source):
        return None
    source = parse_camera(config.camera_source)
    return _over_the_twin(config, source) if source.kind == TWIN else None


def _over_the_twin(config: Config, source: CameraSource) -> CameraSpec:
    """As configured, but for the model where one was typed."""
    model = source.options.get("model", config.twin.camera.model)
    if model not in MODELS:
        raise ConfigError(f"The twin has no camera of model '{model}'.", hint=f"It has: {', '.join(MODELS)}.")
    return config.twin.camera.model_copy(update={"model": model})


class TwinCamera:
    """Async context manager: a camera over a twin of its own, whose robot has stepped aside.

    Args:
        config: Of the table.
        camera: Over it.
        board: What stands on it.
    """

    def __init__(self, config: Config, camera: CameraSpec, board: chess.Board) -> None:
        sensor = config.sensor.model_copy(update={"kind": "camera"})
        robot = config.robot if config.on_twin else RobotConfig()
        twin = config.twin.model_copy(update={"speed": "max", "control": ""})
        self._config = config.model_copy(update={"sensor": sensor, "robot": robot, "twin": twin})
        self._spec = camera
        self._board = board
        self._stack = AsyncExitStack()
        self._camera: AttachedCamera | None = None
        self._ready = 0.0  # simulated time at which the robot had stepped aside

    @property
    def ring(self) -> str:
        """Where its frames are."""
        return self._camera.ring if self._camera is not None else ""

    @property
    def status(self) -> CameraStatus:
        """How it is going."""
        return self._camera.status if self._camera is not None else CameraStatus(CameraState.STARTING)

    async def __aenter__(self) -> Self:
        """Start the twin.

        Raises:
            KempelenError: it does not start, or its robot does not answer.
        """
        try:
            ring = await self._twin()
            self._camera = await self._stack.enter_async_context(AttachedCamera(ring, _TWIN_S))
        except BaseException:
            await self._stack.aclose()
            raise
        return self

    async def _twin(self) -> str:
        """Start it; the ring of its camera. A robot that nobody has homed would stand over the board."""
        folder = self._stack.enter_context(tempfile.TemporaryDirectory(prefix=CONTROL_FOLDER))
        table = self._config.build_table()
        layout, state = start_layout(table, self._board), Path(folder) / "table.json"
        session = await self._stack.enter_async_context(
            TableSession(self._config, table, layout, state=state, resume=False, camera=self._spec)
        )
        await session.hand.prepare()
        await session.hand.park(layout)
        ring = session.ring
        if session.control is not None:
            self._ready = float((await session.control.ask("truth"))["time_s"])
        return ring

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End it."""
        await self._stack.aclose()

    async def newest(self, after: int = -1, within: float = 0.0) -> Frame | None:
        """The newest frame with a higher sequence than ``after``, waited for ``within`` s.

        Raises:
            CameraError: it is not open, or its process has ended.
        """
        if self._camera is None:
            raise CameraError("The twin's camera is not open.", hint="Enter it first.")
        deadline = time.monotonic() + within
        while (frame := await self._camera.newest(after, within)) is not None:
            if frame.time >= self._ready:
                return frame
            after, within = frame.sequence, max(0.0, deadline - time.monotonic())
        return None
