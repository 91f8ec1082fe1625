"""The configuration: one TOML file into frozen, bounded, documented models.

The defaults describe the twin, so no file is needed. Every key is documented on its model; ``kempelen
config`` prints them all. A key that nobody knows is an error. Calibration is no configuration: it has its own
file. What the web page changes of the table stands in another one, see `kempelen.app.table_file`.
"""

import os
import tomllib
from collections.abc import Mapping
from math import radians
from pathlib import Path
from typing import Annotated, Any, Literal

from platformdirs import user_config_path, user_data_path
from pydantic import Field, ValidationError, field_validator, model_validator

from kempelen.app.config_errors import explain
from kempelen.app.config_network import NetworkConfig
from kempelen.app.config_pieces import PiecesConfig, Section
from kempelen.app.robot_defaults import ARM, GANTRY, of_robot, with_robot_defaults
from kempelen.app.table_file import read_table_file
from kempelen.core.calibration import SQUARE_RANGE, Calibration
from kempelen.core.errors import ConfigError
from kempelen.core.geometry import Transform
from kempelen.core.table import DEFAULT_TRAYS, Gripper, Table, Tray, WorkSpace
from kempelen.motion.scene import Clearances
from kempelen.twin.cameras.settings import CameraSpec
from kempelen.twin.flaws import ArmFlaws
from kempelen.twin.reed.settings import ReedSpec

PROGRAM = "kempelen"
DATA_DIR_VARIABLE = "KEMPELEN_DATA_DIR"
SENSOR_VARIABLE = "KEMPELEN_SENSOR"
TWIN_PORT = "twin"
NODE_PORT = "node:"
"""Before a table's name: the robot is at another machine's node."""
_REED = "reed"
_SENSES = frozenset({"camera", "depth", "colour", _REED})

Scalar = bool | int | float | str
_CLEAR_OF_THE_VIEW = 60.0
"""mm beyond the board's side: half a square that must be free of hands, and half the gantry's beam."""
_ARM_STRAYS = 6.0  # mm
_Coordinate = Annotated[float, Field(ge=-5000, le=5000)]


class RobotConfig(Section):
    """The machine and the wire to it.

    Attributes:
        kind: Name of the driver: "gantry", "arm", or that of an installed one.
        port: "twin" for the simulated machine, a device such as "/dev/ttyUSB0", or "socket://host:port".
        options: What the driver itself wants to know; its page lists the keys.
    """

    kind: Annotated[str, Field(min_length=1, max_length=60)] = GANTRY
    port: Annotated[str, Field(min_length=1, max_length=300)] = TWIN_PORT
    options: dict[str, Scalar] = Field(default_factory=dict)


class TableConfig(Section):
    """Where things stand. A calibration, once made, overrules the board's position and square.

    Attributes:
        square: Side of a square, mm.
        board: Where a1's outer corner is in the robot's frame: x, y, z, mm.
        turn_degrees: Turn of the board about the vertical, degrees; 0 has the first rank along the robot's x.
        space: What the tool point can reach, and how fast.
        trays: Where pieces stand beside the board.
    """

    square: Annotated[float, Field(ge=SQUARE_RANGE[0], le=SQUARE_RANGE[1])] = 50.0
    board: tuple[_Coordinate, _Coordinate, _Coordinate] = (150.0, 25.0, 0.0)
    turn_degrees: Annotated[float, Field(ge=-180, le=180)] = 0.0
    space: WorkSpace = Field(default_factory=WorkSpace)
    trays: Annotated[tuple[Tray, ...], Field(max_length=8)] = DEFAULT_TRAYS


class EngineConfig(Section):
    """The program that thinks.

    Attributes:
        path: A path, a name on PATH, "maia-1500", "cluster", or empty for the best at hand. It may speak UCI
            or xboard.
        level: "1" to "20", an Elo such as "1500", "maia-1500", "adaptive", or "full".
        move_time: Time for each move, s.
        threads: Of its search.
        hash_mb: Memory for its table of positions, MB.
        depth: Half-moves that it looks ahead at most; 0 for as far as the time allows.
        book: An opening book: "people" for the one that comes along, or a PolyGlot file; empty for none.
        ponder: Whether it thinks on while the other side does.
        voters: How many searches a cluster makes of one position.
        options: Further options of the engine, by their own names.
    """

    path: Annotated[str, Field(max_length=1000)] = ""
    level: Annotated[str, Field(min_length=1, max_length=20)] = "full"
    move_time: Annotated[float, Field(ge=0.01, le=3600)] = 1.0
    threads: Annotated[int, Field(ge=1, le=512)] = 1
    hash_mb: Annotated[int, Field(ge=1, le=65536)] = 64
    depth: Annotated[int, Field(ge=0, le=200)] = 0
    book: Annotated[str, Field(max_length=1000)] = ""
    ponder: bool = False
    voters: Annotated[int, Field(ge=1, le=64)] = 4
    options: dict[str, Scalar] = Field(default_factory=dict)


class PlannerConfig(Section):
    """How pieces are carried over the others.

    Attributes:
        name: "asynchronous" (fastest), "safe-height" or "supercover" (baselines).
        clearances: How far to stay away.
    """

    name: Literal["asynchronous", "safe-height", "supercover"] = "asynchronous"
    clearances: Clearances = Field(default_factory=Clearances)


class CameraConfig(Section):
    """The camera that looks at the board.

    Attributes:
        source: Which: "twin", "uvc:0", "realsense", "kinect2", "azure", "recording:PATH", with options as in
            "uvc:0,width=1280"; empty for the twin's own on the twin, and for none on a machine.
    """

    source: Annotated[str, Field(max_length=300)] = ""


class SensorConfig(Section):
    """How the board is read.

    Attributes:
        kind: "camera", "none", or "auto": a camera wherever there is one, and always on the twin. Or what is
            to be put together, with commas between: "depth", "colour" (of the camera), "reed" (the board);
            "reed:PORT" names the board's port at once.
        method: "both", "depth" or "colour".
        port: The reed board's, such as "/dev/ttyUSB1" or "socket://host:port"; empty for the twin's own on
            the twin, and else for the only one that answers.
        centred: How far from the centre of its square a piece may stand after a move, mm.
        parameters: Of the reader, set by hand; `kempelen see` shows them all.
    """

    kind: Annotated[str, Field(max_length=300)] = "auto"
    method: Literal["both", "depth", "colour"] = "both"
    port: Annotated[str, Field(max_length=300)] = ""
    centred: Annotated[float, Field(gt=0, le=50)] = 8.0
    parameters: dict[str, float] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _with_port(cls, given: Any) -> Any:
        """``reed:PORT`` among the kinds is the kind and the port."""
        kinds = given.get("kind") if isinstance(given, dict) else None
        if not isinstance(kinds, str) or f"{_REED}:" not in kinds:
            return given
        words = kinds.split(",")
        ports = [word.partition(":")[2] for word in words if word.startswith(f"{_REED}:")]
        plain = [_REED if word.startswith(f"{_REED}:") else word for word in words]
        return {**given, "kind": ",".join(plain), "port": ports[-1] if ports else given.get("port", "")}

    @field_validator("kind")
    @classmethod
    def _known(cls, kind: str) -> str:
        words = kind.split(",")
        if kind in {"auto", "none"} or (set(words) <= _SENSES and len(set(words)) == len(words)):
            return kind
        known = "camera, depth, colour and reed (or reed:PORT)"
        raise ValueError(f"must be auto, none, or of {known}, with commas between")

    @property
    def _senses(self) -> frozenset[str]:
        return frozenset(self.kind.split(","))

    @property
    def camera(self) -> bool | None:
        """Whether a camera reads the board; None: where there is one."""
        return None if self.kind == "auto" else bool(self._senses & {"camera", "depth", "colour"})

    @property
    def reed(self) -> bool:
        """Whether the reed board does."""
        return _REED in self._senses

    @property
    def use(self) -> Literal["both", "depth", "colour"]:
        """Of the camera's pictures."""
        only = self._senses & {"depth", "colour"}
        if len(only) == 1 and "camera" not in self._senses:
            return "depth" if "depth" in only else "colour"
        return self.method


class TwinConfig(Section):
    """The simulated table.

    Attributes:
        seed: Of everything random in it.
        speed: Time scale, 1 is real time; "max" is as fast as the computer can.
        scatter: How far from the centre of its place a piece may stand at the start, mm.
        baud: Speed of the serial line to model, bit/s; 0 for one without delay.
        control: Control socket of a twin that was started separately and answers at the robot's port, so that
            reports have its ground truth; empty for none.
        camera: Over it, when it is looked at.
        reed: Under its squares, when it is felt.
        flaws: Of a simulated arm: how it differs from its parameter file, and how much it drifts.
    """

    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    speed: Annotated[float, Field(gt=0, le=1000)] | Literal["max"] = 1.0
    scatter: Annotated[float, Field(ge=0, le=6)] = 3.0
    baud: Annotated[int, Field(ge=0, le=10_000_000)] = 0
    control: Annotated[str, Field(max_length=200)] = ""
    camera: CameraSpec = Field(default_factory=CameraSpec)
    reed: ReedSpec = Field(default_factory=ReedSpec)
    flaws: ArmFlaws = Field(default_factory=ArmFlaws)


class PlayConfig(Section):
    """How a person plays.

    Attributes:
        side: The person's colour, "white" or "black".
        hands: Who carries the person's pieces, "robot", "person", or "auto": the person, if a sensor sees it.
    """

    side: Literal["white", "black"] = "white"
    hands: Literal["auto", "robot", "person"] = "auto"


class DataConfig(Section):
    """Where games and calibrations are kept.

    Attributes:
        dir: The directory; empty for the system's usual place.
    """

    dir: Annotated[str, Field(max_length=1000)] = ""


class Config(Section):
    """Everything that can be configured; table, pieces and gripper as the kind of robot needs them."""

    robot: RobotConfig = Field(default_factory=RobotConfig)
    table: TableConfig = Field(default_factory=TableConfig)
    pieces: PiecesConfig = Field(default_factory=PiecesConfig)
    gripper: Gripper = Field(default_factory=Gripper)
    engine: EngineConfig = Field(default_factory=EngineConfig)
    planner: PlannerConfig = Field(default_factory=PlannerConfig)
    twin: TwinConfig = Field(default_factory=TwinConfig)
    play: PlayConfig = Field(default_factory=PlayConfig)
    camera: CameraConfig = Field(default_factory=CameraConfig)
    sensor: SensorConfig = Field(default_factory=SensorConfig)
    data: DataConfig = Field(default_factory=DataConfig)
    network: NetworkConfig = Field(default_factory=NetworkConfig)

    @model_validator(mode="before")
    @classmethod
    def _as_its_robot_needs(cls, content: Any) -> Any:
        return with_robot_defaults(content) if isinstance(content, Mapping) else content

    @property
    def on_twin(self) -> bool:
        """Whether the machine is the simulated one."""
        return self.robot.port == TWIN_PORT

    @property
    def camera_source(self) -> str:
        """Which camera is to be used; empty for none."""
        return self.camera.source or (TWIN_PORT if self.on_twin else "")

    @property
    def has_eyes(self) -> bool:
        """Whether the board is looked at, or felt."""
        return self.has_camera or self.sensor.reed

    @property
    def has_camera(self) -> bool:
        """Whether a camera looks at the board."""
        return bool(self.camera_source) if self.sensor.camera is None else self.sensor.camera

    @property
    def felt_only(self) -> bool:
        """Whether the reed board alone tells what stands there."""
        return self.sensor.reed and not self.has_camera

    @property
    def twin_reed(self) -> ReedSpec | None:
        """The reed board that the twin must have; None for none, or for one elsewhere."""
        return self.twin.reed if self.sensor.reed and not self.sensor.port else None

    @property
    def hands(self) -> Literal["robot", "person"]:
        """Who carries a person's pieces."""
        if self.play.hands == "auto":
            return "person" if self.has_eyes else "robot"
        return self.play.hands

    @property
    def data_dir(self) -> Path:
        """Where games and calibrations are kept; it may not exist yet."""
        return Path(self.data.dir).expanduser() if self.data.dir else user_data_path(PROGRAM)

    @property
    def calibration_path(self) -> Path:
        """The calibration's own file; each robot, and the twin of each, has its own."""
        return self._of_this_robot("calibration")

    @property
    def camera_calibration_path(self) -> Path:
        """Where it is kept how the camera sees the robot's frame; robots and twins apart as well."""
        return self._of_this_robot("camera")

    @property
    def arm_calibration_path(self) -> Path:
        """Where it is kept how an arm differs from its parameter file."""
        return self._of_this_robot("joints")

    def _of_this_robot(self, what: str) -> Path:
        return self.data_dir / f"{of_robot(what, self.robot.kind)}{'-twin' if self.on_twin else ''}.json"

    def _aside(self, square: float) -> float:
        """An arm has no beam beside its hand; the half square around the board is the camera's.

        Where an arm has drifted, and with the broad edges that a depth camera gives it, it may be farther in.
        """
        return square / 2 + _ARM_STRAYS if self.robot.kind == ARM else _CLEAR_OF_THE_VIEW

    def build_table(self, calibration: Calibration | None = None) -> Table:
        """The table: as configured, or with the board where the calibration found it."""
        board = self.table
        return Table(
            robot_from_board=(
                calibration.robot_from_board
                if calibration
                else Transform.about_z(radians(board.turn_degrees), board.board)
            ),
            square=calibration.square if calibration else board.square,
            trays=board.trays,
            pieces=self.pieces.piece_set(),
            gripper=self.gripper,
            space=board.space,
            aside=self._aside(board.square) if self.has_camera else 0.0,
        )


def default_config_path() -> Path:
    """Where the configuration is looked for when none is named."""
    return user_config_path(PROGRAM) / "config.toml"


def load_config(path: Path | None = None, overrides: Mapping[str, object] | None = None) -> Config:
    """Read the configuration.

    Args:
        path: The file; None for the one at `default_config_path`, if there is one.
        overrides: Values by dotted key (``"robot.port"``), stronger than the files and the environment; those
            that are None are left out.

    Raises:
        ConfigError: no such file, not TOML, unknown keys, values out of range: all of them at once, each with
            its line, the allowed range, and the nearest known key.
    """
    text, where = _read(path)
    content = _parse(text, where)
    for variable, key in ((DATA_DIR_VARIABLE, "data.dir"), (SENSOR_VARIABLE, "sensor.kind")):
        if said := os.environ.get(variable):
            _put(content, key, said)
    given = {key: value for key, value in (overrides or {}).items() if value is not None}
    for key, value in given.items():
        _put(content, key, value)
    config = _checked(content, text, where, given)
    saved = read_table_file(config.data_dir, config.robot.kind)
    for key, value in {**saved.content, **given}.items():
        _put(content, key, value)
    return _checked(content, saved.text, saved.where, given) if saved.content else config


def _checked(content: dict[str, Any], text: str, where: str, given: Mapping[str, object]) -> Config:
    try:
        return Config.model_validate(content)
    except ValidationError as error:
        raise ConfigError(
            explain(error, Config, text, where, given), hint="See every key and its default: kempelen config"
        ) from None


def _read(path: Path | None) -> tuple[str, str]:
    """The file's text and name; empty when there is no default file."""
    file = path or default_config_path()
    try:
        return file.read_text(encoding="utf-8"), str(file)
    except FileNotFoundError:
        if path is None:
            return "", ""
        raise ConfigError(
            f"There is no configuration file {file}.", hint="Make one: kempelen config > kempelen.toml"
        ) from None
    except UnicodeDecodeError as error:
        raise ConfigError(
            f"The configuration {file} is not UTF-8 text: byte {error.start} is "
            f"{error.object[error.start]:#x}.",
            hint="Save it as UTF-8.",
        ) from None
    except OSError as error:
        message = f"The configuration {file} cannot be read: {error.strerror}."
        raise ConfigError(message, hint="Name a TOML file that you may read.") from None


def _parse(text: str, where: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigError(f"The configuration {where} is not TOML: {error}.", hint="Mend it.") from None


def _put(content: dict[str, Any], key: str, value: object) -> None:
    """Set a dotted key, unless a part of the path is no section: that error is the model's to tell."""
    *sections, last = key.split(".")
    for section in sections:
        inner = content.setdefault(section, {})
        if not isinstance(inner, dict):
            return
        content = inner
    content[last] = value
