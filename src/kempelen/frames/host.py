"""A camera in a process of its own, seen from its owner: started, watched, started again when it dies."""

import asyncio
import os
import socket
import sys
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from types import TracebackType
from typing import IO, Any, Self

from kempelen.core.camera import Frame
from kempelen.core.errors import CameraError
from kempelen.frames.attached import arrival
from kempelen.frames.channel import Message, OwnerChannel
from kempelen.frames.condition import CameraState, CameraStatus, Restarting, silence
from kempelen.frames.ring import RingReader

HANG_S = 15.0  # longer than the ten seconds for which V4L2 may wait for a frame
_CLOSE_S = 5.0
_SLOTS = 5
_TAIL = 2000
USUALLY = Restarting()


class CameraProcess:
    """Async context manager: a driver at work in a process of its own. For one task.

    Args:
        factory: The driver, ``package.module:factory``.
        options: Its keyword arguments; what JSON can carry.
        patient: Whether a camera that cannot be opened at first is waited for; else it is an error.
        restarting: When it is started again; None for never.
        slots: Of the ring.
        start_s: How long the first frame may take, s.
    """

    def __init__(
        self,
        factory: str,
        options: Mapping[str, Any] | None = None,
        *,
        patient: bool = False,
        restarting: Restarting | None = USUALLY,
        slots: int = _SLOTS,
        start_s: float = 30.0,
    ) -> None:
        self._factory = factory
        self._options = dict(options or {})
        self._patient = patient
        self._restarting = restarting
        self._slots = slots
        self._start_s = start_s
        self._status = CameraStatus(CameraState.STARTING)
        self._settled = asyncio.Event()  # it runs, or will not
        self._news = asyncio.Event()
        self._reader: RingReader | None = None
        self._channel: OwnerChannel | None = None
        self._asked: asyncio.Future[Mapping[str, Any]] | None = None
        self._last = -1

    async def __aenter__(self) -> Self:
        """Start it, and wait for the first frame.

        Raises:
            CameraError: it cannot be opened, or shows nothing, and ``patient`` is off.
        """
        self._keeper = asyncio.create_task(self._keep())
        if not self._patient:
            try:
                await self._opened()
            except BaseException:
                await self.__aexit__(None, None, None)
                raise
        return self

    async def _opened(self) -> None:
        try:
            async with asyncio.timeout(self._start_s):
                await self._settled.wait()
        except TimeoutError:
            raise CameraError(
                f"The camera showed no picture within {self._start_s:g} s of being opened.",
                hint="Unplug it, plug it in again, and use a port with enough power and bandwidth (USB 3).",
            ) from None
        if self._keeper.done():
            self._keeper.result()

    async def __aexit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        """End it."""
        self._keeper.cancel()
        await asyncio.gather(self._keeper, return_exceptions=True)
        self._detach()
        self._tell(CameraState.CLOSED, "")

    @property
    def status(self) -> CameraStatus:
        """As of now."""
        if self._status.state is not CameraState.RUNNING or self._reader is None:
            return self._status
        return silence(self._status, self._reader.age)

    @property
    def ring(self) -> str:
        """Name of the ring, for other readers; another one after a new start, empty for none."""
        return self._reader.name if self._reader is not None else ""

    async def options(self, within: float = 5.0) -> Mapping[str, Any]:
        """What the driver says of the settings in force.

        Args:
            within: s to wait for the answer.

        Raises:
            CameraError: it does not answer.
        """
        if self._channel is not None:
            asked: asyncio.Future[Mapping[str, Any]] = asyncio.get_running_loop().create_future()
            self._asked = asked
            self._channel.send("options")
            with suppress(TimeoutError):
                async with asyncio.timeout(within):
                    return await asked
        raise CameraError(f"The camera does not answer. {self.status.message}".rstrip(), hint="Wait for it.")

    async def newest(self, after: int = -1, within: float = 0.0) -> Frame | None:
        """The newest frame, where it lies in the ring; let go of it soon.

        Sequences go on rising when the process is started again.

        Args:
            after: Only one with a higher sequence than this.
            within: s to wait for it.

        Returns:
            The frame; None when there was none in time: ``status`` says why.

        Raises:
            CameraError: the camera is lost for good.
            EOFError: the recording has been played.
        """
        deadline = time.monotonic() + within
        while True:
            self._news.clear()
            if (frame := self._look(after)) is not None:
                return frame
            self._require_life()
            left = deadline - time.monotonic()
            if left <= 0:
                return None
            await arrival(self._reader, self._news, left)

    def _look(self, after: int) -> Frame | None:
        """What is there; an end of the ring is for the keeper to explain."""
        if self._reader is None:
            return None
        with suppress(CameraError):
            frame = self._reader.newest(after)
            if frame is not None:
                self._last = max(self._last, frame.sequence)
            return frame
        return None

    def _require_life(self) -> None:
        if self._keeper.done():
            self._keeper.result()
            raise EOFError(self._status.message)

    # --- the keeper: one process after the other ---------------------------------------------------------

    async def _keep(self) -> None:
        try:
            await self._keep_alive()
        finally:
            self._settled.set()
            self._news.set()

    async def _keep_alive(self) -> None:
        """Until the recording has ended, or there is no more hope.

        Raises:
            CameraError: why there is none.
        """
        wait = 0.0
        while True:
            began = time.monotonic()
            try:
                await self._live()
            except CameraError as error:
                plan = self._restarting if self._patient or self._settled.is_set() else None
                self._lose(error, started_again=plan is not None)
                if plan is None:
                    raise
                settled = time.monotonic() - began > plan.settled
                wait = plan.first if settled or not wait else min(2 * wait, plan.longest)
                await asyncio.sleep(wait)
                self._status = replace(self._status, restarts=self._status.restarts + 1)
            else:
                self._tell(CameraState.ENDED, "The recording has been played to its end.")
                return

    async def _live(self) -> None:
        """One process from start to end; returns when its recording has ended.

        Raises:
            CameraError: it failed or died.
        """
        with tempfile.TemporaryFile() as words:
            process = await self._start(words)
            try:
                ended = await self._listen()
            finally:
                await self._stop(process)
            if not ended:
                raise _death(process.returncode, words)

    async def _start(self, words: IO[bytes]) -> asyncio.subprocess.Process:
        ours, its = socket.socketpair()
        with its:
            try:
                process = await asyncio.create_subprocess_exec(
                    sys.executable, "-m", "kempelen.frames", str(its.fileno()), pass_fds=[its.fileno()],
                    stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.DEVNULL, stderr=words,
                    start_new_session=True,
                )  # fmt: skip
                self._channel = await OwnerChannel.over(ours)
            except BaseException:
                ours.close()
                raise
        self._channel.send(
            "open", factory=self._factory, options=self._options, slots=self._slots, first=self._last + 1
        )
        return process

    async def _stop(self, process: asyncio.subprocess.Process) -> None:
        """Politely, then not."""
        channel, self._channel = self._channel, None
        if channel is not None:
            channel.send("close")
            await channel.close()
        try:
            async with asyncio.timeout(_CLOSE_S):
                await process.wait()
        except TimeoutError:
            process.kill()
            await process.wait()

    async def _listen(self) -> bool:
        """To what the process tells; whether its recording has ended.

        Raises:
            CameraError: the driver has failed or hangs.
        """
        channel, patience = self._channel, max(self._start_s, HANG_S)
        while channel is not None:
            try:
                async with asyncio.timeout(patience):
                    message = await channel.receive()
            except TimeoutError:
                raise CameraError(
                    f"The camera's driver has not answered for {patience:g} s.",
                    hint="Unplug the camera and plug it in again.",
                ) from None
            if message is None or message.kind == "ended":
                return message is not None
            self._hear(message)
            patience = HANG_S
        return False

    def _hear(self, message: Message) -> None:
        fields = message.fields
        match message.kind:
            case "opened":
                self._attach(fields["ring"])
                self._status = replace(
                    self._status, state=CameraState.RUNNING, message="", camera=fields["name"]
                )
                self._settled.set()
                self._news.set()
            case "status":
                self._status = replace(self._status, **fields)
            case "options" if self._asked is not None and not self._asked.done():
                self._asked.set_result(fields)
            case "error":
                raise CameraError(fields["message"], hint=fields["hint"])

    def _attach(self, ring: str) -> None:
        self._detach()
        with suppress(CameraError):  # gone already: why, is about to be told
            self._reader = RingReader(ring).__enter__()

    def _detach(self) -> None:
        if self._reader is not None:
            asyncio.get_running_loop().remove_reader(self._reader.fileno())
            self._reader.__exit__(None, None, None)
            self._reader = None

    def _lose(self, error: CameraError, *, started_again: bool) -> None:
        self._detach()
        more = " It is started again by itself." if started_again else ""
        self._tell(CameraState.LOST, f"{error}{more}")

    def _tell(self, state: CameraState, message: str) -> None:
        self._status = replace(self._status, state=state, message=message)
        self._news.set()


def _death(code: int | None, words: IO[bytes]) -> CameraError:
    """Of a process that said nothing in its channel; perhaps it did on standard error."""
    words.seek(max(0, words.seek(0, os.SEEK_END) - _TAIL))
    said = words.read().decode(errors="replace").strip().rpartition("\n")[2]
    how = f"was killed by signal {-code}" if code is not None and code < 0 else f"ended with exit code {code}"
    last = f" Its last words: {said}" if said else ""
    return CameraError(
        f"The camera's process {how}.{last}",
        hint="Unplug the camera, plug it in again and look at its cable.",
    )
