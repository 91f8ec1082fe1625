"""What the configuration says where nobody does, by kind of robot: a small arm needs another table.

The models' own defaults are the gantry's.
"""

from collections.abc import Mapping
from typing import Any
from urllib.parse import quote

from pydantic import BaseModel

from kempelen.core.arm_table import (
    ARM_BOARD,
    ARM_GRIPPER,
    ARM_PIECES,
    ARM_SPACE,
    ARM_SQUARE,
    ARM_TRAYS,
    ARM_TURN_DEGREES,
)
from kempelen.core.errors import ConfigError

GANTRY = "gantry"
ARM = "arm"

SHAPED_BY_ROBOT = ("table", "pieces", "gripper", "planner")
"""Sections whose defaults depend on the kind of robot."""

_DEFAULTS: Mapping[str, Mapping[str, Any]] = {
    ARM: {
        "table": {
            "square": ARM_SQUARE,
            "board": ARM_BOARD,
            "turn_degrees": ARM_TURN_DEGREES,
            "space": ARM_SPACE.model_dump(),
            "trays": ARM_TRAYS,
        },
        "pieces": {"preset": ARM_PIECES},
        "gripper": ARM_GRIPPER.model_dump(),
        "planner": {"clearances": {"align": 1.0, "off_centre": 1.5}},
        "twin": {"scatter": 1.5},
    }
}


def of_robot(what: str, kind: str) -> str:
    """Name of a file that each kind of robot has for itself; whatever the kind is called, no path."""
    return what if kind == GANTRY else f"{what}-{quote(kind, safe='')}"


def require_same_robot(began: str, kind: str, game: int) -> None:
    """Refuse to go on with a game at another robot's table: its squares and trays are elsewhere.

    Args:
        began: The kind of robot that the game began with; empty for the first kind there was.
        kind: The one that is configured.
        game: Its number.

    Raises:
        ConfigError: they differ.
    """
    if (began or GANTRY) != kind:
        raise ConfigError(
            f"Game {game} began with a robot of kind '{began or GANTRY}', configured is '{kind}'.",
            hint=f"Go on with that one: kempelen resume {game} --robot {began or GANTRY}",
        )


def with_robot_defaults(content: Mapping[str, Any]) -> dict[str, Any]:
    """The content of a configuration with what its kind of robot asks for, where it says nothing itself."""
    said = {
        name: value.model_dump(exclude_unset=True) if isinstance(value, BaseModel) else value
        for name, value in content.items()
    }
    robot = said.get("robot")
    kind = robot.get("kind", GANTRY) if isinstance(robot, Mapping) else GANTRY
    return _filled(said, _DEFAULTS.get(kind, {})) if isinstance(kind, str) else said


def _filled(said: Mapping[str, Any], defaults: Mapping[str, Any]) -> dict[str, Any]:
    """``said``, and the defaults for what it leaves out, down to the last section."""
    out = dict(said)
    for key, value in defaults.items():
        if key not in out:
            out[key] = value
        elif isinstance(value, Mapping) and isinstance(out[key], Mapping):
            out[key] = _filled(out[key], value)
    return out
