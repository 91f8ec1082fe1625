"""A virtual GRBL 1.1h controller and its machine: bytes and seconds in, bytes and positions out."""

from kempelen.twin.grbl.controller import VirtualGrbl
from kempelen.twin.grbl.execute import Execution, execute
from kempelen.twin.grbl.faults import Faults
from kempelen.twin.grbl.machine import Machine
from kempelen.twin.grbl.settings import Eeprom, Settings

__all__ = ["Eeprom", "Execution", "Faults", "Machine", "Settings", "VirtualGrbl", "execute"]
