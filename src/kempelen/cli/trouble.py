"""Errors on the screen: what happened, then what to do."""

import logging
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from kempelen.core.errors import KempelenError

_SYSTEM = 1
_FAULT = 70  # EX_SOFTWARE of sysexits.h


def tell(error: KempelenError) -> None:
    """An error that explains itself, on standard error."""
    _print(type(error).__name__, error.message, error.hint)


def _print(kind: str, message: str, hint: str) -> None:
    console = Console(stderr=True)
    console.print(f"[bold red]{kind}[/]:", end=" ")
    console.print(message, markup=False, highlight=False, soft_wrap=True)
    if hint:
        console.print(hint, markup=False, highlight=False, soft_wrap=True, style="yellow")


class _Warnings(logging.Handler):
    """Passes warnings on as sentences, so that they do not tear the picture."""

    def __init__(self, say: Callable[[str], None]) -> None:
        super().__init__(logging.WARNING)
        self._say = say

    def emit(self, record: logging.LogRecord) -> None:
        """One line, with the error behind it."""
        why = f": {record.exc_info[1]}" if record.exc_info and record.exc_info[1] else "."
        self._say(f"Warning: {record.getMessage().rstrip('.')}{why}")


@contextmanager
def told_of_warnings(say: Callable[[str], None]) -> Iterator[None]:
    """Whatever is logged as a warning or worse is said."""
    handler = _Warnings(say)
    logging.getLogger().addHandler(handler)
    try:
        yield
    finally:
        logging.getLogger().removeHandler(handler)


def tell_fault(error: Exception) -> int:
    """What nobody foresaw: one sentence, the traceback in a file. Returns the exit code."""
    if isinstance(error, OSError) and error.filename is not None:
        _print(
            "SystemError",
            f"{error.filename}: {error.strerror}.",
            "Check the path, its permissions and the disk's free space; `kempelen doctor` looks at them too.",
        )
        return _SYSTEM
    kept = _keep(error)
    _print(
        "Fault",
        f"Kempelen made a mistake: {type(error).__name__}: {error}. Its trace is kept in {kept}.",
        "Please report it with that file. A game that was running is kept: kempelen resume",
    )
    return _FAULT


def _keep(error: Exception) -> Path | str:
    lines = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="kempelen-fault-", suffix=".txt", delete=False, encoding="utf-8"
        ) as file:
            file.write(lines)
    except OSError:
        return f"no file, since none can be written:\n{lines}"
    return Path(file.name)
