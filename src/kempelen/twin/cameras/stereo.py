"""Depth by stereo matching: smooth over the matched window, blind where only one eye sees."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Depth
from kempelen.twin.cameras.fields import Bank
from kempelen.twin.cameras.models import CameraModel
from kempelen.twin.cameras.noise import Noise
from kempelen.twin.cameras.region import Region
from kempelen.twin.cameras.surfaces import GLOSSY_IR, Surfaces

_WINDOW = 7
"""Pixels of the matched patch."""
_STEP = 1 / 32
"""Disparities are reported in steps of this, pixels."""
_HOLE = 3.0
"""Size of a patch without match, pixels."""


@dataclass(slots=True)
class Expectation:
    """What every frame of an unchanged scene has in common, for each of the (h, w) pixels.

    Attributes:
        disparity: Pixels, 0 where nothing can be matched.
        spread: Of the disparity, pixels.
        blind: Patches (standard normal numbers) below this find no match.
    """

    disparity: Depth
    spread: Depth
    blind: Depth


class Stereo:
    """A pair of eyes with a projector.

    Args:
        model: Optics and baseline.
        rng: Of its noise.
    """

    def __init__(self, model: CameraModel, rng: np.random.Generator) -> None:
        size = (model.depth.height, model.depth.width)
        self._model = model
        self._scale = np.float32(model.depth.fx * model.baseline)
        self._error = Bank.normal(rng, *size, smooth=_WINDOW / 4)
        self._patches = Bank.normal(rng, *size, smooth=_HOLE)

    @property
    def reach(self) -> int:
        """Pixels over which what is there changes what is measured: the largest disparity, and a window."""
        return math.ceil(float(self._scale) / self._model.nearest) + _WINDOW

    def blank(self) -> Expectation:
        """Of a camera that has not looked yet."""
        lens = self._model.depth
        disparity, spread = np.zeros((2, lens.height, lens.width), np.float32)
        return Expectation(disparity, spread, np.full_like(disparity, -np.inf))

    def expect(self, into: Expectation, seen: Surfaces, noise: Noise, taken: Region, kept: Region) -> None:
        """Everything but chance.

        Args:
            into: What is to be brought up to date.
            seen: Of the pixels ``taken``.
            noise: What goes wrong.
            taken: A part of the picture.
            kept: The part of it whose surroundings were seen as well.
        """
        disparity = np.where(seen.depth > 0, self._scale / np.maximum(seen.depth, 1), 0).astype(np.float32)
        hidden = _occluded(disparity)
        if noise.disparity:
            # A window that holds an edge reports its nearer side: objects grow, corners become round.
            smooth = cv2.GaussianBlur(cv2.medianBlur(disparity, 5), (_WINDOW, _WINDOW), 0)
            disparity = np.asarray(smooth, np.float32)
        disparity[hidden | (seen.depth <= 0)] = 0
        dark = 1 / np.sqrt(np.maximum(seen.infrared, 0.1)) if noise.dark_spread else 1.0
        loss = noise.holes + noise.dropout * (seen.glossy & (seen.infrared < GLOSSY_IR))
        part = kept.within(taken)
        into.disparity[kept.slices] = disparity[part]
        into.spread[kept.slices] = (noise.disparity * dark * np.ones_like(disparity))[part]
        into.blind[kept.slices] = _quantile(np.full_like(disparity, loss))[part]

    def measure(self, expected: Expectation, noise: Noise) -> Depth:
        """A frame: (h, w) mm."""
        disparity = self._jittered(expected) if noise.disparity else expected.disparity
        out: Depth = np.divide(self._scale, np.maximum(disparity, np.float32(_STEP)), dtype=np.float32)
        out += np.float32(noise.offset)
        empty = expected.disparity <= 0
        if expected.blind.max() > -np.inf:
            empty |= self._patches.cut() < expected.blind
        empty |= (out < self._model.nearest) | (out > self._model.farthest)
        out[empty] = 0
        return out

    def _jittered(self, expected: Expectation) -> Depth:
        """(h, w) disparity as matched, in the steps in which it is reported."""
        out: Depth = (expected.disparity + expected.spread * self._error.cut()) * np.float32(1 / _STEP)
        np.rint(out, out=out)
        out *= np.float32(_STEP)
        return out


def _occluded(disparity: Depth) -> npt.NDArray[np.bool_]:
    """(h, w) what the left eye sees and the right one does not: something farther right covers it there."""
    right = np.arange(disparity.shape[1], dtype=np.float32) - disparity
    least = np.minimum.accumulate(right[:, ::-1], axis=1)[:, ::-1]
    covered = np.zeros(disparity.shape, bool)
    covered[:, :-1] = least[:, 1:] < right[:, :-1] - 1
    return covered


def _quantile(share: Depth) -> Depth:
    """Below which a standard normal number falls with that probability, about (Tukey's lambda)."""
    p = np.clip(share, 1e-4, 0.9999)
    out: Depth = ((p**0.135 - (1 - p) ** 0.135) / 0.1975).astype(np.float32)
    return np.where(share > 0, out, -np.inf).astype(np.float32)
