"""Who was refused, and why: told by a node that has keys.

Zenoh knows, and tells nobody but its log, which it writes to descriptor 1 alone. So that one leads here while
a node runs, and its lines become sentences; the program's own output goes where it did.
"""

import contextlib
import os
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator

import zenoh

_REASONS = (
    (r"UnknownIssuer|BadSignature", "its certificate is of another authority"),
    (r"Expired|CertExpired|CertificateExpired", "a certificate has ended, its own or this machine's"),
    (r"NotValidYet", "its certificate is not valid yet: compare the clocks of both machines"),
    (r"UnknownCA|BadCertificate|DecryptError", "it does not trust this machine's authority"),
    (r"no certificates|CertificateRequired", "it has no certificate"),
    (r"corrupt message|eof|InvalidContentType", "it does not encrypt"),
)
_AGAIN_S = 60.0


def reason_in(line: str) -> str:
    """Why somebody was refused, from a line of zenoh's log; empty for other lines."""
    if "zenoh_link_tls" not in line or "Skipping name" in line:
        return ""
    return next((reason for pattern, reason in _REASONS if re.search(pattern, line)), "")


class Knocks:
    """Tells each reason at most once a minute: whoever is refused tries again and again.

    Args:
        tell: Takes a sentence.
        clock: s.
    """

    def __init__(self, tell: Callable[[str], None], clock: Callable[[], float] = time.monotonic) -> None:
        self._tell = tell
        self._clock = clock
        self._told: dict[str, float] = {}

    def hear(self, line: str) -> None:
        """A line of the log."""
        reason, now = reason_in(line), self._clock()
        if reason and now - self._told.get(reason, -_AGAIN_S) >= _AGAIN_S:
            self._told[reason] = now
            self._tell(f"Somebody was refused: {reason}.")


@contextlib.contextmanager
def told_of_knocks(tell: Callable[[str], None], *, keys: bool) -> Iterator[None]:
    """While a node runs.

    Args:
        tell: Takes a sentence, in a thread of its own.
        keys: Whether this machine has any; without, nobody is refused.
    """
    if not keys:
        yield
        return
    sys.stdout.flush()
    before, (reading, writing) = os.dup(1), os.pipe()
    os.dup2(writing, 1)
    os.close(writing)
    shown, own = sys.stdout, os.fdopen(before, "w", buffering=1, closefd=False)
    sys.stdout = own
    listener = threading.Thread(target=_listen, args=(reading, Knocks(tell)), daemon=True)
    listener.start()
    zenoh.init_log_from_env_or("off,zenoh_link_tls=warn")
    try:
        yield
    finally:
        os.dup2(before, 1)  # the pipe's last writer goes, and with it the listener
        listener.join()
        own.flush()
        sys.stdout = shown
        os.close(before)


def _listen(reading: int, knocks: Knocks) -> None:
    with os.fdopen(reading, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            knocks.hear(line)
