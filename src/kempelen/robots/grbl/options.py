"""The gantry's options in the configuration file."""

from typing import Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from kempelen.core.errors import ConfigError
from kempelen.core.protocols import Options
from kempelen.robots.grbl.gcode import GripperWiring

Kind = TypeVar("Kind", bound=BaseModel)


class GantryOptions(BaseModel):
    """What a GRBL gantry can be told.

    Attributes:
        baud: Of the serial line, bits/s.
        gripper: ``coolant`` (M8 opens, M9 closes) or ``servo`` (``M3 S``).
        servo_open: S value that opens the servo gripper.
        servo_closed: S value that closes it.
        apply_settings: Write the controller's settings that do not fit instead of refusing them.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    baud: int = Field(default=115200, ge=1200, le=4_000_000)
    gripper: Literal["coolant", "servo"] = "coolant"
    servo_open: float = Field(default=200.0, ge=0, le=10_000)
    servo_closed: float = Field(default=800.0, ge=0, le=10_000)
    apply_settings: bool = False

    @property
    def wiring(self) -> GripperWiring:
        """Of the gripper."""
        if self.gripper == "coolant":
            return GripperWiring()
        return GripperWiring.servo(self.servo_open, self.servo_closed)


def read_options(options: Options) -> GantryOptions:
    """Check the options.

    Raises:
        ConfigError: an unknown option, or a value out of range.
    """
    return checked_options(GantryOptions, options, "gantry")


def checked_options(kind: type[Kind], options: Options, robot: str) -> Kind:
    """Options as a model of theirs.

    Raises:
        ConfigError: an unknown option, or a value out of range.
    """
    try:
        return kind.model_validate(dict(options))
    except ValidationError as error:
        problems = "; ".join(
            f"{'.'.join(map(str, problem['loc']))} = {problem['input']!r}: {problem['msg']}"
            for problem in error.errors()
        )
        raise ConfigError(
            f"Options of the {robot}: {problems}.", hint=f"Known: {', '.join(kind.model_fields)}."
        ) from None
