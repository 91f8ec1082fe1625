"""`kempelen bench kinematics`: inverse kinematics against EAIK and roboticstoolbox, on the same targets.

1,000 poses that the Lab-Volt 5150 can take, from random joint angles within its ranges. A solver has found
one when its joint angles meet the pose within 0.1 mm and 0.1°. Ratios are times: ``scalar_over_eaik`` is our
time per solve over EAIK's, so below 1 we are faster; below 0.1 is ten times as fast. EAIK (C++) hands back
all branches with no look at the ranges; ours looks, and hands back one that is within. Passes take turns,
the quickest one of each counts.
"""

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kempelen.bench.result import BenchResult, Progress
from kempelen.core.geometry import Array
from kempelen.kinematics import Arm, arm_names, forward, inverse_batch, load_arm
from kempelen.kinematics.closed import closed
from kempelen.kinematics.differential import pose_error

TARGETS = 1000
_ARM = "labvolt-5150"
_NEAR_MM, _NEAR_DEG = 0.1, 0.1
_PASSES = 7
_BATCH = 20_000
_BATCH_PASSES = 200  # short ones, so that some are not disturbed
_INSTALL = "not installed: uv sync --group peers, or pip install eaik roboticstoolbox-python"

Solve = Callable[[Array], Any]


@dataclass(frozen=True)
class _Peer:
    """A solver of others.

    Attributes:
        name: With its version.
        solve: One pose (4, 4) in mm to whatever it hands back: this is timed.
        joints: From that to our joint angles, (k, n) rad.
        passes: Over all targets.
    """

    name: str
    solve: Solve
    joints: Callable[[Any], Array]
    passes: int


def run(
    *, seed: int, pgn: Path | None, data: Path | None, progress: Progress, targets: int = TARGETS
) -> BenchResult:
    """Compare the solvers.

    Args:
        seed: Of the targets.
        pgn: Not used.
        data: Not used.
        progress: Told before each part.
        targets: How many.
    """
    del pgn, data
    arm = load_arm(_ARM)
    poses = forward(arm, _random_joints(arm, targets, seed))
    progress("found", 0.0)
    ours = [closed(arm).solve_pose(pose) for pose in poses]
    peers = {kind: make(arm) for kind, make in (("eaik", _eaik), ("rtb", _rtb))}
    progress("one at a time", 0.1)
    times = _timed(closed(arm).solve_pose, list(poses), [peer for peer in peers.values() if peer])
    progress("many at once", 0.8)
    figures = _found(arm, poses, ours)
    rows = [_row("kempelen, closed form", figures, times[0], times[0])]
    figures |= _batch(arm, seed)
    counted = iter(times[1:])
    for kind, peer in peers.items():
        if peer is None:
            rows.append(_absent(kind))
            continue
        spent = next(counted)
        figures[f"scalar_over_{kind}"] = round(times[0] / spent, 4)
        rows.append(_row(peer.name, _peer_found(arm, poses, peer), spent, times[0]))
    if peers["eaik"]:
        figures |= _agreement(arm, poses, ours, peers["eaik"])
    progress("other arms", 0.95)
    return BenchResult(
        "kinematics", figures, rows + [_other_arm(name, targets, seed) for name in arm_names()]
    )


def _random_joints(arm: Arm, count: int, seed: int) -> Array:
    low, high = arm.ranges.T
    return np.random.default_rng(seed).uniform(low, high, (count, arm.n))


def _found(arm: Arm, poses: Array, answers: Sequence[Sequence[float] | None]) -> dict[str, float]:
    """Share that meets the pose within the ranges, and how near the worst one comes."""
    joints = np.array([answer if answer is not None else [np.nan] * arm.n for answer in answers])
    there = np.isfinite(joints).all(axis=1)
    off = pose_error(poses[there], forward(arm, joints[there]))
    mm, deg = np.linalg.norm(off[:, :3], axis=1), np.degrees(np.linalg.norm(off[:, 3:], axis=1))
    met = (mm <= _NEAR_MM) & (deg <= _NEAR_DEG)
    within = arm.within(joints[there])
    return {
        "found_share": float((met & within).sum()) / len(poses),
        "met_share": float(met.sum()) / len(poses),
        "worst_mm": float(mm[met].max(initial=0.0)),
        "worst_deg": float(deg[met].max(initial=0.0)),
    }


def _peer_found(arm: Arm, poses: Array, peer: _Peer) -> dict[str, float]:
    """Of each answer the branch within the ranges, where there is one."""
    answers: list[list[float] | None] = []
    for pose in poses:
        joints = peer.joints(peer.solve(pose))
        good = joints[arm.within(joints)] if len(joints) else joints
        best = good if len(good) else joints
        answers.append(best[0].tolist() if len(best) else None)
    return _found(arm, poses, answers)


def _timed(ours: Solve, poses: list[Array], peers: Sequence[_Peer]) -> list[float]:
    """Seconds per solve of us and of each peer: the quickest of some passes, taken in turns."""
    solvers = [(ours, _PASSES), *((peer.solve, peer.passes) for peer in peers)]
    best = [np.inf] * len(solvers)
    for number in range(_PASSES):
        for which, (solve, passes) in enumerate(solvers):
            if number < passes:
                began = time.perf_counter()
                for pose in poses:
                    solve(pose)
                best[which] = min(best[which], (time.perf_counter() - began) / len(poses))
    return best


def _batch(arm: Arm, seed: int) -> dict[str, float]:
    """Solves per second on one core, 20,000 a call: both elbows, base ahead; and all four branches."""
    poses = forward(arm, _random_joints(arm, _BATCH, seed + 1))
    views = [closed(arm).views(pose)[0] for pose in poses]
    positions = np.array([view[0] for view in views])
    pitches = np.array([np.pi - view[1] for view in views])
    rolls = np.array([view[2] for view in views])
    rates: dict[str, float] = {}
    for name, flipped in (("batch_per_s", False), ("batch_all_branches_per_s", True)):
        best = np.inf
        for _ in range(_BATCH_PASSES):
            began = time.perf_counter()
            found = inverse_batch(arm, positions, pitches, rolls, flipped=flipped)
            best = min(best, time.perf_counter() - began)
        rates[name] = round(len(positions) / best)
    rates["batch_found_share"] = float(found.within.any(axis=1).mean())
    return rates


def _agreement(arm: Arm, poses: Array, ours: Sequence[Any], peer: _Peer) -> dict[str, float]:
    """How far our joint angles are from EAIK's nearest ones, and our tool points from its own."""
    joints = np.array(ours, dtype=np.float64)
    worst_rad = 0.0
    for pose, mine in zip(poses, joints, strict=True):
        theirs = peer.joints(peer.solve(pose))
        off = np.abs(np.remainder(theirs - mine + np.pi, 2 * np.pi) - np.pi).max(axis=1)
        worst_rad = max(worst_rad, float(off.min()))
    return {"eaik_worst_rad": worst_rad, "eaik_worst_mm": _eaik_forward_off(arm, joints)}


def _other_arm(name: str, targets: int, seed: int) -> dict[str, Any]:
    arm = load_arm(name)
    poses = forward(arm, _random_joints(arm, targets, seed))
    found = _found(arm, poses, [closed(arm).solve_pose(pose) for pose in poses])
    return {
        "arm": name,
        "n": targets,
        "found_share": found["found_share"],
        "worst_mm": found["worst_mm"],
        "worst_deg": found["worst_deg"],
    }


def _row(name: str, found: dict[str, float], spent: float, ours: float) -> dict[str, Any]:
    return {
        "solver": name,
        "met_share": found["met_share"],
        "found_share": found["found_share"],
        "us_per_solve": round(1e6 * spent, 3),
        "times_ours": round(spent / ours, 2),
        "note": "",
    }


def _absent(kind: str) -> dict[str, Any]:
    name = {"eaik": "EAIK", "rtb": "roboticstoolbox"}[kind]
    gap: dict[str, Any] = dict.fromkeys(("met_share", "found_share", "us_per_solve", "times_ours"), "")
    return {"solver": name, **gap, "note": _INSTALL}


def _eaik_robot(arm: Arm) -> Any | None:
    try:
        from eaik.IK_DH import DhRobot  # noqa: PLC0415 - a peer that may not be there
    except ImportError:
        return None
    links = arm.links
    return DhRobot(*(np.array([getattr(link, what) for link in links]) for what in ("alpha", "a", "d")))


def _eaik(arm: Arm) -> _Peer | None:
    robot = _eaik_robot(arm)
    if robot is None:
        return None
    offsets = np.array([link.offset for link in arm.links])
    middles = arm.ranges.mean(axis=1)

    def joints(answer: Any) -> Array:
        raw = np.asarray(answer.Q, dtype=np.float64).reshape(-1, arm.n) - offsets
        return np.asarray(raw - 2 * np.pi * np.rint((raw - middles) / (2 * np.pi)))

    return _Peer("EAIK (C++), all branches", robot.IK, joints, _PASSES)


def _eaik_forward_off(arm: Arm, joints: Array) -> float:
    robot = _eaik_robot(arm)
    if robot is None:
        return np.nan
    offsets = np.array([link.offset for link in arm.links])
    theirs = np.array([robot.fwdKin(one + offsets)[:3, 3] for one in joints])
    return float(np.linalg.norm(theirs - forward(arm, joints)[:, :3, 3], axis=1).max())


def _rtb(arm: Arm) -> _Peer | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import roboticstoolbox as rtb  # noqa: PLC0415 - a peer that may not be there
    except ImportError:
        return None
    links = [
        rtb.RevoluteDH(a=link.a / 1000, alpha=link.alpha, d=link.d / 1000, offset=link.offset, qlim=limits)
        for link, limits in zip(arm.links, arm.ranges, strict=True)
    ]
    chain = rtb.DHRobot(links).ets()  # metres: its stopping rule adds m² and rad²

    def solve(pose: Array) -> Any:
        scaled = pose.copy()
        scaled[:3, 3] /= 1000
        return chain.ik_LM(scaled, tol=1e-12)

    def joints(answer: Any) -> Array:
        return np.asarray(answer.q, dtype=np.float64).reshape(1, arm.n)

    return _Peer("roboticstoolbox ik_LM, tol 1e-12", solve, joints, 3)
