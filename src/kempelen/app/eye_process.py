"""The eye's process: ``python -m kempelen.app.eye_process``; frames from a ring in, observations out.

It lives as long as its standard input is open. A frame that comes while the last one is being read is passed
over for the newest; an observation that nobody takes in time is dropped for the next one.
"""

import os
import select
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any, BinaryIO

import chess
import cv2

from kempelen.app.eye_wire import Note, seen
from kempelen.core.camera import Frame
from kempelen.core.errors import CameraError, KempelenError, SensorError
from kempelen.core.senses import Observation, Sight
from kempelen.frames.ring import RingReader
from kempelen.sensing.board.finder import BoardFinder
from kempelen.sensing.board.orientation import Side
from kempelen.sensing.draw import Ground, Layer, annotate, layered
from kempelen.sensing.tracker import Tracker, TrackerSettings, Use

WAIT_S = 0.05
"""How long a frame is waited for before orders are looked at again."""
SILENT_S = 1.0
"""Without a frame for so long, the camera is reported silent."""
REPORT_S = 0.5
"""Between two reports that nothing can be seen."""
LATENCY_S = 0.1
"""A frame may be this old when it comes out of the ring: exposure, transfer, registration."""
RETRY_S = 0.5
_JPEG_QUALITY = 82


class FrameSource:
    """Frames of whichever ring is the right one at the moment."""

    def __init__(self) -> None:
        self._name = ""
        self._message = "No camera has been named."
        self._reader: RingReader | None = None
        self._after = -1
        self._retry = 0.0
        self._since = time.monotonic()

    def use(self, name: str, message: str) -> None:
        """Read another ring, or none, because of ``message``."""
        if name != self._name:
            self.close()
            self._name, self._retry = name, 0.0
        self._message = message or "The camera is starting."

    def next(self) -> Frame | Observation | None:
        """The newest frame that is new; a report of why there is none; None when it is too early to say."""
        now = time.monotonic()
        try:
            reader = self._attached(now)
            frame = reader.newest(self._after, WAIT_S) if reader else self._pause()
        except CameraError as error:
            self.close()
            self._retry = now + RETRY_S
            return Observation.blind(0.0, Sight.NO_CAMERA, str(error))
        if frame is not None:
            self._after, self._since = frame.sequence, time.monotonic()
            return frame
        if reader is None:
            return Observation.blind(0.0, Sight.NO_CAMERA, self._message)
        silent = now - self._since
        return Tracker.stale(0.0, silent) if silent > SILENT_S else None

    def _attached(self, now: float) -> RingReader | None:
        if self._reader is None and self._name and now >= self._retry:
            self._reader = RingReader(self._name).__enter__()
            self._after, self._since = -1, now
        return self._reader

    @staticmethod
    def _pause() -> None:
        select.select([sys.stdin], [], [], WAIT_S)

    def close(self) -> None:
        """Let go of the ring."""
        if self._reader is not None:
            self._reader.__exit__(None, None, None)
            self._reader = None


class EyeLoop:
    """One eye at work.

    Args:
        orders: From the program; unbuffered reads must not be mixed in.
        out: To the program.
    """

    def __init__(self, orders: BinaryIO, out: int) -> None:
        self._orders = orders
        self._out = out
        self._source = FrameSource()
        self._mark = self._fresh = 0
        self._marked_at = 0.0
        self._passed_over = 0
        self._reported = 0.0
        self._time = 0.0

    def run(self) -> int:
        """Until the program has gone."""
        begin = Note.read(self._orders)
        if begin is None:
            return 0
        use, overrides = Use(begin.fields["use"]), dict(begin.fields["overrides"])
        sides = [Side(told) if (told := begin.fields[name]) else None for name in ("side", "usual")]
        finder = BoardFinder(square=begin.fields["square"], side=sides[0], usual_side=sides[1])
        self._tracker = Tracker(TrackerSettings(use=use, overrides=overrides), finder=finder)
        try:
            while self._obey():
                self._look()
        except BrokenPipeError:
            return 0
        finally:
            self._source.close()
        return 0

    # --- looking --------------------------------------------------------------------------------------------

    def _look(self) -> None:
        what = self._source.next()
        if isinstance(what, Frame):
            self._count()
            self._time = what.time
            self._report(self._read(what))
        elif what is not None and time.monotonic() - self._reported > REPORT_S:
            self._fresh = self._mark
            self._report(Observation.blind(self._time, what.sight, what.message))

    def _read(self, frame: Frame) -> Observation:
        try:
            return self._tracker.update(frame)
        except SensorError as error:
            return Observation.blind(frame.time, Sight.NO_BOARD, str(error))

    def _count(self) -> None:
        """One under way when the mark came may show what was before; the next one does not."""
        if self._fresh != self._mark:
            late = time.monotonic() - self._marked_at > LATENCY_S
            if late and self._passed_over:
                self._fresh = self._mark
            self._passed_over += 1

    def _report(self, observation: Observation) -> None:
        self._reported = time.monotonic()
        _, writable, _ = select.select([], [self._out], [], 0.0)
        if writable:
            self._send(seen(observation, self._fresh))

    def _send(self, note: Note) -> None:
        data = memoryview(note.encode())
        while data:
            data = data[os.write(self._out, data) :]

    # --- obeying --------------------------------------------------------------------------------------------

    def _obey(self) -> bool:
        """All orders that have come; False when the program has gone."""
        while select.select([self._orders], [], [], 0.0)[0]:
            note = Note.read(self._orders)
            if note is None:
                return False
            self._do(note)
        return True

    def _do(self, note: Note) -> None:
        match note.op:
            case "ring":
                self._source.use(note.fields["name"], note.fields["message"])
            case "expect":
                fen = note.fields["fen"]
                self._tracker.expect(chess.BaseBoard(fen) if fen else None)
            case "mark":
                self._mark, self._marked_at, self._passed_over = note.fields["mark"], time.monotonic(), 0
            case "look again":
                self._tracker.look_again()
            case "ask":
                self._answer(note.fields)

    def _answer(self, asked: Mapping[str, Any]) -> None:
        answers: Mapping[str, Callable[[Mapping[str, Any]], tuple[dict[str, Any], bytes]]] = {
            "view": self._view,
            "sighting": self._sighting,
            "parameters": self._parameters,
            "set": self._set,
        }
        try:
            fields, data = answers[asked["what"]](asked)
        except KempelenError as error:
            fields, data = {"error": error.message, "hint": error.hint}, b""
        self._send(Note("answer", {"number": asked["number"], **fields}, data))

    def _view(self, asked: Mapping[str, Any]) -> tuple[dict[str, Any], bytes]:
        view = self._tracker.view()
        if view is None:
            raise SensorError("Nothing has been seen yet.", hint="Wait for the camera.")
        if "ground" not in asked:
            _, png = cv2.imencode(".png", annotate(view))
            return {}, png.tobytes()
        ground, layers = Ground(asked["ground"]), [Layer(name) for name in asked["layers"]]
        picture = layered(view, ground, layers, asked["width"])
        if picture is None:
            raise SensorError(f"The camera gives no such picture: {ground}.", hint="Choose another one.")
        _, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
        return {}, jpeg.tobytes()

    def _sighting(self, _asked: Mapping[str, Any]) -> tuple[dict[str, Any], bytes]:
        view = self._tracker.view()
        if view is None or view.sighting is None:
            raise SensorError("The board has not been found.", hint="See what the camera sees: kempelen see")
        found = view.sighting
        pose = None if found.camera_from_board is None else found.camera_from_board.matrix.tolist()
        return {
            "camera_from_board": pose,
            "residual": found.residual,
            "confidence": found.confidence,
            "method": found.method,
            "oriented": found.oriented,
            "square": found.square,
            "corners": found.corners.tolist(),
        }, b""

    def _parameters(self, _asked: Mapping[str, Any]) -> tuple[dict[str, Any], bytes]:
        return {"parameters": self._tracker.parameters.to_json()}, b""

    def _set(self, asked: Mapping[str, Any]) -> tuple[dict[str, Any], bytes]:
        self._tracker.parameters.override(asked["name"], asked["value"])
        return {}, b""


def main() -> int:
    """Look until nobody wants to know."""
    cv2.setNumThreads(1)  # one core is what the eye may have
    orders = os.fdopen(os.dup(sys.stdin.fileno()), "rb", buffering=0)
    with orders:
        return EyeLoop(orders, sys.stdout.fileno()).run()


if __name__ == "__main__":
    sys.exit(main())
