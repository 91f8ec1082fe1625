"""The arm that is configured: its parameter file, its bridge, whether its drift is kept in check."""

from dataclasses import dataclass
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from kempelen.app.config import Config
from kempelen.app.robot_defaults import ARM
from kempelen.core.errors import ConfigError
from kempelen.core.protocols import Options
from kempelen.kinematics import Arm, load_arm
from kempelen.twin.spec import ArmSpec


class _Choice(BaseModel):
    """What the app itself reads of ``[robot.options]``; the rest is the driver's."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    arm: str = Field(default="labvolt-5150", min_length=1, max_length=500)
    bridge: Literal["grblhal", "latch"] = "grblhal"
    drift_budget: bool = True


_APP_ONLY = ("drift_budget",)
"""What no driver knows."""


@dataclass(frozen=True, slots=True, eq=False)
class ArmSetup:
    """An arm as it is configured.

    Attributes:
        arm: Its model.
        source: Name or path of its parameter file.
        bridge: Which controller drives it: ``grblhal`` or ``latch``.
        drift_budget: Whether it is homed again before its error can spoil a grasp.
    """

    arm: Arm
    source: str
    bridge: Literal["grblhal", "latch"]
    drift_budget: bool


def arm_setup(config: Config) -> ArmSetup | None:
    """The arm that is configured; None where the robot is none.

    Raises:
        ConfigError: an option is wrong, there is no such arm, or its parameter file is wrong.
    """
    if config.robot.kind != ARM:
        return None
    try:
        choice = _Choice.model_validate(config.robot.options)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise ConfigError(
            f"Option '{first['loc'][0]}' of the arm is {first['input']!r}: {first['msg']}.",
            hint='Known: arm = NAME or FILE.toml, bridge = "grblhal" or "latch", drift_budget = true, false.',
        ) from None
    return ArmSetup(load_arm(choice.arm), choice.arm, choice.bridge, choice.drift_budget)


def driver_options(config: Config) -> Options:
    """What the driver is told of ``[robot.options]``."""
    if config.robot.kind != ARM:
        return config.robot.options
    return {key: value for key, value in config.robot.options.items() if key not in _APP_ONLY}


def arm_spec(config: Config) -> ArmSpec | None:
    """The arm of the twin as it truly is; None where the robot is none.

    Raises:
        ConfigError: as `arm_setup`.
    """
    setup = arm_setup(config)
    if setup is None:
        return None
    flaws = config.twin.flaws
    seeded = flaws.model_copy(update={"seed": flaws.seed or config.twin.seed})
    return ArmSpec(arm=setup.source, controller=setup.bridge, flaws=seeded)
