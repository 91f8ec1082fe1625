"""`kempelen bench tracking`: an arm on belts that give follows a motion, with and without feed-forward.

The Lab-Volt 5150 in MuJoCo with its links' true masses, which the planner knows only to 10 %, and a white
king in the gripper that it does not know of. Between each motor and its joint is a belt; which frequencies
they ring at is an assumption, the same for all. Four motions: the two of the paper, a half turn at full
speed, and a carry over the start position. The error is the distance of the tool point from where it should
be.

* plain: the motors are told the joint angles;
* weight: they run ahead by what the weight stretches;
* feed-forward: by what weight and inertia stretch, from the recursive Newton-Euler equations;
* computed torque: no belts, motors that turn with the torque which the same equations ask for, the error fed
  back (Luh, Walker, Paul 1980).

``ratio`` is the rms with feed-forward over that without, all motions together.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any

import chess
import numpy as np

from kempelen.bench.result import BenchResult, Progress
from kempelen.bench.svg_plot import Chart, draw_charts
from kempelen.core.arm_table import arm_table
from kempelen.core.geometry import Array
from kempelen.core.places import Place, Transfer
from kempelen.core.table import start_layout
from kempelen.kinematics import Arm, Mass, forward, load_arm
from kempelen.kinematics.dynamics import torques
from kempelen.motion.arm.feed_forward import Belts, run_ahead, smooth
from kempelen.motion.arm.grasp import park_joints, pose_over
from kempelen.motion.arm.guidance import straight
from kempelen.motion.arm.pacing import paced, rounded
from kempelen.motion.arm.plan import ARM_CLEARANCES, plan_arm_approach, plan_arm_carry
from kempelen.motion.arm.synchrony import TimedPath, synchronise
from kempelen.motion.scene import Scene
from kempelen.twin.physics.compliant import STEP, FreeArm, Law

PLOT = Path("tracking.svg")
HERTZ = np.array([7.0, 7.0, 9.0, 12.0, 20.0])
"""What each joint alone would ring at on its belt."""
DAMPED = 0.08
"""Share of critical damping."""
KNOWN_TO = 0.1
"""How far the planner's masses are from the true ones, share."""
STIFF = 40.0
"""Of the feedback under computed torque, 1/s, critically damped."""
_HOLD = 0.004  # s, for which a computed torque is held
_POINTS = 60


def run(*, seed: int, pgn: Path | None, data: Path | None, progress: Progress) -> BenchResult:
    """Simulate all motions in all four ways.

    Args:
        seed: Of the masses' errors.
        pgn: Not used.
        data: Not used.
        progress: Told before each simulation.
    """
    del pgn, data
    arm = load_arm("labvolt-5150")
    paths = _paths(arm)
    true, king = _as_it_is(arm, seed), _king()
    body = FreeArm(true, king)
    belts = Belts.ringing_at(arm, HERTZ, DAMPED)
    errors: dict[str, dict[str, Array]] = {}
    for number, (title, path) in enumerate(paths.items()):
        progress(title, number / len(paths))
        errors[title] = {
            name: _error(arm, path, body.follow(_at_rest(true, path, belts, king, law), law, path.seconds))
            for name, law in _laws(arm, path, belts).items()
        }
    PLOT.write_text(_drawn(paths, errors), encoding="utf-8")
    rows = [
        {"motion": title, "way": name, "rms_mm": _rms(error), "max_mm": float(error.max())}
        for title, ways in errors.items()
        for name, error in ways.items()
    ]
    return BenchResult("tracking", _figures(errors), rows, [PLOT])


def _figures(errors: Mapping[str, Mapping[str, Array]]) -> dict[str, float]:
    together = {name: np.concatenate([ways[name] for ways in errors.values()]) for name in _NAMES}
    figures: dict[str, float] = {}
    for name, error in together.items():
        key = name.replace(" ", "_").replace("-", "_")
        figures |= {f"rms_mm_{key}": _rms(error), f"max_mm_{key}": float(error.max())}
    plain = together["plain"]
    figures["ratio"] = _rms(together["feed-forward"]) / _rms(plain)
    figures["ratio_max"] = float(together["feed-forward"].max() / plain.max())
    figures["ratio_to_weight_alone"] = _rms(together["feed-forward"]) / _rms(together["weight"])
    return figures


_NAMES = ("plain", "weight", "feed-forward", "computed torque")


# --- motions ----------------------------------------------------------------------------------------------


def _paths(arm: Arm) -> dict[str, TimedPath]:
    """The paper's two, a half turn, and a carry."""
    half_turn = arm.home + np.array([radians(60), radians(-40), 0.0, 0.0, 0.0])
    return {
        "paper 1": _line(arm, (190, 0, 331), (217, 120, 185)),
        "paper 2": _line(arm, (121, 120, 185), (346, -120, 185)),
        "half turn": synchronise(
            arm, arm.home - (half_turn - arm.home) * np.array([2, 0, 0, 0, 0]), half_turn
        ),
        "carry g1-f3": _carry(arm),
    }


def _line(arm: Arm, start: tuple[float, float, float], end: tuple[float, float, float]) -> TimedPath:
    first, last = (pose_over(np.array(point, dtype=np.float64)) for point in (start, end))
    return paced(arm, rounded(arm, straight(arm, first, last, "Following the paper's line")))


def _carry(arm: Arm) -> TimedPath:
    table = arm_table()
    scene = Scene(table, start_layout(table, chess.Board()), ARM_CLEARANCES)
    knight = Transfer(chess.Piece(chess.KNIGHT, chess.WHITE), Place("g1"), Place("f3"))
    approach = plan_arm_approach(arm, scene, park_joints(arm, table, arm.home), knight)
    carry = plan_arm_carry(arm, scene, knight, approach.joints[-1])
    return TimedPath(carry.joints, carry.times)


# --- the arm ----------------------------------------------------------------------------------------------


def _as_it_is(arm: Arm, seed: int) -> Arm:
    """The arm with other masses than its parameter file says."""
    random = np.random.default_rng(seed)
    factors = 1.0 + KNOWN_TO * random.uniform(-1.0, 1.0, len(arm.masses))
    masses = (Mass(m.kg * f, m.centre, m.inertia * f) for m, f in zip(arm.masses, factors, strict=True))
    return replace(arm, masses=tuple(masses))


def _king() -> Mass:
    """In the gripper, in the tool's frame."""
    king = arm_table().pieces.king
    return Mass(king.mass / 1000.0, np.zeros(3), np.eye(3))


def _laws(arm: Arm, path: TimedPath, belts: Belts) -> dict[str, Law]:
    ways = (
        path,
        run_ahead(arm, path, belts, moving=False),
        run_ahead(arm, path, belts),
    )
    laws: list[Law] = [_by_belts(told, belts) for told in ways]
    return dict(zip(_NAMES, [*laws, _by_torque(arm, path)], strict=True))


def _by_belts(told: TimedPath, belts: Belts) -> Law:
    motors = smooth(told)

    def law(time: float, joints: Array, speeds: Array) -> Array:
        at = min(time, told.seconds)
        angle, speed = motors(at) - joints, motors(at, 1) - speeds
        return np.asarray(belts.stiffness * angle + belts.damping * speed)

    return law


def _by_torque(arm: Arm, path: TimedPath) -> Law:
    wanted = smooth(path)
    held, until = np.zeros(arm.n), 0.0

    def law(time: float, joints: Array, speeds: Array) -> Array:
        nonlocal held, until
        if time == 0.0 or time >= until:
            at = min(time, path.seconds)
            rate = wanted(at, 2) + 2 * STIFF * (wanted(at, 1) - speeds) + STIFF**2 * (wanted(at) - joints)
            held, until = torques(arm, joints, speeds, rate), time + _HOLD
        return held

    return law


def _at_rest(true: Arm, path: TimedPath, belts: Belts, load: Mass, law: Law) -> Array:
    """Where the joints hang at the start, after everything has come to rest."""
    joints: Array = path.joints[0]
    still = np.zeros(true.n)
    for _ in range(_SETTLING):
        joints = joints + (law(0.0, joints, still) - torques(true, joints, load=load)) / belts.stiffness
    return joints


_SETTLING = 30


# --- what comes of it -------------------------------------------------------------------------------------


def _error(arm: Arm, path: TimedPath, followed: Array) -> Array:
    """(m,) mm at each step."""
    times = np.minimum(np.arange(len(followed)) * STEP, path.seconds)
    wanted = forward(arm, smooth(path)(times))[:, :3, 3]
    off: Array = np.linalg.norm(forward(arm, followed)[:, :3, 3] - wanted, axis=1)
    return off


def _rms(error: Array) -> float:
    return float(np.sqrt(np.mean(error * error)))


def _drawn(paths: Mapping[str, TimedPath], errors: Mapping[str, Mapping[str, Array]]) -> str:
    charts: list[Chart] = []
    for title in paths:
        steps = np.linspace(0, len(errors[title]["plain"]) - 1, _POINTS).astype(int)
        lines: dict[str, Any] = {name: error[steps].tolist() for name, error in errors[title].items()}
        charts.append(Chart(title, "s", np.round(steps * STEP, 2).tolist(), lines))
    return draw_charts(charts, "The tool point behind belts that give", "mm off")
