"""The twin's one loop: bytes in, controller, physics, bytes out.

Time runs at a chosen scale. At a finite scale the loop keeps pace with the wall clock. "As fast as it can"
has two rules: while the robot works, one step follows the other; while it rests, time passes as on the wall,
so that a host that thinks is not billed hours. And since at sixty times real time even a prompt host would
look slow, the loop waits a moment for it when the planner runs low and nothing is on the line
(`VirtualGrbl.starving`).
"""

import select
import signal
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import FrameType
from typing import Any

from kempelen.core.errors import TwinError
from kempelen.twin.cameras.crew import CameraCrew
from kempelen.twin.control import ControlServer, Pending, Reply
from kempelen.twin.faults import apply_fault
from kempelen.twin.keeping import StateLock, forget_state, load_state, save_state
from kempelen.twin.machine import Controller, Point, make_drive, make_scene
from kempelen.twin.physics.person import manner
from kempelen.twin.physics.world import World
from kempelen.twin.reed.board import TwinReed
from kempelen.twin.spec import TwinSpec
from kempelen.twin.wire import make_wire

STEP_S = 0.008  # chosen so that a piecewise-linear set-point errs by a·dt²/8 = 0.012 mm at 1500 mm/s²
_REST_S = 0.02
_PATIENCE_S = 0.1  # how long a starving controller waits for its host, wall clock
_MAX_LAG_S = 0.1
_OPENING_S = 0.15
_WIND_DOWN_S = 120.0
_HOVER_MM = 120.0


def _errand(done: Callable[[], bool]) -> Pending:
    return Pending(lambda: {} if done() else None)


class TwinLoop:
    """A running twin.

    Args:
        spec: What to simulate.
        alive: A descriptor that reaches end-of-file when the parent dies; None to run on.
    """

    def __init__(self, spec: TwinSpec, *, alive: int | None = None) -> None:
        self._spec = spec
        self._alive = alive
        self._speed = spec.speed
        self._stop = False
        self._patient = True
        self._busy_s = 0.0
        self._started = time.perf_counter()
        self._lock = StateLock(Path(spec.state), self._wanted) if spec.state else None
        self._cameras = CameraCrew(spec.cameras, spec.model_dump_json())
        try:
            self._build(spec)
            self._cameras.wait()
        except BaseException:
            self._cameras.close()
            raise

    def _build(self, spec: TwinSpec) -> None:
        """World, controller, wire and side door, while the cameras start."""
        self._drive = make_drive(spec)
        self._controller: Controller = self._drive.controller
        self._world = World(make_scene(spec), seed=spec.seed, joints=self._drive.follow(0.0))
        self._wire = make_wire(spec.wire, spec.link)
        if spec.resume:
            load_state(Path(spec.state), self._drive, self._world)
            self._wire.keep_dtr()
        self._reed = TwinReed(spec.reed, self._world.scene, spec.seed) if spec.reed else None
        self._control = ControlServer(Path(spec.control), self._handlers())

    @property
    def address(self) -> str:
        """Where the driver connects."""
        return self._wire.address

    @property
    def rings(self) -> list[str]:
        """Where the cameras' frames are."""
        return self._cameras.rings

    @property
    def reed(self) -> str:
        """Where the reed board's driver connects; empty where there is none."""
        return self._reed.address if self._reed else ""

    # --- the loop ------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Until told to stop, by the control socket, a signal or the parent's death."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._on_signal)
        if self._spec.state:
            forget_state(Path(self._spec.state))
        wall = time.perf_counter()
        while not self._stop:
            wall = self._rest(wall) if self._quiet() else self._work(wall)
            self._cameras.tell(self._world, self._controller.time_s)
            if self._reed is not None:
                self._reed.tell(self._world, self._controller.time_s)
            self._serve()
        self._wind_down()

    def _wanted(self) -> bool:
        """Whether the parent, if any, lives: it never writes again, so that only its end can be read."""
        return self._alive is None or not select.select([self._alive], [], [], 0.0)[0]

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        self._stop = True

    def _quiet(self) -> bool:
        return (
            self._controller.idle()
            and self._world.settled()
            and self._world.gripper_closed == self._drive.closed
            and not self._control.waiting
        )

    def _rest(self, wall: float) -> float:
        """Let time pass until somebody says something."""
        self._wait(_REST_S)
        now = time.perf_counter()
        passed = min(now - wall, 1.0) * (self._speed or 1.0)
        self._controller.advance(passed)
        self._drive.follow(passed)  # an arm comes to its stop, however soon it goes on, and cools down
        self._exchange()
        return now

    def _work(self, wall: float) -> float:
        """One step; returns the wall time at which it was due."""
        if self._speed:
            due = wall + STEP_S / self._speed
            self._wait_until(due)
            wall = max(due, time.perf_counter() - _MAX_LAG_S)
        else:
            self._be_patient()
            wall = time.perf_counter()
        self._exchange()
        self._advance(STEP_S)
        self._wire.write(self._controller.take_output())
        return wall

    def _advance(self, dt: float) -> None:
        if not self._controller.idle():
            self._busy_s += dt
        self._controller.advance(dt)
        self._world.step(dt, self._drive.follow(dt), self._drive.closed)
        self._drive.lose(self._world.take_lost())

    def _be_patient(self) -> None:
        if not self._controller.starving():
            self._patient = True
        elif self._patient:
            self._patient = self._wait(_PATIENCE_S)

    def _wait_until(self, due: float) -> None:
        while (left := due - time.perf_counter()) > 0 and not self._stop:
            if self._wait(left):
                self._exchange()
                self._serve()

    def _wait(self, seconds: float) -> bool:
        """Wait for bytes or requests; True when there are some."""
        watched = [*self._wire.filenos(), *self._control.filenos()]
        watched += self._reed.filenos() if self._reed else []
        if self._alive is not None:
            watched.append(self._alive)
        ready, _, _ = select.select(watched, [], [], max(seconds, 0.0))
        if self._alive in ready:
            self._stop = True
        return bool(ready)

    def _exchange(self) -> None:
        """Bytes in, answers out, no time passing."""
        if self._wire.opened():
            self._controller.reset_by_dtr()
            # A host still configures and flushes its end: a boot faster than that would lose its banner.
            time.sleep(_OPENING_S)
        data = self._wire.read()
        if data:
            self._patient = True
            self._controller.receive(data)
            self._controller.advance(0.0)
        self._wire.write(self._controller.take_output())

    def _serve(self) -> None:
        self._control.serve()
        if self._controller.faults.take_link_drop():
            self._wire.drop()

    # --- the side door -------------------------------------------------------------------------------------

    def _handlers(self) -> dict[str, Any]:
        return {
            "truth": self._truth,
            "stats": self._stats,
            "settle": self._settle,
            "carry": self._carry,
            "carries": self._carries,
            "hover": self._hover,
            "supply": self._supply,
            "remove": self._remove,
            "fault": self._fault,
            "camera": self._change_camera,
            "restart_camera": self._restart_camera,
            "reed": self._change_reed,
            "speed": self._set_speed,
            "stop": self._on_stop,
        }

    def _truth(self, _request: Mapping[str, Any]) -> Reply:
        pieces = [
            {
                "id": p.piece_id,
                "kind": p.kind,
                "white": p.white,
                "x": p.x,
                "y": p.y,
                "z": p.z,
                "tilt": p.tilt_rad,
                "q": list(p.quaternion),
            }
            for p in self._world.pieces()
        ]
        return {
            "pieces": pieces,
            "tool": list(self._world.tool_mm),
            "joints": list(self._world.joints) if self._spec.arm else None,
            "closed": self._drive.closed,
            "hand": self._world.person.hand.tolist() if self._world.person.busy else None,
            "resting": self._quiet(),
            **self._times(),
        }

    def _times(self) -> Reply:
        return {
            "time_s": self._controller.time_s,
            "busy_s": self._busy_s,
            "wall_s": time.perf_counter() - self._started,
        }

    def _stats(self, _request: Mapping[str, Any]) -> Reply:
        return {**self._times(), **self._drive.told(), "cameras": self._cameras.state()}

    def _change_camera(self, request: Mapping[str, Any]) -> Reply:
        """Other settings of a camera: ``{"camera": 0, "change": {"lighting": {"on": false}}}``."""
        self._cameras.change(int(request.get("camera", 0)), dict(request["change"]))
        return {}

    def _restart_camera(self, request: Mapping[str, Any]) -> Reply:
        self._cameras.restart(int(request.get("camera", 0)))
        return {}

    def _change_reed(self, request: Mapping[str, Any]) -> Reply:
        """Faults of the reed board, and what its lamps and its buzzer do; see `TwinReed.request`."""
        if self._reed is None:
            raise TwinError("This twin has no reed board.", hint="Play with --sensor reed.")
        return self._reed.request(request)

    def _settle(self, request: Mapping[str, Any]) -> Pending:
        return Pending(
            lambda: self._truth(request) if self._world.settled() and self._controller.idle() else None
        )

    def _carry(self, request: Mapping[str, Any]) -> Pending:
        """The virtual person takes the piece nearest to ``from`` to ``to``; see `manner` for how."""
        x, y = map(float, request["from"])
        return _errand(self._world.person.carry((x, y), self._spot(request), **manner(request)))

    def _carries(self, request: Mapping[str, Any]) -> Pending:
        """Several carries in one go: ``moves`` holds a request of `_carry` for each."""
        errands = [self._carry(one) for one in request["moves"]]
        return _errand(lambda: all(errand.poll() is not None for errand in errands))

    def _hover(self, request: Mapping[str, Any]) -> Pending:
        """The virtual person holds a hand ``height`` mm above ``to`` for so many ``seconds``."""
        x, y, z = self._spot(request)
        height = float(request.get("height", _HOVER_MM))
        return _errand(self._world.person.hover((x, y, z + height), float(request["seconds"])))

    def _supply(self, request: Mapping[str, Any]) -> Pending:
        """The virtual person brings another piece."""
        kind, white = str(request["kind"]), bool(request["white"])
        return _errand(self._world.person.supply(kind, white, self._spot(request)))

    def _spot(self, request: Mapping[str, Any]) -> Point:
        x, y = map(float, request["to"])
        return x, y, self._world.scene.surface(x, y)

    def _remove(self, request: Mapping[str, Any]) -> Reply:
        """The virtual person puts a piece into the drawer."""
        x, y = map(float, request["from"])
        self._world.remove(self._world.nearest(x, y).piece_id)
        return {}

    def _fault(self, request: Mapping[str, Any]) -> Reply:
        apply_fault(self._controller, self._world, request)
        return {}

    def _set_speed(self, request: Mapping[str, Any]) -> Reply:
        speed = float(request["speed"])
        if not 0 <= speed <= 1000:  # noqa: PLR2004 - the spec's own range
            raise TwinError(
                f"Speed {speed} is out of range.", hint="Give 1 to 1000, or 0 for as fast as it can."
            )
        self._speed = speed
        return {}

    def _on_stop(self, _request: Mapping[str, Any]) -> Reply:
        self._stop = True
        return {}

    # --- the end -------------------------------------------------------------------------------------------

    def _wind_down(self) -> None:
        """What is in the controller's buffer is driven, as on a real machine; then the table is kept."""
        end = self._controller.time_s + _WIND_DOWN_S
        while not (self._controller.idle() and self._world.settled()) and self._controller.time_s < end:
            self._advance(STEP_S)
        try:
            if self._spec.state:
                save_state(Path(self._spec.state), self._drive, self._world)
        finally:
            self._cameras.close()
            self._control.close()
            self._wire.close()
            if self._reed is not None:
                self._reed.close()
            if self._lock is not None:
                self._lock.release()
