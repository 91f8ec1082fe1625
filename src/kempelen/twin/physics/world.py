"""The simulated world: decides when physics has a say, and keeps the books."""

import base64
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from kempelen.core.camera import Picture
from kempelen.core.errors import TwinError
from kempelen.core.geometry import Array, Transform
from kempelen.twin.physics.bodies import quaternion
from kempelen.twin.physics.model import paint
from kempelen.twin.physics.person import DRAWER, DRAWER_PITCH, Person
from kempelen.twin.physics.robot import Slack
from kempelen.twin.physics.scene import Scene, StandingPiece
from kempelen.twin.physics.simulation import Simulation
from kempelen.twin.physics.truth import PieceTruth
from kempelen.twin.physics.view import draw

TIME_STEP = 0.002
CARRY_FACTOR = 2
"""While a piece is just carried, steps may be longer by this."""
STILL_SECONDS = 0.3
"""After this long a motionless world is at rest until something is asked of it."""
TOUCH_DOWN = 0.1
"""A piece put down at once starts this far above the surface, mm."""
TIPPING = 1.1
"""Past the balance of any piece, rad."""
SNAPSHOT_VERSION = 2


class World:
    """Table, pieces, robot and a person's hand.

    A gantry's joints are its tool point's coordinates, mm; an arm's are angles, rad.

    Args:
        scene: What there is.
        seed: Of the person's clumsiness.
        time_step: Longest step of the physics while something may be touched, s.
        joints: Where the machine stands at first; default where it starts.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        seed: int = 0,
        time_step: float = TIME_STEP,
        joints: Sequence[float] | None = None,
    ) -> None:
        self._time_step = time_step
        self._simulation = Simulation(scene, None if joints is None else np.asarray(joints, dtype=np.float64))
        self.person = Person(self._simulation, seed=seed)
        self._closed, self._fingers_rest = True, False
        self._still = self._roam = 0.0
        self._noted = False
        self._pressed = 0.0
        self._lost = np.zeros(len(self._simulation.joints))
        self._clearance = self._make_clearance()

    @property
    def scene(self) -> Scene:
        """What there is, pieces brought later included."""
        return self._simulation.scene

    @property
    def model(self) -> Any:
        """MuJoCo's, for cameras."""
        return self._simulation.model

    @property
    def data(self) -> Any:
        """MuJoCo's, for cameras: to be read only."""
        return self._simulation.data

    @property
    def time(self) -> float:
        """Simulated seconds since the start."""
        return float(self._simulation.data.time)

    @property
    def tool_mm(self) -> tuple[float, float, float]:
        """The tool point (centre between the pads) as it really is, robot frame, mm."""
        x, y, z = self._simulation.tool.tolist()
        return x, y, z

    @property
    def joints(self) -> tuple[float, ...]:
        """Where the machine's joints really are: mm or rad."""
        return tuple(self._simulation.joints.tolist())

    @property
    def gripper_closed(self) -> bool:
        """What the gripper was last told."""
        return self._closed

    def take_lost(self) -> Array:
        """(n,) by how much the joints stayed behind what they were told since the last call: lost steps."""
        lost, self._lost = self._lost, np.zeros_like(self._lost)
        return lost

    def step(self, dt: float, target: Sequence[float], gripper_closed: bool) -> None:  # noqa: FBT001
        """Drive each joint steadily to ``target`` within ``dt`` seconds.

        Args:
            dt: Typically 0.008 s.
            target: One number a joint: a gantry's x, y, z, mm; an arm's angles, rad.
            gripper_closed: Whether the gripper is without power, so that its spring closes it.

        Raises:
            TwinError: the target is farther than any machine moves in ``dt``, or not a number.
        """
        machine = self._simulation.machine
        way = np.asarray(target, dtype=np.float64) - self._simulation.joints
        length = float(np.abs(way).max())
        if not length <= machine.fastest * dt:
            raise TwinError(
                f"The machine cannot go from {self.joints} to {tuple(target)} {machine.unit} within {dt} s; "
                f"the limit is {machine.fastest:.0f} {machine.unit}/s.",
                hint="Cut the motion into smaller steps.",
            )
        if gripper_closed != self._closed:
            self._closed, self._fingers_rest = gripper_closed, False
            self._forget()
        if self.person.busy:
            self.person.advance(dt)
            self._simulation.show_hand(self.person.hand)
            self._forget()
        if length > machine.standstill:
            self._still = 0.0
        if self._pressed > machine.stall and self._goes_down(way):
            self._lost -= way
            way = np.zeros_like(way)
        self._let_pass(dt, way)

    def _goes_down(self, way: Array) -> bool:
        joints, machine = self._simulation.joints, self._simulation.machine
        return bool(machine.tool(joints + way)[2] < machine.tool(joints)[2])

    def _let_pass(self, dt: float, way: Array) -> None:
        if self._still >= STILL_SECONDS:
            self._simulation.data.time += dt
        elif self._fingers_rest and self._simulation.pieces_asleep and self._clear(way):
            self._simulation.glide(dt, way)
        else:
            self._integrate(dt, way)

    def _clear(self, way: Array) -> bool:
        """Whether the joints can go that way without a touch; uses up the slack."""
        length = self._simulation.machine.sweep(way)
        if self._roam < length:
            if not self._noted:
                self._look_around()
            self._roam = self._clearance.slack(self._simulation.joints, opened=not self._closed)
        clear = self._roam >= length
        self._roam = self._roam - length if clear else 0.0
        return clear

    def _look_around(self) -> None:
        scene, simulation = self.scene, self._simulation
        if len(self._clearance) != len(scene.pieces):
            self._clearance = self._make_clearance()
        self._clearance.update(simulation.positions, simulation.axes)
        self._noted = True

    def _make_clearance(self) -> Slack:
        scene = self.scene
        return self._simulation.machine.clearance([scene.shape(piece) for piece in scene.pieces])

    def _forget(self) -> None:
        """What was known of the pieces' rest no longer holds."""
        self._still = self._roam = 0.0
        self._noted = False

    def _integrate(self, dt: float, way: Array) -> None:
        simulation, asleep = self._simulation, self._simulation.pieces_asleep
        carrying = self._closed and self._fingers_rest and not self.person.busy
        longest = self._time_step * (CARRY_FACTOR if carrying else 1)
        simulation.integrate(dt, way, closed=self._closed, longest=longest)
        open_arm = (
            math.isfinite(simulation.machine.stall) and not self._closed and not simulation.pieces_asleep
        )
        self._pressed = simulation.pressed if open_arm else 0.0
        self._noted = self._noted and asleep and simulation.pieces_asleep
        self._roam = 0.0
        self._fingers_rest = simulation.fingers_at_rest
        self._still = self._still + dt if simulation.still else 0.0

    def teleport(self, joints: Sequence[float] | Array) -> None:
        """Put the machine somewhere at once, its gripper open, as no motor could: for tests and trials."""
        self._simulation.joints = np.asarray(joints, dtype=np.float64)
        self._simulation.open_fingers()
        self._closed = self._fingers_rest = False
        self._forget()

    # --- truth ----------------------------------------------------------------------------------------------

    def pieces(self) -> list[PieceTruth]:
        """Where every piece really is, in the scene's order."""
        return [self._truth(i) for i in range(len(self.scene.pieces))]

    def piece(self, piece_id: str) -> PieceTruth:
        """Where one piece really is.

        Raises:
            TwinError: there is no such piece.
        """
        return self._truth(self._number(piece_id))

    def nearest(self, x: float, y: float) -> PieceTruth:
        """The piece whose base is nearest to a point, mm."""
        return min(self.pieces(), key=lambda piece: piece.distance(x, y))

    def held(self) -> str | None:
        """The piece that both fingers touch, if any."""
        number = self._simulation.held()
        return None if number is None else self.scene.pieces[number].piece_id

    def settled(self) -> bool:
        """Whether nothing moves: no piece, no finger, no person; a piece held still counts as settled."""
        if self.person.busy:
            return False
        return self._still >= STILL_SECONDS or (self._simulation.pieces_asleep and self._fingers_rest)

    def _truth(self, number: int) -> PieceTruth:
        known, simulation = self.scene.pieces[number], self._simulation
        x, y, z = simulation.positions[number].tolist()
        w, i, j, k = simulation.attitude(number).tolist()
        cosine = float(simulation.axes[number] @ self.scene.table.upwards)
        tilt = math.acos(min(1.0, max(-1.0, cosine)))
        return PieceTruth(known.piece_id, known.kind, known.white, x, y, z, tilt, (w, i, j, k))

    def _number(self, piece_id: str) -> int:
        for number, piece in enumerate(self.scene.pieces):
            if piece.piece_id == piece_id:
                return number
        names = ", ".join(piece.piece_id for piece in self.scene.pieces)
        raise TwinError(f"The table has no piece '{piece_id}'.", hint=f"It has {names}.")

    def render(self, width: int = 640, height: int = 480, camera: str = "overview") -> Picture:
        """(height, width, 3) RGB view of a camera, where OpenGL works.

        Raises:
            TwinError: no OpenGL here, no such camera, or a picture too large.
        """
        paint(self._simulation.model, self.scene)
        return draw(self._simulation.model, self._simulation.data, width, height, camera)

    # --- the person -----------------------------------------------------------------------------------------

    def ask_person(self, piece_id: str, to: tuple[float, float]) -> Callable[[], bool]:
        """Let the person take a piece to (x, y), robot frame, mm, onto whatever is there.

        Returns:
            Whether that is done. Errands queue.

        Raises:
            TwinError: there is no such piece.
        """
        return self.person.take(self._number(piece_id), (*to, self.scene.surface(*to)))

    # --- faults ---------------------------------------------------------------------------------------------

    def place(self, piece_id: str, x: float, y: float, *, tilt: float = 0.0, turn: float = 0.0) -> None:
        """Put a piece somewhere at once, as no hand could: for tests and faults.

        Args:
            piece_id: Which.
            x: Of its base's centre, robot frame, mm.
            y: Of its base's centre, robot frame, mm.
            tilt: Leaning over the edge of its base to its own +x side by this angle, rad.
            turn: About the vertical, rad.
        """
        number = self._number(piece_id)
        base = self.scene.shape(self.scene.pieces[number]).base_diameter / 2
        pose = Transform.about_z(turn) @ Transform(_lean(tilt), np.zeros(3))
        z = self.scene.surface(x, y) + base * abs(math.sin(tilt)) + TOUCH_DOWN
        self._simulation.put(number, np.array([x, y, z]), quaternion(pose))
        self._forget()

    def remove(self, piece_id: str) -> None:
        """Take a piece off the table, at once, to where neither robot nor camera looks."""
        row, column = divmod(self._number(piece_id), 8)
        self.place(piece_id, DRAWER[0] + (row + 1) * DRAWER_PITCH, DRAWER[1] - column * DRAWER_PITCH)

    def knock_over(self, piece_id: str, *, turn: float = 0.0) -> None:
        """Tip a piece past its balance towards ``turn`` (rad from the robot's x); gravity does the rest."""
        truth = self.piece(piece_id)
        self.place(piece_id, truth.x, truth.y, tilt=TIPPING, turn=turn)

    # --- state ----------------------------------------------------------------------------------------------

    def snapshot(self) -> bytes:
        """Everything needed to go on exactly from here, as JSON."""
        numbers, asleep = self._simulation.state()
        state = {
            "version": SNAPSHOT_VERSION,
            "pieces": [asdict(piece) for piece in self.scene.pieces],
            "numbers": base64.b64encode(numbers.astype("<f8").tobytes()).decode(),
            "asleep": asleep.tolist(),
            "closed": self._closed,
            "fingers_rest": self._fingers_rest,
            "still": self._still,
            "person": self.person.state(),
        }
        return json.dumps(state).encode()

    def restore(self, snapshot: bytes) -> None:
        """Go on from a snapshot; the table must be the same, the pieces are the snapshot's.

        Raises:
            TwinError: the snapshot is damaged, of another version or of another table.
        """
        try:
            self._restore(json.loads(snapshot))
        except (ValueError, KeyError, TypeError) as error:
            raise TwinError(
                f"The twin's snapshot cannot be read: {error!r}.", hint="Set the table anew."
            ) from error

    def _restore(self, state: dict[str, Any]) -> None:
        if state["version"] != SNAPSHOT_VERSION:
            raise TwinError(
                f"The twin's snapshot is of version {state['version']}, not {SNAPSHOT_VERSION}.",
                hint="Set the table anew.",
            )
        pieces = tuple(StandingPiece(**piece) for piece in state["pieces"])
        numbers = np.frombuffer(base64.b64decode(state["numbers"], validate=True), dtype="<f8")
        self._simulation.restore(pieces, numbers, np.array(state["asleep"], dtype=np.int32))
        self._forget()
        self._closed, self._fingers_rest = bool(state["closed"]), bool(state["fingers_rest"])
        self._still = float(state["still"])
        self.person.restore(state["person"])


def _lean(angle: float) -> Array:
    """(3, 3) turn about y, so that the z axis leans towards x."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
