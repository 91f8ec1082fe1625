"""The same configuration with some values changed while the program runs."""

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from kempelen.app.config import Config, RobotConfig
from kempelen.app.config_errors import explain
from kempelen.app.robot_defaults import SHAPED_BY_ROBOT
from kempelen.app.table_file import read_table_file
from kempelen.core.errors import ConfigError


def changed(config: Config, values: Mapping[str, object]) -> Config:
    """The configuration with other values by dotted key (``"robot.port"``); those that are None are left out.

    Raises:
        ConfigError: a value is out of its range; the message names it.
    """
    given = {key: value for key, value in values.items() if value is not None}
    return _with(config.model_dump(), given)


def for_robot(config: Config, kind: str, known: Config | None = None) -> Config:
    """The configuration for another kind of robot, whose table is another one.

    Args:
        config: All else.
        kind: Of the robot.
        known: A configuration in which that robot was used before; None: its table is as it was entered in
            the page, or by default.

    Raises:
        ConfigError: the file of its table cannot be read, or says what cannot be.
    """
    if kind == config.robot.kind:
        return config
    if known is not None:
        same = {name: getattr(known, name) for name in SHAPED_BY_ROBOT}
        return config.model_copy(update={**same, "robot": known.robot})
    content = config.model_dump(exclude=set(SHAPED_BY_ROBOT))
    content["robot"]["options"] = {}
    if config.twin.scatter == Config(robot=RobotConfig(kind=config.robot.kind)).twin.scatter:
        del content["twin"]["scatter"]
    return _with(content, {"robot.kind": kind, **read_table_file(config.data_dir, kind).content})


def _with(content: dict[str, Any], given: Mapping[str, object]) -> Config:
    for key, value in given.items():
        section, _, name = key.partition(".")
        if name:
            content.setdefault(section, {})[name] = value
        else:
            content[section] = value
    try:
        return Config.model_validate(content)
    except ValidationError as error:
        raise ConfigError(explain(error, Config, "", "", given), hint="Give a value in that range.") from None
