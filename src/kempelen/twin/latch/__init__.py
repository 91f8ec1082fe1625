"""A virtual latch bridge with an arm behind it; it has the face of `kempelen.twin.grbl.arm.VirtualArm`."""

from kempelen.twin.latch.bridge import VirtualLatch

__all__ = ["VirtualLatch"]
