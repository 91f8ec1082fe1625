"""The table as it was last entered in the web page: ``table.toml`` in the data directory, or that of a robot.

It holds the side of the squares, the trays and the pieces, in the words of the configuration, and is stronger
than the configuration file: whoever used the page meant the table that stands there. The command line is
stronger still. Delete the file, and the configuration counts again.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kempelen.app.robot_defaults import of_robot
from kempelen.core.errors import ConfigError

_HOLDS: Mapping[str, tuple[str, ...]] = {"table": ("square", "trays"), "pieces": ()}
"""Its sections; of the first only these keys."""


@dataclass(frozen=True, slots=True)
class TableFile:
    """What it says.

    Attributes:
        content: By dotted key; empty when there is none.
        text: The file.
        where: Its name, for messages.
    """

    content: Mapping[str, Any] = field(default_factory=dict)
    text: str = ""
    where: str = ""


def table_file(data_dir: Path, kind: str) -> Path:
    """Where it is kept for that kind of robot."""
    return data_dir / f"{of_robot('table', kind)}.toml"


def read_table_file(data_dir: Path, kind: str) -> TableFile:
    """Read it, if it is there; values are the configuration's to check.

    Raises:
        ConfigError: unreadable, not TOML, or it holds something else.
    """
    path = table_file(data_dir, kind)
    try:
        text = path.read_text(encoding="utf-8")
        return TableFile(_content(tomllib.loads(text), path), text, str(path))
    except (FileNotFoundError, NotADirectoryError):
        return TableFile()
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}.", hint="Allow reading it.") from None
    except (ValueError, RecursionError) as error:  # TOML, and text that is none
        raise ConfigError(
            f"{path} is damaged: {error}.", hint="Delete it, and enter the table again in the page."
        ) from None


def _content(said: Mapping[str, Any], path: Path) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for section, value in said.items():
        keys = _HOLDS.get(section)
        unknown = keys is None or (keys and (not isinstance(value, dict) or set(value) - set(keys)))
        if unknown:
            raise ConfigError(
                f"{path}: '{section}' holds what does not belong there.",
                hint="It may have table.square, table.trays and pieces; all else is in the configuration.",
            )
        found |= {f"{section}.{key}": value[key] for key in value} if keys else {section: value}
    return found
