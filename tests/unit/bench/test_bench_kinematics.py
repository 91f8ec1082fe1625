"""The bench of the kinematics: its figures, and what it says where a peer is missing."""

import numpy as np
import pytest

from kempelen.bench import kinematics
from kempelen.kinematics import forward, load_arm
from kempelen.kinematics.closed import closed


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kinematics, "_BATCH", 2000)
    monkeypatch.setattr(kinematics, "_BATCH_PASSES", 2)
    monkeypatch.setattr(kinematics, "_PASSES", 1)


def test_all_are_found_and_absent_peers_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kinematics, "_eaik", lambda _: None)
    monkeypatch.setattr(kinematics, "_rtb", lambda _: None)
    told: list[float] = []
    result = kinematics.run(
        seed=1, pgn=None, data=None, progress=lambda _, done: told.append(done), targets=40
    )
    assert result.figures["found_share"] == 1.0
    assert result.figures["batch_found_share"] == 1.0
    assert result.figures["batch_per_s"] > 0
    assert "scalar_over_eaik" not in result.figures
    assert [row["note"] for row in result.rows if "uv sync --group peers" in row.get("note", "")]
    assert [row["found_share"] for row in result.rows if "arm" in row] == [1.0] * 4
    assert told == sorted(told)


def test_an_answer_that_misses_the_pose_is_not_found() -> None:
    arm = load_arm("labvolt-5150")
    poses = forward(arm, np.tile(arm.home, (4, 1)))
    off = arm.home + np.array([0.01, 0, 0, 0, 0])
    far = arm.home + np.array([0, 0, 0, 0, 2 * np.pi])
    found = kinematics._found(arm, poses, [arm.home.tolist(), off.tolist(), far.tolist(), None])
    assert found["met_share"] == 0.5
    assert found["found_share"] == 0.25


def test_eaik_is_the_oracle() -> None:
    pytest.importorskip("eaik", reason="EAIK is not installed: uv sync --group peers")
    arm = load_arm("labvolt-5150")
    peer = kinematics._eaik(arm)
    assert peer is not None
    poses = forward(arm, kinematics._random_joints(arm, 200, 7))
    ours = [closed(arm).solve_pose(pose) for pose in poses]
    agreement = kinematics._agreement(arm, poses, ours, peer)
    assert agreement["eaik_worst_rad"] < 1e-9
    assert agreement["eaik_worst_mm"] < 1e-9
