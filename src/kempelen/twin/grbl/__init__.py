"""A virtual controller of the GRBL family and its machine: bytes and seconds in, bytes and positions out."""

from kempelen.twin.grbl.arm import VirtualArm
from kempelen.twin.grbl.controller import VirtualGrbl
from kempelen.twin.grbl.dialect import FLUIDNC, GRBL, GRBLHAL, Dialect
from kempelen.twin.grbl.execute import Execution, execute
from kempelen.twin.grbl.faults import Faults
from kempelen.twin.grbl.machine import Machine
from kempelen.twin.grbl.settings import Eeprom, Settings

__all__ = [
    "FLUIDNC",
    "GRBL",
    "GRBLHAL",
    "Dialect",
    "Eeprom",
    "Execution",
    "Faults",
    "Machine",
    "Settings",
    "VirtualArm",
    "VirtualGrbl",
    "execute",
]
