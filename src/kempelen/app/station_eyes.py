"""The eyes of a station: opened and closed, set by hand, recorded."""

from contextlib import suppress
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from kempelen.app.config import Config
from kempelen.app.config_change import changed
from kempelen.app.paths import recording_path
from kempelen.app.recorder import Recorder, Tape
from kempelen.app.station_robot import StationRobot
from kempelen.app.station_types import Change, Phase
from kempelen.core.errors import ConfigError, GameError, KempelenError
from kempelen.core.words import say
from kempelen.frames.attached import AttachedCamera
from kempelen.frames.recording import RecordingWriter

if TYPE_CHECKING:
    from kempelen.app.eyes import GameEyes

_ATTACH_S = 5.0


class StationEyes(StationRobot):
    """What a station does with its camera. See `kempelen.app.station.Station`."""

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self._tape: Tape | None = None

    async def _before_putting_away(self) -> None:
        await super()._before_putting_away()
        with suppress(KempelenError):
            await self._end_tape()

    @property
    def recording(self) -> str:
        """Name of what is being recorded to; empty for none."""
        return self._tape.name if self._tape is not None and self._tape.running else ""

    def _eyes(self) -> "GameEyes":
        if self.eyes is None:
            raise GameError(
                say("no_eyes", "Nothing looks at the board."),
                hint=say("switch_camera_on", "Switch the camera on, or connect one."),
            )
        return self.eyes

    async def set_eyes(self, *, on: bool) -> None:
        """Play by the camera or without; while nobody plays: open or close it.

        Raises:
            GameError: the game has no camera.
            ConfigError: none is configured.
            KempelenError: it cannot be opened.
        """
        if self.live is not None:
            self.live.require_eyes().switch(on=on)
            self._tell(Change.EYES)
            return
        if on and not self._config.camera_source:
            raise ConfigError(
                say("no_camera_named", "No camera is named."),
                hint=say("name_camera", "Name one in the configuration: camera.source"),
            )
        self.require_session()
        if on is (self.eyes is None):
            text = (
                say("busy_opening_camera", "Opening the camera …")
                if on
                else say("busy_closing_camera", "Closing the camera …")
            )
            await self._do(text, lambda: self._look(on=on), Phase.CONNECTING)

    async def _look(self, *, on: bool) -> None:
        await self._put_away()
        try:
            await self._set_up(look=on)
        except KempelenError:
            if on:
                with suppress(KempelenError):
                    await self._set_up()
            raise

    async def set_eye_parameter(self, name: str, value: float | None) -> None:
        """Override a parameter of the reader, also in games to come; None: what it takes by itself.

        Raises:
            GameError: nothing looks at the board.
            SensorError: no such parameter, or out of its range.
        """
        await self._eyes().eye.set(name, value)
        kept = {key: old for key, old in self._config.sensor.parameters.items() if key != name}
        parameters = kept if value is None else kept | {name: value}
        self._config = changed(self._config, {"sensor.parameters": parameters})
        self._tell(Change.EYES)

    async def record(self, *, on: bool) -> str:
        """Begin or end recording what the camera sees; the name of what is, or was, recorded to.

        Raises:
            GameError: nothing looks at the board.
            CameraError: the recording had ended by itself, for this reason.
        """
        if not on:
            return await self._end_tape()
        if self.recording:
            return self.recording
        camera = AttachedCamera(self._eyes().ring, _ATTACH_S)
        path = recording_path(self._config.data_dir, datetime.now(UTC))
        path.parent.mkdir(parents=True, exist_ok=True)
        recorder = Recorder(camera, RecordingWriter(path, "jpg", self._config.camera_source))
        self._tape = Tape(recorder, path.name, lambda: self._tell(Change.EYES))
        self._tell(Change.EYES)
        return path.name

    async def _end_tape(self) -> str:
        tape, self._tape = self._tape, None
        if tape is None:
            return ""
        await tape.end()
        return tape.name
