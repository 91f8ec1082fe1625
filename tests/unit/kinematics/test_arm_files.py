"""Parameter files of arms: the built-in ones are whole, and wrong ones say what is wrong."""

import re
from pathlib import Path

import numpy as np
import pytest

from kempelen.core.errors import ConfigError
from kempelen.kinematics import Arm, arm_names, load_arm

_PAPER_WIDTHS = (338, 181, 198, 185, 360)


def _text(name: str = "labvolt-5150") -> str:
    return (Path("src/kempelen/data/arms") / f"{name}.toml").read_text(encoding="utf-8")


def _load(tmp_path: Path, text: str) -> Arm:
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return load_arm(path)


def test_the_arms_that_are_known() -> None:
    assert arm_names() == ["catalyst-5", "labvolt-5150", "scorbot-er-v-plus", "so-101"]


@pytest.mark.parametrize("name", arm_names())
def test_a_built_in_arm_is_whole(name: str) -> None:
    arm = load_arm(name)
    assert arm.n == 5
    assert arm.within(arm.home)
    assert arm.title
    assert {"links", "range", "velocity", "steps"} <= set(arm.sources)
    assert arm.joint_from_motor @ arm.motor_from_joint == pytest.approx(np.eye(5))
    assert arm.bodies


def test_the_5150_is_the_papers() -> None:
    arm = load_arm("labvolt-5150")
    assert np.degrees(np.diff(arm.ranges, axis=1).ravel()) == pytest.approx(_PAPER_WIDTHS)
    assert [(link.a, link.d) for link in arm.links] == [(0, 255), (190, 0), (190, 0), (0, 0), (0, 115)]
    assert "unverified" in arm.sources["range"]


def test_its_coupling_is_the_papers() -> None:
    arm = load_arm("labvolt-5150")
    shoulder = np.linalg.solve(arm.motor_from_joint, [0, 1, 0, 0, 0])
    elbow = np.linalg.solve(arm.motor_from_joint, [0, 0, 1, 0, 0])
    assert abs(shoulder[2]) == pytest.approx(1)
    assert abs(elbow[3]) == pytest.approx(1)


def test_arrays_cannot_be_written_to() -> None:
    with pytest.raises(ValueError, match="read-only"):
        load_arm("labvolt-5150").ranges[0, 0] = 0


def test_an_unknown_name_names_the_known_ones() -> None:
    with pytest.raises(ConfigError, match="no arm called 'scara'.*labvolt-5150"):
        load_arm("scara")


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read: No such file or directory\\."):
        load_arm(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("a_mm = 190", 'a_mm = "long"', r"joint\.2\.a_mm: .*number"),
        ("a_mm = 190", "length_mm = 190", r"joint\.2\.length_mm: .*not permitted"),
        (
            "range_deg = [-32, 149]",
            "range_deg = [149, -32]",
            "joint shoulder: its range 149° to -32° is empty",
        ),
        ("home_deg = 90", "home_deg = 170", "joint shoulder: home at 170° lies outside -32° to 149°"),
        ("velocity_deg_s = 60", "velocity_deg_s = 0", r"joint\.1\.velocity_deg_s: .*greater than 0"),
        ("[0, -1, 1, 0, 0],", "[0, 1, 0, 0, 0],", "coupling matrix cannot be inverted"),
        ("[0, -1, 1, 0, 0],", "", r"motor_from_joint has rows of \[5, 5, 5, 5\] numbers"),
        ("[0, -1, 1, 0, 0],", "[0, -1],", r"rows of \[5, 5, 2, 5, 5\] numbers"),
        ("radius_mm = 70", "radius_mm = -1", r"body\.1\.radius_mm"),
        ("link = 5", "link = 9", "a body on link 9"),
        (
            "mass = { kg = 4.0, centre_mm = [0, -60, 0], inertia_kg_mm2 = [16000, 14000, 16000] }",
            "",
            "no mass for base",
        ),
        ("[sources]", "[sources]\n#", None),
        ("title = ", "title ", "is no TOML"),
        ("a_mm = 190", "a_mm = inf", r"joint\.2\.a_mm: .*finite"),
    ],
)
def test_what_is_wrong_is_told(tmp_path: Path, old: str, new: str, told: str | None) -> None:
    assert old in _text()
    text = _text().replace(old, new, 1)
    if told is None:
        assert _load(tmp_path, text).n == 5
        return
    with pytest.raises(ConfigError, match=told):
        _load(tmp_path, text)


def test_numbers_without_a_source_are_refused(tmp_path: Path) -> None:
    text = re.sub(r"^jerk = .*$", "", _text(), count=1, flags=re.MULTILINE)
    with pytest.raises(ConfigError, match="does not say where these numbers come from: jerk"):
        _load(tmp_path, text)


def test_a_file_of_ones_own(tmp_path: Path) -> None:
    arm = _load(tmp_path, _text())
    assert arm.name == "mine"
    assert arm.ranges == pytest.approx(load_arm("labvolt-5150").ranges)
