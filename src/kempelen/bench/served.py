"""A page to look at: the server as its users start it, and the browser that shows it."""

import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from kempelen.core.errors import ConfigError, KempelenError

STARTS_S = 90.0
"""Longest wait for the server to answer: an idle machine needs about three."""
_ENDS_S = 30.0
_PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-dev-shm-usage",
)
"""Of a Chromium on a machine without a graphics card, where root runs it."""


def find_chromium() -> str:
    """The program: what ``KEMPELEN_CHROMIUM`` names, or what is installed.

    Raises:
        ConfigError: there is none.
    """
    named = os.environ.get("KEMPELEN_CHROMIUM", "")
    for name in [named] if named else _PROGRAMS:
        if (path := shutil.which(name)) is not None:
            return path
    what = f"There is no program {named}." if named else "There is no Chromium here."
    hint = "Install it (Debian: sudo apt install chromium), or name it in KEMPELEN_CHROMIUM."
    raise ConfigError(what, hint=hint)


class Served:
    """`kempelen serve` in a process of its own. Context manager: at its end the server has ended.

    Args:
        data: Its data directory.
        options: As typed after ``kempelen serve``.
        port: To serve on; 0: any.

    Raises:
        KempelenError: it does not answer.

    Attributes:
        link: With the operator's one-time token.
        origin: The page without it.
    """

    def __init__(self, data: Path, *options: str, port: int = 0) -> None:
        self._data = data
        self._options = options
        self._port = port
        self.link = ""
        self.origin = ""

    def __enter__(self) -> Self:
        """Start it, and wait until it answers."""
        handle, name = tempfile.mkstemp(prefix="kempelen-served-")
        self._errors = Path(name)
        command = [sys.executable, "-m", "kempelen", "serve", "--no-browser", "--port", str(self._port)]
        self._process = subprocess.Popen(
            [*command, "--data-dir", str(self._data), *self._options],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=handle,
            env={**os.environ, "COLUMNS": "200"},
        )
        os.close(handle)
        try:
            self.link = self._read_link()
        except BaseException:
            self.kill()
            raise
        self.origin = self.link.partition("/?")[0]
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """As Ctrl-C would."""
        self._process.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_ENDS_S)
        self.kill()

    def kill(self) -> None:
        """``kill -9``, if it still runs."""
        self._process.kill()
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._errors.unlink(missing_ok=True)

    @property
    def pid(self) -> int:
        """Of the server."""
        return self._process.pid

    @property
    def errors(self) -> str:
        """What went to its error output."""
        return self._errors.read_text(encoding="utf-8", errors="replace")

    def _read_link(self) -> str:
        said, deadline = b"", time.monotonic() + STARTS_S
        pipe = self._process.stdout
        while pipe is not None and (left := deadline - time.monotonic()) > 0:
            if not select.select([pipe], [], [], left)[0] or not (part := os.read(pipe.fileno(), 4096)):
                break
            said += part
            for line in said.split(b"\n")[:-1]:
                if b"/?token=" in line:
                    return line.decode().strip()
        raise KempelenError(f"The server did not start: {said.decode()} {self.errors}".strip())
