"""MuJoCo's model and data of a scene, in millimetres."""

import math
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from kempelen.core.errors import TwinError
from kempelen.core.geometry import Array
from kempelen.twin.physics.bodies import quaternion
from kempelen.twin.physics.gripper import CLOSE_SPEED, FINGERS, OPEN_SPEED, PIVOTS, Jaw
from kempelen.twin.physics.hand import hand_pose
from kempelen.twin.physics.model import build_model
from kempelen.twin.physics.robot import machine_of
from kempelen.twin.physics.scene import Scene, StandingPiece
from kempelen.twin.physics.state import Sleep, read_state, wake, write_state
from kempelen.twin.physics.units import METRES

STILL_SPEED = 1e-3
"""Below this speed nothing moves, m/s."""
STILL_TURN = 1e-2
"""Below this nothing turns, rad/s: 0.2 mm/s at a rim. A stem between two pads trembles by a third of it."""
SETTLING_STEPS = 2000

_complaints: list[str] = []
mujoco.set_mju_user_warning(_complaints.append)  # instead of a log file in the current folder


class Simulation:
    """Bodies and the machine. Pieces go by their number in the scene.

    Args:
        scene: What there is.
        joints: Where the machine stands at first, in its own units; None for where it starts.
    """

    def __init__(self, scene: Scene, joints: Array | None = None) -> None:
        self.machine = machine_of(scene)
        self._load(scene)
        self.joints = self.machine.start if joints is None else joints
        self._hand[self._fingers] = Jaw.of(scene.table.gripper).stroke * METRES
        self._settle()

    def _load(self, scene: Scene) -> None:
        """Compile the scene and take views of MuJoCo's arrays, once."""
        self.scene = scene
        self.model: Any = build_model(scene)
        self.data: Any = mujoco.MjData(self.model)
        model, data, n = self.model, self.data, len(scene.pieces)
        self._bodies, self._body_speeds = data.qpos[: 7 * n].reshape(n, 7), data.qvel[: 6 * n].reshape(n, 6)
        k = len(self.machine.joints)
        self._axes, self._hand = data.qpos[7 * n : 7 * n + k], data.qpos[7 * n + k :]
        self._axis_speeds, self._hand_speeds = data.qvel[6 * n : 6 * n + k], data.qvel[6 * n + k :]
        names = [model.joint(i).name for i in range(n + k, model.njnt)]
        self._fingers = [names.index(name) for name in FINGERS]
        self._pivots = [names.index(name) for name in PIVOTS if name in names]
        self._piece_of = {int(model.body(piece.piece_id).id): i for i, piece in enumerate(scene.pieces)}
        self._body_of = {i: body for body, i in self._piece_of.items()}
        self._finger_of = {
            body: name for body in range(model.nbody) for name in FINGERS
            if model.body(body).name in {name, f"{name}_pad"}
        }  # fmt: skip

    def _settle(self) -> None:
        """Let the pieces come to rest before the clock starts."""
        for _ in range(SETTLING_STEPS):
            mujoco.mj_step(self.model, self.data)
            if self.pieces_asleep:
                break
        else:
            raise TwinError(
                "The pieces do not come to rest within 4 s of simulated time.",
                hint="Check that no two stand in the same place.",
            )
        self.data.time = 0.0

    # --- the machine ----------------------------------------------------------------------------------------

    @property
    def joints(self) -> Array:
        """(n,) where the machine's joints really are, in its own units; assign to put them there at once."""
        return np.asarray(self._axes / self.machine.scale)

    @joints.setter
    def joints(self, where: Array) -> None:
        self._axes[:] = where * self.machine.scale

    @property
    def tool(self) -> Array:
        """(3,) mm, robot frame: where the tool point really is."""
        return self.machine.tool(self.joints)

    def open_fingers(self) -> None:
        """At once."""
        self._hand[self._fingers], self._hand_speeds[:] = 0.0, 0.0

    @property
    def fingers_at_rest(self) -> bool:
        """Whether the fingers stand still."""
        return bool(np.abs(self._hand_speeds[self._fingers]).max() < STILL_SPEED)

    def glide(self, dt: float, way: Array) -> None:
        """Move the machine's joints by ``way`` (n,) where nothing can be touched; nothing else moves."""
        self._axes += way * self.machine.scale
        self._axis_speeds[:] = way * (self.machine.scale / dt)
        if self._pivots:
            self._hand[self._pivots], self._hand_speeds[self._pivots] = self.machine.pads(self.joints), 0.0
        self.data.time += dt

    def integrate(self, dt: float, way: Array, *, closed: bool, longest: float) -> None:
        """Let everything move for ``dt`` s, the joints by ``way``, in steps of at most ``longest`` s."""
        steps = max(1, math.ceil(dt / longest - 1e-9))
        self.model.opt.timestep = dt / steps
        self._axis_speeds[:] = way * (self.machine.scale / dt)
        self.data.ctrl[:] = CLOSE_SPEED if closed else -OPEN_SPEED
        mujoco.mj_step(self.model, self.data, nstep=steps)
        if _complaints:
            complaint = _complaints[0].strip()
            _complaints.clear()
            raise TwinError(f"The physics broke down: {complaint}", hint="Set the table anew; report how.")

    @property
    def pressed(self) -> float:
        """How hard the machine presses pieces down, N."""
        force, down = np.zeros(6), 0.0
        for number, pair in enumerate(self.data.contact.geom):
            first, second = (int(self.model.geom_bodyid[geom]) for geom in pair)
            if (first in self._piece_of) == (second in self._piece_of) or not first or not second:
                continue
            if self.model.body_treeid[first] < 0 or self.model.body_treeid[second] < 0:
                continue  # board and trays stand still
            mujoco.mj_contactForce(self.model, self.data, number, force)
            up = float(
                self.data.contact.frame[number].reshape(3, 3)[:, 2] @ force[:3]
            )  # on the second of the two
            down -= up if second in self._piece_of else -up
        return down

    def show_hand(self, tip: Array) -> None:
        """Put the person's finger tips at (3,) mm: a sight only."""
        scene = self.scene
        pose = hand_pose(scene.table, tip, at_white=scene.person == "white")
        self.data.mocap_pos[0], self.data.mocap_quat[0] = pose.translation * METRES, quaternion(pose)

    # --- the pieces -----------------------------------------------------------------------------------------

    @property
    def pieces_asleep(self) -> bool:
        """Whether no piece moves nor is held."""
        return bool(self.data.ntree_awake <= 1)

    @property
    def still(self) -> bool:
        """Whether nothing at all moves, though it may be held."""
        bodies, machine = np.abs(self._body_speeds), np.abs(self.data.qvel[self._body_speeds.size :])
        straight = max(bodies[:, :3].max(initial=0.0), machine.max(initial=0.0))
        return bool(straight < STILL_SPEED and bodies[:, 3:].max(initial=0.0) < STILL_TURN)

    @property
    def positions(self) -> Array:
        """(n, 3) mm of the bases' centres."""
        return np.asarray(self._bodies[:, :3] / METRES)

    @property
    def axes(self) -> Array:
        """(n, 3) unit vectors from base to head."""
        w, x, y, z = self._bodies[:, 3:].T
        return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)

    def attitude(self, piece: int) -> Array:
        """(4,) w x y z of robot_from_piece."""
        return np.array(self._bodies[piece, 3:])

    def put(self, piece: int, where: Array, attitude: Array, speed: Array | None = None) -> None:
        """Write a pose (mm) and a speed (mm/s, none by default), and wake the piece."""
        self._bodies[piece, :3] = where * METRES
        self._bodies[piece, 3:] = attitude
        self._body_speeds[piece] = 0.0
        if speed is not None:
            self._body_speeds[piece, :3] = speed * METRES
        wake(self.model, self.data, piece)

    def bear(self, piece: int, share: float) -> None:
        """Carry a share (0 to 1) of a piece's weight from outside."""
        body = self._body_of[piece]
        self.data.xfrc_applied[body, 2] = share * -self.model.opt.gravity[2] * self.model.body_mass[body]

    def held(self) -> int | None:
        """The piece that both fingers touch, if any."""
        if self.pieces_asleep:
            return None
        touching: dict[int, set[str]] = {}
        for pair in self.data.contact.geom:
            low, high = sorted(int(self.model.geom_bodyid[geom]) for geom in pair)
            if high in self._finger_of:
                touching.setdefault(low, set()).add(self._finger_of[high])
        held = [body for body, fingers in touching.items() if len(fingers) == len(FINGERS)]
        return self._piece_of[held[0]] if held else None

    # --- state ----------------------------------------------------------------------------------------------

    def state(self) -> tuple[Array, Sleep]:
        """All numbers, and who sleeps."""
        return read_state(self.model, self.data)

    def restore(self, pieces: tuple[StandingPiece, ...], numbers: Array, asleep: Sleep) -> None:
        """Go on from `state` of a simulation of these pieces."""
        if pieces != self.scene.pieces:
            self._load(replace(self.scene, pieces=pieces))
        write_state(self.model, self.data, numbers, asleep)

    def add(self, piece: StandingPiece) -> int:
        """Bring a further piece into being; everything else stays as it is. Returns its number."""
        before, (n, time) = self.data, (len(self.scene.pieces), self.data.time)
        bodies, speeds = self._bodies.copy(), self._body_speeds.copy()
        self._load(self.scene.with_pieces([piece]))
        self._bodies[:n], self._body_speeds[:n] = bodies, speeds
        k = len(self._axes)
        self._axes[:], self._hand[:] = before.qpos[7 * n : 7 * n + k], before.qpos[7 * n + k :]
        self._hand_speeds[:] = before.qvel[6 * n + k :]
        self.data.time = time
        self.data.mocap_pos[:], self.data.mocap_quat[:] = before.mocap_pos, before.mocap_quat
        numbers, asleep = self.state()
        asleep[:n] = before.tree_asleep[:n]
        write_state(self.model, self.data, numbers, asleep)
        return n
