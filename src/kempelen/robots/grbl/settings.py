"""Which ``$`` settings a controller must have for a work space, and what to send where it has not.

Source: the settings table of GRBL 1.1 (``settings.md``). Lengths mm, rates mm/min, accelerations mm/s².
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from kempelen.core.errors import SettingsError
from kempelen.core.table import WorkSpace
from kempelen.robots.grbl.gcode import number

_AXES = "xyz"
_TOLERANCE = 0.005  # relative; settings are stored as 32-bit floats and typed by people
_MAX_STEP_RATE = 30_000.0  # steps/s that the firmware can make
_COARSEST_STEP = 0.05  # mm
_Z_HOMES_DOWN = 4  # bit of $23


@dataclass(frozen=True, slots=True)
class Misfit:
    """A setting that does not fit.

    Attributes:
        value: What to set; None where only a person can know (steps per millimetre).
        why: One clause.
    """

    number: int
    have: float | None
    value: float | None
    why: str

    @property
    def line(self) -> str:
        """What to send, without the newline; empty where only a person can know."""
        return "" if self.value is None else f"${self.number}={number(self.value)}"

    def __str__(self) -> str:
        have = "missing" if self.have is None else number(self.have)
        return f"${self.number} is {have}: {self.why}" + (f"; send {self.line}" if self.line else "")


def check(settings: Mapping[int, float], space: WorkSpace) -> list[Misfit]:
    """Everything in ``settings`` (as ``$$`` lists them) that does not fit the work space."""
    return [*_modes(settings), *_rates(settings, space), *_steps(settings, space)]


def require(misfits: Sequence[Misfit], where: str) -> None:
    """Refuse a controller whose settings do not fit.

    Raises:
        SettingsError: with each misfit and the line that mends it.
    """
    if misfits:
        raise SettingsError(
            f"{where}: {len(misfits)} of the controller's settings do not fit this table: "
            + "; ".join(map(str, misfits))
            + ".",
            hint="Send these lines with any G-code sender, or connect once with apply_settings = true.",
        )


def _modes(settings: Mapping[int, float]) -> Iterator[Misfit]:
    wanted: Sequence[tuple[int, float, str]] = (
        (1, 255, "the motors must stay energised at rest, or the axes sag and lose their position"),
        (13, 0, "reports must be in millimetres"),
        (20, 1, "soft limits must guard the axes"),
        (21, 1, "hard limits must guard the axes"),
        (22, 1, "homing must be on, with reference switches"),
        (32, 0, "laser mode must be off"),
    )
    for key, value, why in wanted:
        if settings.get(key) != value:
            yield Misfit(key, settings.get(key), value, why)
    report = settings.get(10)
    if report not in {0, 1, 2, 3}:
        yield Misfit(10, report, 1, "status reports must carry a position")
    homing = settings.get(23)
    if homing is None or int(homing) & _Z_HOMES_DOWN:
        mended = 0 if homing is None else int(homing) & ~_Z_HOMES_DOWN
        yield Misfit(23, homing, mended, "z must home upwards, away from the pieces")


def _rates(settings: Mapping[int, float], space: WorkSpace) -> Iterator[Misfit]:
    groups = (
        (110, [60.0 * v for v in space.velocity], "mm/min", "highest rate"),
        (120, list(space.acceleration), "mm/s²", "acceleration"),
        (130, list(space.travel), "mm", "travel"),
    )
    for first, values, unit, what in groups:
        for axis, value in enumerate(values):
            have = settings.get(first + axis)
            if have is None or abs(have - value) > _TOLERANCE * value:
                yield Misfit(
                    first + axis, have, value, f"{what} of {_AXES[axis]} is {number(value)} {unit} here"
                )
    deviation = settings.get(11)
    if deviation is None or abs(deviation - space.junction_deviation) > _TOLERANCE:
        yield Misfit(
            11, deviation, space.junction_deviation, "paths are planned for this junction deviation in mm"
        )


def _steps(settings: Mapping[int, float], space: WorkSpace) -> Iterator[Misfit]:
    for axis, velocity in enumerate(space.velocity):
        steps = settings.get(100 + axis)
        if steps is None or steps * _COARSEST_STEP < 1:
            yield Misfit(
                100 + axis, steps, None, f"a step of {_AXES[axis]} must be {_COARSEST_STEP} mm or finer"
            )
        elif steps * velocity > _MAX_STEP_RATE:
            yield Misfit(
                100 + axis, steps, None,
                f"{_AXES[axis]} at {number(velocity)} mm/s would need {steps * velocity:.0f} steps/s, "
                f"the controller makes {_MAX_STEP_RATE:.0f}",
            )  # fmt: skip
