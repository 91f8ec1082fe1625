"""The arm's options in the configuration file."""

from typing import Annotated, Literal

from pydantic import Field

from kempelen.core.protocols import Options
from kempelen.robots.grbl.options import GantryOptions, checked_options


class ArmOptions(GantryOptions):
    """What an arm can be told, beside what a gantry can.

    Attributes:
        arm: Name or path of its parameter file, see `kempelen.kinematics.load_arm`.
        bridge: ``grblhal`` (grblHAL or FluidNC, axes X Y Z A B) or ``latch`` (the older machine's serial
            bridge).
        most_lost_steps: How many steps a motor may be found to have lost before it is an error.
    """

    arm: Annotated[str, Field(min_length=1, max_length=500)] = "labvolt-5150"
    bridge: Literal["grblhal", "latch"] = "grblhal"
    most_lost_steps: int = Field(default=40, ge=0, le=10_000)


def read_options(options: Options) -> ArmOptions:
    """Check the options.

    Raises:
        ConfigError: an unknown option, or a value out of range.
    """
    return checked_options(ArmOptions, options, "arm")
