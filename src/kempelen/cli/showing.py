"""How a game is shown, and what is told of it."""

from dataclasses import dataclass
from pathlib import Path

from kempelen.core.errors import ConfigError


@dataclass(frozen=True)
class Showing:
    """What is told of a game.

    Attributes:
        report: File for the report.
        plain: Lines instead of a picture.
    """

    report: Path | None = None
    plain: bool = False

    def __post_init__(self) -> None:
        """Find out before the game whether its report can be written after it."""
        if self.report is not None:
            require_writable(self.report)


def require_directory(path: Path) -> None:
    """A directory, or none yet.

    Raises:
        ConfigError: something else is there.
    """
    if path.exists() and not path.is_dir():
        raise ConfigError(
            f"The data directory {path} is no directory.", hint="Name another one with --data-dir."
        )


def require_writable(path: Path) -> None:
    """Make the directory of a file that is to be written, and try.

    Raises:
        ConfigError: it is a directory, or may not be written.
    """
    try:
        new = not path.exists()
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8"):
            pass
        if new:
            path.unlink()
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be written: {error.strerror or error}.",
            hint="Name a file in a directory that you may write to.",
        ) from None
