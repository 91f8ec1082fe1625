"""The same configuration with some values changed while the program runs."""

from collections.abc import Mapping

from pydantic import ValidationError

from kempelen.app.config import Config
from kempelen.app.config_errors import explain
from kempelen.core.errors import ConfigError


def changed(config: Config, values: Mapping[str, object]) -> Config:
    """The configuration with other values by dotted key (``"robot.port"``); those that are None are left out.

    Raises:
        ConfigError: a value is out of its range; the message names it.
    """
    given = {key: value for key, value in values.items() if value is not None}
    content = config.model_dump()
    for key, value in given.items():
        section, _, name = key.partition(".")
        content[section][name] = value
    try:
        return Config.model_validate(content)
    except ValidationError as error:
        raise ConfigError(explain(error, Config, "", "", given), hint="Give a value in that range.") from None
