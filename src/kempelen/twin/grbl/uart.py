"""The serial side of the board: a 128-byte receive ring, and times of arrival and departure."""

from collections import deque
from math import inf
from typing import Any

RING = 128
BITS_PER_BYTE = 10
_NOMINAL_BAUD = 115_200  # while the ear is shut, even an "instantaneous" line has this speed
_WRITE_S = 0.0034  # s an EEPROM byte takes, interrupts off
_HARDWARE_FIFO = 3  # bytes that the serial hardware itself holds meanwhile


class Uart:
    """Bytes on their way in and out.

    Args:
        baud: Bits per second; 0 for no delay.
        size: Of the ring, bytes.

    Attributes:
        ring: Received and not yet read by the main program.
        dropped: How many bytes have been lost so far, for tests and reports.
    """

    __slots__ = (
        "_byte_s", "_coming", "_deaf", "_deaf_until", "_fresh", "_fresh_at", "_going", "_heard", "_last_in",
        "_last_out", "_size", "_window", "dropped", "ring",
    )  # fmt: skip

    def __init__(self, baud: int, size: int = RING) -> None:
        self._size = size
        self._byte_s = BITS_PER_BYTE / baud if baud else 0.0
        self._coming: deque[tuple[float, int]] = deque()
        self._going: deque[tuple[float, bytes]] = deque()
        self._last_in = self._last_out = 0.0
        self.ring = bytearray()
        self.dropped = 0
        self.clear()

    @property
    def room(self) -> int:
        """Free bytes of the ring."""
        return self._size - len(self.ring)

    def clear(self) -> None:
        """A reset: the ring is emptied; what is on the wire stays there."""
        self.ring.clear()
        self._fresh, self._fresh_at = 0, -inf
        self._deaf = self._deaf_until = -inf
        self._window, self._heard = -1, 0

    def power_cycle(self) -> None:
        """Nothing that was under way arrives."""
        self.clear()
        self._coming.clear()
        self._going.clear()
        self._last_in = self._last_out = 0.0

    # --- in ------------------------------------------------------------------------------------------------

    def send(self, data: bytes, now: float) -> bytes:
        """The host sends; what of it arrives at once."""
        if not self._byte_s:
            return self._audible(data, now)
        arrival = max(now, self._last_in)
        for byte in data:
            arrival += self._byte_s
            self._coming.append((arrival, byte))
        self._last_in = arrival
        return b""

    def next_arrival(self) -> float:
        """When the next byte is complete, s; infinity for none."""
        return self._coming[0][0] if self._coming else inf

    def arrived(self, now: float) -> bytes:
        """Bytes that have become complete."""
        found = bytearray()
        while self._coming and self._coming[0][0] <= now:
            when, byte = self._coming.popleft()
            found += self._audible(bytes((byte,)), when)
        return bytes(found)

    def store(self, data: bytes, now: float) -> int:
        """Put bytes into the ring; how many found room."""
        taken = min(len(data), self.room)
        self.ring += data[:taken]
        if self._fresh_at != now:
            self._fresh, self._fresh_at = 0, now
        self._fresh += taken
        return taken

    def shut_ear(self, now: float, writes: int) -> float:
        """EEPROM bytes are written from ``now`` on, interrupts off; how long that takes, s.

        On a line without delay, what came together with the line that causes the write counts as still on the
        wire.
        """
        self._deaf, self._deaf_until = now, now + writes * _WRITE_S
        self._window, self._heard = -1, 0
        self._last_in = max(self._last_in, now) if self._byte_s else now
        if not self._byte_s and self._fresh_at == now:
            late = bytes(self.ring[len(self.ring) - min(self._fresh, len(self.ring)) :])
            if late:
                del self.ring[-len(late) :]
                self.ring += self._audible(late, now)
        return writes * _WRITE_S

    def _audible(self, data: bytes, now: float) -> bytes:
        if now >= self._deaf_until:
            return data
        if self._byte_s:
            return bytes(byte for byte in data if self._caught(now))
        heard = bytearray()
        self._last_in = max(self._last_in, now)
        for byte in data:
            self._last_in += BITS_PER_BYTE / _NOMINAL_BAUD
            if self._caught(self._last_in):
                heard.append(byte)
        return bytes(heard)

    def _caught(self, when: float) -> bool:
        if when >= self._deaf_until:
            return True
        window = int((when - self._deaf) / _WRITE_S)
        if window != self._window:
            self._window, self._heard = window, 0
        self._heard += 1
        if self._heard <= _HARDWARE_FIFO:
            return True
        self.dropped += 1
        return False

    # --- out -----------------------------------------------------------------------------------------------

    def transmit(self, data: bytes, now: float, delay: float) -> None:
        """The controller answers."""
        due = now + delay
        if self._byte_s:
            due = max(due, self._last_out) + len(data) * self._byte_s
            self._last_out = due
        self._going.append((due, data))

    def take(self, now: float) -> bytes:
        """What has reached the host by now."""
        going = self._going
        if not going:
            return b""
        parts = []
        while going and going[0][0] <= now:
            parts.append(going.popleft()[1])
        return b"".join(parts)

    def quiet(self, now: float) -> bool:
        """Whether nothing is on the wire in either direction."""
        return not self._coming and not (self._going and self._going[-1][0] > now)

    def snapshot(self) -> dict[str, Any]:
        """JSON-able."""
        return {
            "ring": self.ring.decode("latin-1"),
            "coming": [[when, byte] for when, byte in self._coming],
            "going": [[when, data.decode("latin-1")] for when, data in self._going],
            "last": [self._last_in, self._last_out],
            "fresh": [self._fresh, _finite(self._fresh_at)],
            "deaf": [_finite(self._deaf), _finite(self._deaf_until), self._window, self._heard],
            "dropped": self.dropped,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """The inverse of `snapshot`."""
        self.ring = bytearray(state["ring"].encode("latin-1"))
        self._coming = deque((when, byte) for when, byte in state["coming"])
        self._going = deque((when, data.encode("latin-1")) for when, data in state["going"])
        self._last_in, self._last_out = state["last"]
        self._fresh, self._fresh_at = state["fresh"][0], _infinite(state["fresh"][1])
        deaf, until, self._window, self._heard = state["deaf"]
        self._deaf, self._deaf_until = _infinite(deaf), _infinite(until)
        self.dropped = int(state["dropped"])


def _finite(value: float) -> float | None:
    return None if value == -inf else value


def _infinite(value: float | None) -> float:
    return -inf if value is None else value
