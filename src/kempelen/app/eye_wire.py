"""Messages between the program and its eye: a line of JSON each, and for pictures and numbers bytes after it.

========= =============================================== ====================================================
sent by   op                                              fields
========= =============================================== ====================================================
program   ``begin``: first of all                         use, overrides, square, side, usual
program   ``ring``: where frames come from                name (empty: nowhere), message
program   ``expect``: what stands on the board            fen (board part; empty: nobody knows)
program   ``mark``: from here on frames count as fresh    mark
program   ``look again``: forget where the board is
program   ``ask``: an answer is wanted                    number, what (view, sighting, parameters, set), ...
eye       ``seen``: an observation                        mark, time, sight, message, arrays; numbers
eye       ``answer``                                      number, error or fields; for a view a PNG file,
                                                          for one with ``ground`` and ``layers`` a JPEG file
========= =============================================== ====================================================

The end of the pipe is the end of the other side.
"""

import asyncio
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.senses import Observation, Sight

LONGEST_LINE = 1 << 20
_ARRAYS = ("log_likelihood", "heights", "offsets", "kinds")


@dataclass(frozen=True, slots=True)
class Note:
    """One message.

    Attributes:
        op: What it is.
        fields: What it says.
        data: Bytes that belong to it.
    """

    op: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    data: bytes = b""

    def encode(self) -> bytes:
        """As it is sent."""
        head = json.dumps({"op": self.op, "bytes": len(self.data), **self.fields})
        return head.encode() + b"\n" + self.data

    @classmethod
    def _head(cls, line: bytes) -> tuple[str, int, dict[str, Any]]:
        fields: dict[str, Any] = json.loads(line)
        return str(fields.pop("op")), int(fields.pop("bytes", 0)), fields

    @classmethod
    def read(cls, stream: BinaryIO) -> "Note | None":
        """The next one of a blocking stream; None at its end."""
        line = stream.readline()
        if not line.endswith(b"\n"):
            return None
        op, size, fields = cls._head(line)
        return cls(op, fields, stream.read(size))

    @classmethod
    async def receive(cls, stream: asyncio.StreamReader) -> "Note | None":
        """The next one; None at the stream's end."""
        line = await stream.readline()
        if not line.endswith(b"\n"):
            return None
        op, size, fields = cls._head(line)
        try:
            return cls(op, fields, await stream.readexactly(size))
        except asyncio.IncompleteReadError:
            return None


def seen(observation: Observation, mark: int) -> Note:
    """An observation as a message.

    Args:
        observation: To send.
        mark: Of the last mark before whose coming the frame cannot have been taken.
    """
    arrays = {name: getattr(observation, name) for name in _ARRAYS}
    known = {name: np.asarray(array, np.float32) for name, array in arrays.items() if array is not None}
    fields = {
        "mark": mark,
        "time": observation.time,
        "sight": observation.sight.value,
        "message": observation.message,
        "arrays": {name: array.shape for name, array in known.items()},
    }
    return Note("seen", fields, b"".join(array.tobytes() for array in known.values()))


def observation_of(note: Note) -> Observation:
    """The observation in a message."""
    arrays, start = dict[str, Array](), 0
    numbers = np.frombuffer(note.data, np.float32).astype(np.float64)
    for name, shape in note.fields["arrays"].items():
        size = int(np.prod(shape))
        arrays[name] = numbers[start : start + size].reshape(shape)
        start += size
    return Observation(
        arrays.pop("log_likelihood"),
        float(note.fields["time"]),
        Sight(note.fields["sight"]),
        str(note.fields["message"]),
        **arrays,
    )
