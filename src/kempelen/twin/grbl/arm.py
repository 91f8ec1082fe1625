"""A virtual multi-axis controller with an arm behind it.

For whoever simulates the world around it: `VirtualArm` has the face that `kempelen.twin.latch.VirtualLatch`
has too.

* Wire: ``receive(data)``, ``take_output()``, ``reset_by_dtr()``.
* Time: ``advance(dt)``, ``time_s``, ``idle()``, ``starving()``, ``settled_at``, ``assume_homed()``.
* Truth: ``joints`` (n,) rad, what the file's coupling makes of where the motors truly are (steps lost
  included); ``motors`` (n,) rad, where they truly are, counted from joint angles 0; ``told`` (n,) rad of the
  motors, what the controller makes of them since its last homing (what was lost since then not included);
  ``homings``, how often it has been homed; ``gripper_closed``.
* Faults: ``faults``, a `kempelen.twin.grbl.Faults`: axes are joints, base first.
* Keeping: ``snapshot()``, ``restore(state)``.
"""

from collections.abc import Sequence
from math import radians

import numpy as np

from kempelen.core.errors import TwinError
from kempelen.kinematics.arm import Arm
from kempelen.motion.arm.motors import Motors
from kempelen.twin.grbl.controller import VirtualGrbl
from kempelen.twin.grbl.dialect import GRBLHAL, Dialect
from kempelen.twin.grbl.faults import Faults
from kempelen.twin.grbl.joints import ArmMachine
from kempelen.twin.grbl.settings import Eeprom, Vec, default_values

_POWER_UP = 20.0  # degrees off its switch, where a joint happens to be when the power comes on


class VirtualArm(VirtualGrbl):
    """An arm's motors behind a virtual controller of the GRBL family.

    Args:
        arm: By its parameter file.
        joints: True joint angles at power-up, rad; None for somewhere near home.
        faults: What goes wrong; None for nothing.
        baud: Speed of the serial line, bit/s; 0 for one without delay.
        dialect: Of the firmware.

    Raises:
        TwinError: the firmware has another number of axes than the arm has joints.
    """

    def __init__(
        self,
        arm: Arm,
        joints: Sequence[float] | None = None,
        *,
        faults: Faults | None = None,
        baud: int = 0,
        dialect: Dialect = GRBLHAL,
    ) -> None:
        motors = Motors.of(arm)
        if len(dialect.axes) != arm.n:
            raise TwinError(
                f"{dialect.name} has {len(dialect.axes)} axes here, {arm.name} has {arm.n} joints.",
                hint="Choose an arm of as many joints.",
            )
        self.arm = arm
        self._joint_axes = motors
        self._arm_machine = ArmMachine(motors, parked(motors) if joints is None else joints)
        super().__init__(self._arm_machine, eeprom=_memory(motors, dialect), faults=faults, baud=baud)

    @property
    def joints(self) -> Vec:
        """(n,) rad, true joint angles as far as motors and the file's coupling make them."""
        return tuple(map(radians, self._arm_machine.joints_deg))

    @property
    def motors(self) -> Vec:
        """(n,) rad, where the motors truly are, counted from joint angles 0."""
        return tuple(map(radians, self._arm_machine.position))

    @property
    def told(self) -> Vec:
        """(n,) rad, where the controller believes the motors to be; right after homing it is `motors`."""
        named = self._joint_axes.machine_from_work
        return tuple(map(radians, np.subtract(self._arm_machine.motor, named).tolist()))

    @property
    def gripper_closed(self) -> bool:
        """What the outputs say: without current it is closed."""
        return not self.flood_on


def parked(motors: Motors) -> Vec:
    """(n,) rad: every joint a little off its switch."""
    angles = np.radians(motors.switches - motors.towards * _POWER_UP)
    return tuple(np.clip(angles, *motors.arm.ranges.T).tolist())


def _memory(motors: Motors, dialect: Dialect) -> Eeprom:
    settings = default_values(tuple(motors.travel.tolist())) | motors.settings()
    return Eeprom.for_travel(tuple(motors.travel.tolist()), settings, dialect)
