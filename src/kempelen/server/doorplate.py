"""Where the server of a data directory is, for programs of the same user: a file that they alone can read."""

import fcntl
import json
import os
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from kempelen.app.files import replace_file
from kempelen.core.errors import ConfigError

FILE_NAME = "server.json"


@dataclass(frozen=True)
class Address:
    """What stands on it.

    Attributes:
        origin: Of the server.
        session: Of an operator.
        certificate: File of the server's own certificate; empty without TLS.
    """

    origin: str
    session: str
    certificate: str


class Doorplate:
    """Context manager: only one server has a data directory; the file is there while it answers.

    Args:
        directory: Of the data.

    Raises:
        ConfigError: another server has it, or nothing can be written there.
    """

    def __init__(self, directory: Path) -> None:
        self._path = directory / FILE_NAME

    def __enter__(self) -> Self:
        """Keep others out; the kernel lets go when this process dies, however it dies."""
        lock = self._path.with_suffix(".lock")
        try:
            lock.parent.mkdir(parents=True, exist_ok=True)
            self._lock = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise ConfigError(
                f"Nothing can be written to {lock.parent}: {error.strerror}.",
                hint="Name another data directory with --data-dir.",
            ) from None
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._lock)
            raise ConfigError(
                f"A server for {self._path.parent} is running already.",
                hint="Get a link to it: kempelen remote link. Or use another one: --data-dir.",
            ) from None
        self._path.unlink(missing_ok=True)  # of one that was killed
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Take it off."""
        self._path.unlink(missing_ok=True)
        os.close(self._lock)

    def put(self, origin: str, session: str, certificate: str) -> None:
        """The server answers."""
        kept = {"origin": origin, "session": session, "certificate": certificate}
        replace_file(self._path, json.dumps(kept) + "\n", private=True)


def read(directory: Path) -> Address:
    """The address of the server that has this data directory.

    Raises:
        ConfigError: none has.
    """
    try:
        kept = json.loads((directory / FILE_NAME).read_text(encoding="utf-8"))
        return Address(str(kept["origin"]), str(kept["session"]), str(kept["certificate"]))
    except (OSError, ValueError, KeyError, TypeError):
        raise ConfigError(
            f"No server is running for {directory}.",
            hint="Start one: kempelen serve. Or name another data directory with --data-dir.",
        ) from None
