"""A hand that was seen over the board: a person's, or the robot's own?"""

from kempelen.core.senses import Observation

HAND_LOOKS = 3
"""A person's hand is seen in so many looks in a row."""
_LATE_LOOKS, _LATE_S = 8, 2.0
"""What is seen is older than what the robot says: by so many looks or seconds of the sensor at most."""


class HandWatch:
    """Tells when a person's hand comes over the board and goes.

    A robot that is near explains whatever is over the board, and so does one that was near until just now:
    pictures take their time to be read. An arm needs longer than a gantry until all of it has gone. After the
    first clear look nothing of it is there, and the next hand is a person's.
    """

    def __init__(self) -> None:
        self._looks = self._late = 0
        self._over = False
        self._left: float | None = None  # since when the robot may be seen although it has left, s

    def look(self, seen: Observation, *, robot: bool) -> bool | None:
        """Take what was seen.

        Args:
            seen: The latest look.
            robot: Whether the robot's own hand is over the board, or may be.

        Returns:
            True when a person's hand is there now, False when it has gone; None: nothing new.
        """
        own = self._own(seen, robot=robot)
        hand = seen.hand and not own
        self._looks = self._looks + 1 if hand else 0
        if self._looks == HAND_LOOKS or (self._over and seen.valid):
            self._over = hand
            return hand
        return None

    def _own(self, seen: Observation, *, robot: bool) -> bool:
        if robot:
            self._left, self._late = seen.time, 0
        elif self._left is not None:
            self._late += 1
            if seen.valid or (self._late > _LATE_LOOKS and seen.time - self._left > _LATE_S):
                self._left = None
        return self._left is not None
