"""Several sensors as one: what each says of every square is put together; one that fails is left out."""

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Mapping
from dataclasses import dataclass

import chess
import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.senses import BoardSensor, Observation, Sight, states_of
from kempelen.sensing.moves.evidence import bounded

PATIENCE_S = 2.0
"""A sensor that cannot be believed for so long, while another one can, is left out."""
START_S = 20.0
"""One that has never said anything yet may still be starting."""
BACK_S = 1.0
"""One that sees again for so long is believed again."""
_DOUBT = 1e-6
"""Rate at which any sensor's word on a square is taken for nothing: no single one outvotes all others."""
_STRANGE = 4
"""Squares that a sensor may read otherwise than the position that has been confirmed."""
_IN_A_ROW = 2
_PASSING = frozenset({Sight.CLEAR, Sight.HAND, Sight.STARTING})


@dataclass
class _Member:
    """One sensor.

    Attributes:
        latest: Its newest observation.
        since: When it began to be as it is: believable or not, s.
        out: Why it is left out; empty while it counts.
        strange: How many confirmed positions in a row it has read quite otherwise.
    """

    sensor: BoardSensor
    latest: Observation | None = None
    since: float = 0.0
    out: str = ""
    strange: int = 0

    def troubled(self, now: float) -> Observation | None:
        """What it says, if that has been of trouble for too long."""
        bad = self.latest is not None and self.latest.sight not in _PASSING
        return self.latest if bad and now - self.since >= PATIENCE_S else None


class FusedSensor:
    """A `kempelen.core.senses.BoardSensor` made of others.

    Squares are read independently by independent sensors, so that their log-likelihoods add up.

    Args:
        sensors: By the names that they are called to the operator.
        tell: Takes a sentence when a sensor is left out, and when it is back.
        clock: s.

    Attributes:
        left_out: Reasons, by name.
    """

    def __init__(
        self,
        sensors: Mapping[str, BoardSensor],
        tell: Callable[[str], None] = lambda _: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._members = {name: _Member(sensor) for name, sensor in sensors.items()}
        self._tell = tell
        self._clock = clock

    @property
    def left_out(self) -> dict[str, str]:
        """Why, by name."""
        return {name: member.out for name, member in self._members.items() if member.out}

    def stands(self, board: chess.BaseBoard) -> None:
        """A position has been confirmed: a sensor that reads something quite different fails."""
        states = states_of(board)
        for name, member in self._members.items():
            if member.latest is None or not member.latest.valid:
                continue
            said = member.latest.log_likelihood
            wrong = int((said[np.arange(64), states] < said.max(axis=1) - np.log(2)).sum())
            member.strange = member.strange + 1 if wrong > _STRANGE else 0
            if member.strange == _IN_A_ROW:
                self._leave_out(name, member, f"it reads {wrong} squares otherwise than they are")
            elif not member.strange and member.out and self._strange(member.out):
                self._take_back(name, member)

    async def observe(self) -> AsyncIterator[Observation]:
        """Observations of what is seen from now on, whenever one of the sensors has something new."""
        looks = {name: aiter(member.sensor.observe()) for name, member in self._members.items()}
        waiting = {name: asyncio.ensure_future(anext(look)) for name, look in looks.items()}
        fresh: dict[str, Observation] = {}
        began = self._clock()
        try:
            while True:
                await asyncio.wait(
                    waiting.values(), timeout=PATIENCE_S / 4, return_when=asyncio.FIRST_COMPLETED
                )
                for name, news in waiting.items():
                    if news.done():
                        fresh[name] = news.result()
                        waiting[name] = asyncio.ensure_future(anext(looks[name]))
                        self._note(name, fresh[name])
                self._mind(fresh, began)
                if (seen := self._together(fresh)) is not None:
                    yield seen
        finally:
            for news in waiting.values():
                news.cancel()
            await asyncio.gather(*waiting.values(), return_exceptions=True)

    # --- who counts ---

    def _note(self, name: str, seen: Observation) -> None:
        member, now = self._members[name], self._clock()
        if member.latest is None or (member.latest.sight in _PASSING) is not (seen.sight in _PASSING):
            member.since = now
        member.latest = seen
        if member.out and not self._strange(member.out) and seen.valid and now - member.since >= BACK_S:
            self._take_back(name, member)

    def _mind(self, fresh: Mapping[str, Observation], began: float) -> None:
        """Leave out who fails, as long as somebody else sees."""
        now = self._clock()
        for name, member in self._members.items():
            others = any(
                not other.out and other.latest is not None and other.latest.sight in _PASSING
                for other_name, other in self._members.items()
                if other_name != name
            )
            if member.out or not others:
                continue
            patience = PATIENCE_S if member.latest is not None else START_S
            if name not in fresh and now - began >= patience:
                self._leave_out(name, member, "it says nothing")
            elif (seen := member.troubled(now)) is not None:
                self._leave_out(name, member, seen.message or seen.sight.value)

    def _leave_out(self, name: str, member: _Member, why: str) -> None:
        if not member.out:
            member.out = why
            self._tell(f"The {name} is left out: {why.rstrip('.')}. The board is read without it.")

    def _take_back(self, name: str, member: _Member) -> None:
        member.out = ""
        self._tell(f"The {name} counts again.")

    @staticmethod
    def _strange(why: str) -> bool:
        return why.startswith("it reads ")

    # --- what they say together ---

    def _together(self, fresh: Mapping[str, Observation]) -> Observation | None:
        """None while one that counts has said nothing yet."""
        counting = [name for name, member in self._members.items() if not member.out]
        if not counting or any(name not in fresh for name in counting):
            return None
        seen = [fresh[name] for name in counting]
        now = self._clock()
        for one in seen:
            if not one.valid:
                hands = [other for other in seen if other.hand]
                told = hands[0] if hands else one
                return Observation.blind(now, told.sight, told.message)
        return Observation(
            sum_of(seen),
            now,
            heights=next((one.heights for one in seen if one.heights is not None), None),
            offsets=next((one.offsets for one in seen if one.offsets is not None), None),
            kinds=next((one.kinds for one in seen if one.kinds is not None), None),
        )


def sum_of(seen: list[Observation]) -> Array:
    """(64, 3) log-likelihood of all together, each square of each of them bounded."""
    out: Array = np.sum([bounded(one.log_likelihood, _DOUBT) for one in seen], axis=0)
    return out
