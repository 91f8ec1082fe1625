"""The line to a GRBL controller: one task owns the port, lines are acknowledged one by one.

Two ways to send: send-response (`Link.request`, one line in flight) and character counting (`Link.stream`, as
many bytes in flight as the controller's receive buffer safely holds, each window in one write). Real-time
bytes go out raw, at once, past every line. Nothing is ever sent twice.
"""

import asyncio
from collections.abc import Callable

from kempelen.core.errors import KempelenError, LinkError, RobotError
from kempelen.robots.grbl import codec
from kempelen.robots.grbl.codec import Alarm, Banner, Damaged, Error, Event, Ok, Status
from kempelen.robots.grbl.explain import alarm_error
from kempelen.robots.grbl.framing import Bare, Framing
from kempelen.robots.grbl.stream import Stream
from kempelen.robots.transport import Transport


class RefusedError(RobotError):
    """The controller answered ``error:code`` to a line.

    Attributes:
        code: GRBL's number.
    """

    def __init__(self, code: int, line: bytes, explained: tuple[str, str]) -> None:
        what, hint = explained
        super().__init__(
            f"The controller refused '{line.decode('ascii', 'replace').strip()}' (error {code}): {what}.",
            hint=hint,
        )
        self.code = code


class SilenceError(LinkError):
    """The controller did not say in time what it must say."""


class Link:
    """An open line.

    Args:
        transport: Belongs to the link from now on.
        listener: Called with every event, in the order of the wire, by the owning task.
        on_lost: Called once, when the line is lost.
        framing: Of the lines.

    Attributes:
        status: The last report.
        statuses: How many there were.
        banners: How often the controller has (re)started.
        errors: How many lines it refused.
        alarms: How many alarms it raised; ``alarm`` is the last one's number.
        damaged: How many lines arrived damaged: the line's quality.
        asked: Loop time of the last status query.
        raw_heard: The last bytes, for telling what a strange device said.
    """

    def __init__(
        self,
        transport: Transport,
        listener: Callable[[Event], None],
        on_lost: Callable[[LinkError], None],
        framing: Framing | None = None,
    ) -> None:
        self.transport = transport
        self._listener = listener
        self._on_lost = on_lost
        self.framing = framing or Bare()
        self._stream: Stream | None = None
        self._dead: Stream | None = None  # failed; its last acknowledgements may still come
        self._waiters: list[tuple[Callable[[], bool], asyncio.Future[None]]] = []
        self._owner: asyncio.Task[None] | None = None
        self._lost: LinkError | None = None
        self.status: Status | None = None
        self.statuses = self.banners = self.errors = self.alarms = self.damaged = 0
        self.alarm = 0
        self.asked = 0.0
        self.raw_heard = b""

    # --- life -----------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Begin to read."""
        self._owner = asyncio.create_task(self._own(), name=f"owner of {self.transport.name}")

    async def close(self) -> None:
        """Stop reading and let go of the port."""
        if self._owner is not None:
            self._owner.cancel()
            await asyncio.wait([self._owner])
        self.lose(self._closed())
        await self.transport.close()

    @property
    def lost(self) -> LinkError | None:
        """Why the line is gone; None while it is there."""
        return self._lost

    @property
    def stream_at_work(self) -> Stream | None:
        """The lines that are being sent or acknowledged at the moment."""
        return self._stream

    def _closed(self) -> LinkError:
        return LinkError(f"The line to {self.transport.name} was closed.", hint="Connect again.")

    async def _own(self) -> None:
        reason = self._closed()
        try:
            while True:
                data = await self.transport.read()
                self.raw_heard = (self.raw_heard + data)[-80:]
                self._take(data)
        except LinkError as error:
            reason = error
        finally:
            self.lose(reason)

    def _take(self, data: bytes) -> None:
        for event in self.framing.feed(data):
            self._dispatch(event)
        self._pump()
        if self._waiters:
            self._wake()

    # --- sending --------------------------------------------------------------------------------------------

    def realtime(self, data: bytes) -> None:
        """Send real-time bytes now.

        Raises:
            LinkError: the line is lost.
        """
        if self._lost is not None:
            raise self._lost
        if data == codec.ASK:
            self.asked = asyncio.get_running_loop().time()
        try:
            self.transport.write(data)
        except LinkError as error:
            self.lose(error)
            raise

    async def request(self, line: str) -> list[Event]:
        """Send one line alone and wait for its acknowledgement.

        Returns:
            What the controller said before it.

        Raises:
            RefusedError: it answered with an error.
            AlarmError: it raised an alarm.
            LinkError: the line was lost, or the controller restarted.
        """
        stream = Stream((line.encode("ascii") + b"\n",))
        await self.stream(stream)
        return stream.replies

    async def stream(self, stream: Stream) -> None:
        """Send lines by character counting and wait for all acknowledgements.

        When the caller is cancelled, nothing more goes out; what is in flight may still be carried out.

        Raises:
            RefusedError: a line was answered with an error; none after those in flight was sent.
            AlarmError: the controller raised an alarm.
            LinkError: the line was lost, or the controller restarted.
        """
        if self._lost is not None:
            raise self._lost
        if self._stream is not None:
            raise RuntimeError("two streams on one line")
        self._stream, stream.framing = stream, self.framing
        try:
            self._pump()
            if not stream.complete:
                await stream.wait()
        finally:
            if self._stream is stream:
                self._bury(stream)

    def fail(self, error: KempelenError) -> Stream | None:
        """End the stream at work, if any: nothing more goes out and its waiter gets ``error``."""
        stream = self._stream
        if stream is not None:
            stream.finish(error)
            self._bury(stream)
        return stream

    def interrupt(self, error: KempelenError) -> None:
        """End the stream at work and every wait with ``error``."""
        self.fail(error)
        for _, future in self._waiters:
            if not future.done():
                future.set_exception(error)
        self._waiters.clear()

    def _bury(self, stream: Stream) -> None:
        self._stream = None
        if stream.outstanding:
            self._dead = stream

    def _pump(self) -> None:
        stream = self._stream
        if stream is None:
            return
        if stream.complete:
            stream.finish()
            self._stream = None
        elif data := stream.take():
            self.realtime(data)

    # --- receiving ------------------------------------------------------------------------------------------

    def _dispatch(self, event: Event) -> None:
        match event:
            case Ok():
                self._acknowledge()
            case Status():
                self.status = event
                self.statuses += 1
            case Error(code):
                self._refuse(code)
            case Alarm(code):
                self.alarms, self.alarm = self.alarms + 1, code
                self.fail(alarm_error(code, self.transport.name))
            case Banner():
                self._restarted()
            case Damaged():
                self.damaged += 1
            case _ if self._stream is not None:
                self._stream.replies.append(event)
        self._listener(event)

    def _acknowledge(self) -> None:
        if self._dead is not None:
            self._dead.acknowledge()
            if not self._dead.outstanding:
                self._dead = None
        elif self._stream is not None and self._stream.outstanding:
            self._stream.acknowledge()
        else:
            self.damaged += 1  # an acknowledgement that nothing asked for

    def _refuse(self, code: int) -> None:
        self.errors += 1
        stream = self._stream
        if self._dead is not None:
            self._acknowledge()
            return
        if stream is None or not stream.outstanding:
            return
        line = stream.lines[stream.acknowledged]
        stream.acknowledge()
        self.fail(RefusedError(code, line, self.framing.explain(code)))

    def _restarted(self) -> None:
        self.banners += 1
        self.framing.restarted()
        self.fail(
            LinkError(
                f"The controller at {self.transport.name} restarted in the middle of its work.",
                hint="Check its power supply, then home; nothing is sent twice.",
            )
        )
        self._dead = None  # a restart voids every outstanding acknowledgement

    def lose(self, error: LinkError) -> None:
        """Take the line as lost: everybody who waits gets ``error``."""
        if self._lost is None:
            self._lost = error
            self._on_lost(error)
        self.interrupt(self._lost)

    # --- waiting --------------------------------------------------------------------------------------------

    async def until(self, condition: Callable[[], bool], seconds: float, what: str) -> None:
        """Wait for a condition that events bring about.

        Args:
            condition: Looked at now and after each arrival.
            seconds: How long, wall clock.
            what: What is waited for, for the message.

        Raises:
            SilenceError: it did not come about in time.
            LinkError: the line was lost.
        """
        if self._lost is not None:
            raise self._lost
        if condition():
            return
        future: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        waiter = (condition, future)
        self._waiters.append(waiter)
        try:
            async with asyncio.timeout(seconds):
                await future
        except TimeoutError:
            raise SilenceError(
                f"{self.transport.name}: no {what} within {seconds:g} s.",
                hint="Check cable and power, then connect again.",
            ) from None
        finally:
            if waiter in self._waiters:
                self._waiters.remove(waiter)

    def _wake(self) -> None:
        for waiter in self._waiters[:]:
            condition, future = waiter
            if not future.done() and condition():
                future.set_result(None)
                self._waiters.remove(waiter)

    async def ask(self, seconds: float) -> Status:
        """A fresh status report: one that the controller made after this call.

        The wire keeps the order, so any report that arrives from now on is younger than everything heard
        before.

        Raises:
            SilenceError: no answer in time.
            AlarmError: an alarm came instead.
            LinkError: the line was lost.
        """
        mark, alarms = self.statuses, self.alarms
        while True:
            restarts = self.banners
            self.realtime(codec.ASK)
            await self.until(
                lambda restarts=restarts: (  # type: ignore[misc]
                    self.statuses > mark or self.alarms > alarms or self.banners > restarts
                ),
                seconds,
                "answer to a status query",
            )
            if self.statuses > mark and self.status is not None:
                return self.status
            if self.alarms > alarms:
                raise alarm_error(self.alarm, self.transport.name)
            # A restart has swallowed the query together with everything else: ask again.
