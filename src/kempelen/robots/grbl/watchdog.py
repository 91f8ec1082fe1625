"""Watching the line: a status query now and then, an eye for silence and for missing acknowledgements.

Only silence that is not legal counts: homing and alarms are silent by nature, and in a hold no line is
acknowledged.
"""

import asyncio
from contextlib import suppress

from kempelen.core.errors import LinkError
from kempelen.robots.grbl import codec
from kempelen.robots.grbl.link import SilenceError
from kempelen.robots.grbl.session import Session
from kempelen.robots.grbl.stream import Stream


class Watchdog:
    """Watches one session until its line is lost; run it as a task."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._link = session.link
        self._answered = (0, 0.0)  # how many reports there were, and since when there have been no more
        # How far which stream was, at which report, and since when it has not gone on.
        self._progress: tuple[tuple[Stream, int] | None, int, float] = (None, 0, 0.0)

    async def run(self) -> None:
        """Until cancelled or the line is lost."""
        while self._link.lost is None:
            period = self._period()
            await asyncio.sleep(period or self._session.timing.poll)
            if self._link.lost is None:
                self._look(asyncio.get_running_loop().time(), asks=period > 0)

    def _period(self) -> float:
        timing = self._session.timing
        return timing.watch if self._session.condition.activity else timing.idle_watch

    def _look(self, now: float, *, asks: bool) -> None:
        condition = self._session.condition
        legal = condition.silent or condition.banner_due or condition.activity == "home"
        if legal or not asks or self._link.statuses != self._answered[0]:
            self._answered = (self._link.statuses, now)
        if now - self._answered[1] > self._session.timing.answer:
            self._fell_silent()
        elif asks and not legal and now - self._link.asked >= self._session.timing.poll:
            with suppress(LinkError):
                self._link.realtime(codec.ASK)
        if not legal:
            self._count_acknowledgements(now)

    def _count_acknowledgements(self, now: float) -> None:
        """Idle in report after report while lines are owed an acknowledgement: one was lost."""
        stream, status = self._link.stream_at_work, self._session.condition.status
        if stream is None or status is None or status.state != "Idle":
            self._progress = (None, 0, now)
            return
        last, reports, since = self._progress
        if (stream, stream.acknowledged) != last:
            self._progress = ((stream, stream.acknowledged), self._link.statuses, now)
        elif now - since > self._patience() and self._link.statuses > reports + 1:
            self._link.fail(
                LinkError(
                    f"The controller is idle but owes {stream.outstanding} acknowledgements: "
                    "the line is damaged.",
                    hint="Check the cable; keep it away from motor wires.",
                )
            )

    def _patience(self) -> float:
        return self._session.timing.lost_ok + self._session.dwell

    def _fell_silent(self) -> None:
        if self._session.work is not None:
            with suppress(LinkError):
                self._link.realtime(codec.HOLD)  # perhaps it still hears
        self._link.lose(
            SilenceError(
                f"{self._link.transport.name}: no answer for {self._session.timing.answer:g} s.",
                hint="Check cable and power, then recover and home; nothing is sent twice.",
            )
        )
