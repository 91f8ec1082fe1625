"""Parameter files of arms: `load_arm("labvolt-5150")` or `load_arm("my-arm.toml")`.

In a file angles are degrees, as in data sheets, and every group of numbers has to say where it comes from.
"""

import tomllib
from importlib.resources import files
from math import radians
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from kempelen.core.errors import ConfigError
from kempelen.kinematics.arm import Arm, Body, Drift, Link, Mass

_Point = tuple[float, float, float]
_Above0 = Annotated[float, Field(gt=0)]
_AtLeast0 = Annotated[float, Field(ge=0)]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class DriftFile(_Model):
    """Of one joint: lost at each stop (always, and spread), play, shift by warmth."""

    stop_bias_deg: float = 0.0
    stop_spread_deg: _AtLeast0 = 0.0
    play_deg: _AtLeast0 = 0.0
    temperature_deg_per_k: float = 0.0


class MassFile(_Model):
    """Of one link: mass, centre in the frame after its joint, moments of inertia about the centre."""

    kg: _Above0
    centre_mm: _Point = (0.0, 0.0, 0.0)
    inertia_kg_mm2: tuple[_AtLeast0, _AtLeast0, _AtLeast0] = (0.0, 0.0, 0.0)


class JointFile(_Model):
    """One joint with the link after it."""

    name: str
    a_mm: float
    alpha_deg: float
    d_mm: float
    offset_deg: float = 0.0
    range_deg: tuple[float, float]
    velocity_deg_s: _Above0
    acceleration_deg_s2: _Above0
    jerk_deg_s3: _Above0
    steps_per_deg: _Above0
    home_deg: float = 0.0
    drift: DriftFile = DriftFile()
    mass: MassFile | None = None


class BodyFile(_Model):
    """A capsule: the link it moves with, two points in that link's frame, its radius."""

    link: Annotated[int, Field(ge=0)]
    start_mm: _Point
    end_mm: _Point
    radius_mm: _Above0


class ToolFile(_Model):
    """A fixed row after the last joint, to the tool point."""

    a_mm: float = 0.0
    alpha_deg: float = 0.0
    d_mm: float = 0.0
    turn_deg: float = 0.0

    def row(self) -> Link:
        """In radians."""
        return _row(self.a_mm, self.alpha_deg, self.d_mm, self.turn_deg)


class ArmFile(_Model):
    """A whole file; `sources` names each group of numbers."""

    title: str
    sources: dict[str, str]
    joint: Annotated[list[JointFile], Field(min_length=3, max_length=7)]
    motor_from_joint: list[list[float]] | None = None
    body: list[BodyFile] = []
    tool: ToolFile | None = None

    @model_validator(mode="after")
    def _sourced(self) -> Self:
        missing = [name for name in self.groups() if not self.sources.get(name, "").strip()]
        if missing:
            raise ValueError(f"sources does not say where these numbers come from: {', '.join(missing)}")
        return self

    def groups(self) -> list[str]:
        """The groups of numbers that the file holds."""
        found = ["links", "range", "velocity", "acceleration", "jerk", "steps", "home"]
        found += ["drift"] * any("drift" in one.model_fields_set for one in self.joint)
        found += ["mass"] * any(one.mass is not None for one in self.joint)
        found += ["tool"] * (self.tool is not None)
        found += ["coupling"] * (self.motor_from_joint is not None)
        return found + ["body"] * bool(self.body)

    def arm(self, name: str) -> Arm:
        """The arm itself, in radians."""
        joints = self.joint
        return Arm(
            name=name,
            title=self.title,
            sources=self.sources,
            joint_names=tuple(one.name for one in joints),
            links=tuple(_row(one.a_mm, one.alpha_deg, one.d_mm, one.offset_deg) for one in joints),
            ranges=np.radians([one.range_deg for one in joints]),
            velocity=np.radians([one.velocity_deg_s for one in joints]),
            acceleration=np.radians([one.acceleration_deg_s2 for one in joints]),
            jerk=np.radians([one.jerk_deg_s3 for one in joints]),
            coupling=np.array(self._coupling(name)),
            steps_per_rad=np.degrees([one.steps_per_deg for one in joints]),
            home=np.radians([one.home_deg for one in joints]),
            drift=self._drift(),
            bodies=tuple(Body(one.link, one.start_mm, one.end_mm, one.radius_mm) for one in self.body),
            masses=self._masses(name),
            tool=self.tool.row() if self.tool else None,
        )

    def _coupling(self, name: str) -> list[list[float]]:
        n = len(self.joint)
        rows = self.motor_from_joint if self.motor_from_joint is not None else np.eye(n).tolist()
        if len(rows) != n or any(len(row) != n for row in rows):
            raise ConfigError(
                f"Arm {name}: motor_from_joint has rows of {[len(row) for row in rows]} numbers, not "
                f"{n} rows of {n}.",
                hint="One row a motor, one number a joint.",
            )
        return rows

    def _drift(self) -> Drift:
        of = [one.drift for one in self.joint]
        return Drift(
            stop_bias=np.radians([one.stop_bias_deg for one in of]),
            stop_spread=np.radians([one.stop_spread_deg for one in of]),
            play=np.radians([one.play_deg for one in of]),
            temperature=np.radians([one.temperature_deg_per_k for one in of]),
        )

    def _masses(self, name: str) -> tuple[Mass, ...]:
        known = [one.mass for one in self.joint if one.mass is not None]
        if known and len(known) != len(self.joint):
            without = [one.name for one in self.joint if one.mass is None]
            raise ConfigError(
                f"Arm {name}: no mass for {', '.join(without)}.", hint="Give every link's mass, or none."
            )
        return tuple(Mass(one.kg, np.array(one.centre_mm), np.diag(one.inertia_kg_mm2)) for one in known)


def arm_names() -> list[str]:
    """The arms that Kempelen knows."""
    folder = files("kempelen") / "data" / "arms"
    return sorted(one.name.removesuffix(".toml") for one in folder.iterdir() if one.name.endswith(".toml"))


def load_arm(name_or_path: str | Path) -> Arm:
    """An arm by its name, or by the path of a parameter file.

    Raises:
        ConfigError: there is no such arm or file, or the file is wrong: where and how.
    """
    name, text = _read(name_or_path)
    try:
        return ArmFile.model_validate(tomllib.loads(text)).arm(name)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"Arm {name}: the parameter file is no TOML: {error}.") from error
    except ValidationError as error:
        raise ConfigError(
            f"Arm {name}: {_told(error)}.", hint="docs/how-to/describe-an-arm.md tells every key."
        ) from error


def _read(name_or_path: str | Path) -> tuple[str, str]:
    known = arm_names()
    if str(name_or_path) in known:
        source = files("kempelen") / "data" / "arms" / f"{name_or_path}.toml"
        return str(name_or_path), source.read_text(encoding="utf-8")
    path = Path(name_or_path)
    if path.suffix != ".toml":
        raise ConfigError(
            f"There is no arm called {str(name_or_path)!r}.",
            hint=f"Known: {', '.join(known)}; or give the path of a .toml file.",
        )
    try:
        return path.stem, path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise ConfigError(
            f"The arm's parameter file {path} cannot be read: {why}.",
            hint=f"Name another one (robot.options.arm), or one of: {', '.join(known)}.",
        ) from error


def _told(error: ValidationError) -> str:
    def one(place: tuple[int | str, ...], message: str) -> str:
        where = ".".join(str(part + 1) if isinstance(part, int) else part for part in place)
        return f"{where or 'the file'}: {message.removeprefix('Value error, ')}"

    return "; ".join(one(found["loc"], found["msg"]) for found in error.errors())


def _row(a: float, alpha_deg: float, d: float, offset_deg: float) -> Link:
    return Link(a, radians(alpha_deg), d, radians(offset_deg))
