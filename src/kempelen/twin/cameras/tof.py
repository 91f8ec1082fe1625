"""Depth by time of flight: what the surface, the light's way and the pixel's size do to it.

Two stages. What does not change from frame to frame is worked out once, where the scene has changed:
the mixed depth on a grid finer than the pixels, the bias and the spread of each pixel. A frame is then a
pixel's choice of a point of that grid (lateral noise), a random number (axial noise) and a throw of dice
(drop-outs).
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Depth
from kempelen.twin.cameras.fields import Bank
from kempelen.twin.cameras.models import CameraModel
from kempelen.twin.cameras.noise import Noise
from kempelen.twin.cameras.optics import DepthOptics
from kempelen.twin.cameras.region import Region
from kempelen.twin.cameras.surfaces import GLOSSY_IR, Surfaces

_WRAP = 1874.0
"""Depth at which the phase at 80 MHz starts anew, mm."""
_EDGE = 3.0
"""Depths within a pixel that differ by less are one surface, mm."""
_WIGGLE_MEAN, _WIGGLE = -4.0, 11.0
"""Together -15 to +7 mm over the range."""
_FOOT = 12.0
"""Over this distance multipath beside a piece falls to 1/e, mm."""
_REACH = 6
"""Lateral noise looks at most this many grid points aside."""
_LEAST_IR = 0.04


@dataclass(slots=True)
class Expectation:
    """What every frame of an unchanged scene has in common, for each of the (h, w) pixels.

    Attributes:
        grid: Mixed depth on the fine grid, mm, with a rim of ``_REACH``.
        bias: mm.
        spread: mm.
        loss: Probability that nothing is reported.
    """

    grid: Depth
    bias: Depth
    spread: Depth
    loss: Depth


class TimeOfFlight:
    """A time-of-flight sensor.

    Args:
        model: Its optics.
        optics: The grid of rays that it is drawn with.
        rng: Of its noise.
    """

    def __init__(self, model: CameraModel, optics: DepthOptics, rng: np.random.Generator) -> None:
        height, width = model.depth.height, model.depth.width
        self._model, self._optics, self._fine = model, optics, optics.fine
        self._axial = Bank.normal(rng, height, width)
        self._aside = (Bank.normal(rng, height, width), Bank.normal(rng, height, width))
        self._dice = Bank.uniform(rng, height, width)
        row, column = np.mgrid[:height, :width] * self._fine + self._fine // 2 + _REACH
        self._stride = width * self._fine + 2 * _REACH
        self._middle: npt.NDArray[np.int32] = (row * self._stride + column).astype(np.int32)

    reach = 14
    """Pixels over which what is there changes what is measured: multipath."""

    def blank(self) -> Expectation:
        """Of a camera that has not looked yet."""
        lens, fine = self._model.depth, self._fine
        shape = (lens.height, lens.width)
        grid = np.zeros((fine * shape[0] + 2 * _REACH, fine * shape[1] + 2 * _REACH), np.float32)
        bias, spread, loss = np.zeros((3, *shape), np.float32)
        return Expectation(grid, bias, spread, loss)

    def expect(self, into: Expectation, seen: Surfaces, noise: Noise, taken: Region, kept: Region) -> None:
        """Everything but chance.

        Args:
            into: What is to be brought up to date.
            seen: Of the pixels ``taken``.
            noise: What goes wrong.
            taken: A part of the picture.
            kept: The part of it whose surroundings were seen as well.
        """
        grid = _mixed(seen, self._fine) if noise.flying else seen.fine_depth
        z = seen.depth
        metres: Depth = z * np.float32(1e-3)
        spread = noise.axial * _axial(metres, seen.angle)
        if noise.dark_spread:
            spread /= np.sqrt(np.maximum(seen.infrared, _LEAST_IR))
        bias = noise.offset + noise.dark_offset * (1 - np.minimum(seen.infrared, 1))
        bias += noise.wiggling * (_WIGGLE_MEAN + _WIGGLE * np.sin(metres * (math.tau * 1000 / _WRAP)))
        if noise.multipath:
            bias += noise.multipath * np.exp(seen.foot_distance * (-1 / _FOOT))
        loss = noise.dropout * (seen.glossy & (seen.infrared < GLOSSY_IR))
        part = kept.within(taken)
        into.bias[kept.slices], into.spread[kept.slices] = bias[part], spread[part]
        into.loss[kept.slices] = loss[part]
        fine = self._fine
        core = into.grid[_REACH:-_REACH, _REACH:-_REACH]
        core[kept.times(fine).slices] = grid[kept.times(fine).within(taken.times(fine))]
        into.grid[:_REACH], into.grid[-_REACH:] = into.grid[_REACH], into.grid[-_REACH - 1]
        into.grid[:, :_REACH] = into.grid[:, _REACH : _REACH + 1]
        into.grid[:, -_REACH:] = into.grid[:, -_REACH - 1 : -_REACH]

    def measure(self, expected: Expectation, noise: Noise) -> Depth:
        """A frame: (h, w) mm."""
        out: Depth = expected.grid.ravel()[self._where(expected, noise)]
        empty = out <= 0
        out += expected.bias
        if noise.axial:
            out += expected.spread * self._axial.cut()
        if noise.dropout:
            empty |= self._dice.cut() < expected.loss
        empty |= (out < self._model.nearest) | (out > self._model.farthest)
        out[empty] = 0
        return out

    def _where(self, expected: Expectation, noise: Noise) -> npt.NDArray[np.int32]:
        """(h, w) the points of the grid that the pixels look at this time."""
        if not noise.lateral:
            return self._middle
        pitch = float(np.median(expected.grid[:: 4 * self._fine, :: 4 * self._fine])) / self._model.depth.fx
        scale = np.float32(noise.lateral * self._fine / max(pitch, 1e-3))
        across, down = (
            np.clip(np.rint(bank.cut() * scale), -_REACH, _REACH).astype(np.int32) for bank in self._aside
        )
        out: npt.NDArray[np.int32] = self._middle + down * self._stride + across
        return out


def _axial(metres: Depth, angle: Depth) -> Depth:
    """Spread of depth, mm (Fankhauser et al. 2015)."""
    ratio = angle / np.maximum(math.pi / 2 - angle, 0.05)
    out: Depth = 1.5 - 0.5 * metres + 0.3 * metres**2 + 0.1 * metres**1.5 * ratio**2
    return np.maximum(out, 0.1)


def _mixed(seen: Surfaces, fine: int) -> Depth:
    """(fine h, fine w) depth of a pixel's footprint centred on each point: its phasors A·e^{iφ} summed."""
    depth = seen.fine_depth
    kernel = np.ones((fine, fine), np.uint8)
    uneven = cv2.dilate(depth, kernel) - cv2.erode(depth, kernel) > _EDGE
    rows, columns = np.nonzero(uneven)
    if not len(rows):
        return depth
    height, width = depth.shape
    turns = np.float32(math.tau / _WRAP)
    real, imaginary = np.zeros(len(rows), np.float32), np.zeros(len(rows), np.float32)
    least = np.full(len(rows), np.inf, np.float32)
    half = fine // 2
    for down in range(-half, half + 1):
        for across in range(-half, half + 1):
            at = (np.clip(rows + down, 0, height - 1), np.clip(columns + across, 0, width - 1))
            z = depth[at]
            light = np.where(z > 0, seen.fine_infrared[at] / np.maximum(z, 1) ** 2, 0)
            real += light * np.cos(z * turns)
            imaginary += light * np.sin(z * turns)
            least = np.minimum(least, np.where(z > 0, z, np.inf))
    out = depth.copy()
    phase = np.arctan2(imaginary, real) / turns
    # The phase has lost whole turns: the mixture lies beyond the nearest of its parts.
    whole = np.ceil((np.where(np.isfinite(least), least, 0) - phase) / _WRAP - 1e-3)
    out[rows, columns] = np.where((real == 0) & (imaginary == 0), 0, phase + whole * _WRAP)
    return out
