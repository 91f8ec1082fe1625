"""What distinguishes one firmware of the GRBL family from another on the wire.

The behaviour is that of GRBL 1.1h as measured. grblHAL's texts, its axes beyond Z, its homing cycles and its
larger buffers follow its published sources and the senders that work with it; FluidNC's likewise.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Dialect:
    """A firmware, as built.

    Attributes:
        name: For people.
        axes: Letters in the order of reports.
        banner: What it greets with.
        info: Lines of ``$I``; ``{}`` stands for the user's own text.
        blocks: How many the planner holds.
        ring: Bytes of the receive buffer.
        cycles: Whether ``$44`` to ``$48`` say which axes home in which order.
    """

    name: str
    axes: str
    banner: str
    info: str
    blocks: int = 15
    ring: int = 128
    cycles: bool = False


GRBL = Dialect(
    name="GRBL 1.1h",
    axes="XYZ",
    banner="\r\nGrbl 1.1h ['$' for help]\r\n",
    info="[VER:1.1h.20190830:{}]\r\n[OPT:V,15,128]\r\n",
)
GRBLHAL = Dialect(
    name="grblHAL",
    axes="XYZAB",
    banner="\r\nGrblHAL 1.1f ['$' or '$HELP' for help]\r\n",
    info=(
        "[VER:1.1f.20240907:{}]\r\n[OPT:VNMSL,35,1024,5,0]\r\n[AXS:5:XYZAB]\r\n"
        "[NEWOPT:ENUMS,RT-,HOME]\r\n[FIRMWARE:grblHAL]\r\n"
    ),
    blocks=35,
    ring=1024,
    cycles=True,
)
FLUIDNC = Dialect(
    name="FluidNC",
    axes="XYZAB",
    banner="\r\nGrbl 3.7 [FluidNC v3.7.12 (noradio) '$' for help]\r\n",
    info="[VER:3.7 FluidNC v3.7.12:{}]\r\n[OPT:MPHS]\r\n[MSG: Machine: Kempelen arm]\r\n",
    blocks=16,
    ring=256,
    cycles=True,
)
BY_NAME = {"grbl": GRBL, "grblhal": GRBLHAL, "fluidnc": FLUIDNC}
