"""From received bytes to lines: no spaces, no comments, upper case, at most 79 characters."""

from typing import Any

from kempelen.twin.grbl.settings import MAX_LINE

_DROPPED = bytes(range(33)) + b"/"
_UPPER = bytes(c - 32 if 97 <= c <= 122 else c for c in range(256))  # noqa: PLR2004 - a to z
_COMMENTS = frozenset(b"();")
_OPEN, _CLOSE, _REST = b"();"


class LineReader:
    """The line buffer."""

    __slots__ = ("_comment", "_overflow", "_rest", "_text")

    def __init__(self) -> None:
        self._text = bytearray()
        self._overflow = False
        self._comment = False  # within parentheses
        self._rest = False  # after a semicolon

    def take(self, ring: bytearray) -> tuple[str, bool] | None:
        """Consume a line: its text and whether it was too long; None when its end is still to come."""
        newline, end = ring.find(b"\n"), ring.find(b"\r")
        if newline >= 0 and (end < 0 or newline < end):
            end = newline
        if end < 0:
            self._collect(bytes(ring))
            ring.clear()
            return None
        self._collect(bytes(ring[:end]))
        del ring[: end + 1]
        line = self._text.decode("latin-1"), self._overflow
        self._text.clear()
        self._overflow = self._comment = self._rest = False
        return line

    def _collect(self, raw: bytes) -> None:
        if self._overflow or self._comment or self._rest or not _COMMENTS.isdisjoint(raw):
            self._collect_slowly(raw)
            return
        self._text += raw.translate(_UPPER, _DROPPED)
        if len(self._text) > MAX_LINE:
            del self._text[MAX_LINE:]
            self._overflow = True

    def _collect_slowly(self, raw: bytes) -> None:
        """Byte by byte, because of comments."""
        for byte in raw:
            if self._overflow or self._comment or self._rest:
                if byte == _CLOSE:
                    self._comment = False
            elif byte == _OPEN:
                self._comment = True
            elif byte == _REST:
                self._rest = True
            elif byte not in _DROPPED:
                if len(self._text) == MAX_LINE:
                    self._overflow = True
                else:
                    self._text.append(_UPPER[byte])

    def snapshot(self) -> list[Any]:
        """JSON-able."""
        return [self._text.decode("latin-1"), self._overflow, self._comment, self._rest]

    def restore(self, state: list[Any]) -> None:
        """The inverse of `snapshot`."""
        text, self._overflow, self._comment, self._rest = state
        self._text = bytearray(text.encode("latin-1"))
