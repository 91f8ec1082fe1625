"""Whether frames can be believed at all: lights, lens, noise, format, time."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Frame
from kempelen.core.senses import Sight
from kempelen.sensing.parameters import Parameter, Parameters

_PATCH = 24  # px: side of the patches whose texture is looked at
_PATCHES = 6  # along each axis
_STRUCTURED = 4  # of the patches have an edge in any picture of a board
_CHANNELS = 3
_DEPTH_DIMENSIONS = 2


def health_parameters() -> Parameters:
    """Limits; none of them is learned, for a sick picture teaches nothing."""
    return Parameters(
        Parameter(
            "health.dark", 14.0, "grey levels", 0, 100, "a picture darker than this on average is dark"
        ),
        Parameter(
            "health.contrast", 6.0, "grey levels", 0, 60, "less than this between parts: a covered lens"
        ),
        Parameter("health.coherence", 0.25, "", -1, 1, "less likeness of neighbouring pixels is noise"),
        Parameter(
            "health.skew", 0.05, "s", 0.001, 5, "depth and colour further apart do not belong together"
        ),
        Parameter(
            "health.measured", 0.1, "", 0, 1, "less of the depth picture measured: covered or too near"
        ),
        Parameter(
            "health.depth_jump", 60.0, "mm", 1, 2000, "usual difference of neighbours beyond it is noise"
        ),
    )


@dataclass(frozen=True, slots=True)
class Health:
    """Of one frame.

    Attributes:
        sight: CLEAR when nothing is wrong with it.
        message: What is, and what to do.
    """

    sight: Sight
    message: str = ""

    @property
    def good(self) -> bool:
        """Whether the frame may be read."""
        return self.sight is Sight.CLEAR


_GOOD = Health(Sight.CLEAR)


class HealthCheck:
    """Looks at a few patches of each frame.

    Args:
        colour: Whether colour is read.
        depth: Whether depth is read.
        parameters: To be shown and overridden; its own ones without.
    """

    def __init__(self, *, colour: bool, depth: bool, parameters: Parameters | None = None) -> None:
        self.parameters = health_parameters() if parameters is None else parameters
        self._colour = colour
        self._depth = depth

    def check(self, frame: Frame) -> Health:
        """The worst that is wrong with a frame."""
        for look in (self._format, self._times, self._light, self._reach):
            health = look(frame)
            if not health.good:
                return health
        return _GOOD

    def _format(self, frame: Frame) -> Health:
        wrong = _wrong_colour(frame) if self._colour else ""
        wrong = wrong or (_wrong_depth(frame) if self._depth else "")
        return Health(Sight.MISMATCHED, wrong) if wrong else _GOOD

    def _times(self, frame: Frame) -> Health:
        limit = self.parameters["health.skew"]
        if not (self._colour and self._depth) or abs(frame.skew) <= limit:
            return _GOOD
        return Health(
            Sight.MISMATCHED,
            f"Depth and colour were taken {abs(frame.skew):.2f} s apart, more than {limit:g} s: the "
            "camera loses "
            "pictures. Use a faster USB port, or fewer programs beside it.",
        )

    def _light(self, frame: Frame) -> Health:
        if frame.colour is None:
            return _GOOD
        patches = _patches(frame.colour[..., 1])
        means = patches.mean(axis=(1, 2))
        level, contrast = float(means.mean()), float(means.std() + np.median(patches.std(axis=(1, 2))))
        if contrast < self.parameters["health.contrast"] or level < self.parameters["health.dark"]:
            return self._unlit(level)
        likeness = _coherence(patches)
        if likeness < self.parameters["health.coherence"]:
            return Health(
                Sight.NOISE,
                f"The colour picture is noise: neighbouring pixels are alike by {likeness:.2f} only. "
                "Unplug the "
                "camera and plug it in again.",
            )
        return _GOOD

    def _unlit(self, level: float) -> Health:
        if level < self.parameters["health.dark"]:
            return Health(
                Sight.DARK,
                f"The picture is dark: {level:.0f} of 255 grey levels. Switch the light on, or uncover "
                "the lens.",
            )
        return Health(
            Sight.COVERED,
            f"The picture is one even grey of {level:.0f}: something covers the lens, or it is blinded. "
            "Uncover it.",
        )

    def _reach(self, frame: Frame) -> Health:
        if not self._depth or frame.depth is None:
            return _GOOD
        patches = _patches(frame.depth).astype(np.float64)
        measured = float((patches > 0).mean())
        if measured < self.parameters["health.measured"]:
            return Health(
                Sight.COVERED,
                f"Only {100 * measured:.0f} % of the depth picture is measured: something covers the "
                "camera, or is "
                "too near to it. Uncover it.",
            )
        both = (patches[:, :, 1:] > 0) & (patches[:, :, :-1] > 0)
        jumps = np.abs(np.diff(patches, axis=2))[both]
        jump = float(np.median(jumps)) if len(jumps) else 0.0
        if jump > self.parameters["health.depth_jump"]:
            return Health(
                Sight.NOISE,
                f"The depth picture is noise: neighbours differ by {jump:.0f} mm. Keep sunlight off the "
                "table, or "
                "plug the camera in again.",
            )
        return _GOOD


def _wrong_colour(frame: Frame) -> str:
    if frame.colour is None:
        return "The camera sends no colour. Choose depth only, or another camera."
    if frame.colour.ndim != _CHANNELS or frame.colour.shape[2] != _CHANNELS or frame.colour.dtype != np.uint8:
        return (
            f"The colour picture is {frame.colour.shape} of {frame.colour.dtype}, not rows, columns and 3 "
            "bytes: "
            "set the camera to 8-bit colour."
        )
    if frame.colour_camera is not None:
        wanted = (frame.colour_camera.height, frame.colour_camera.width)
        if frame.colour.shape[:2] != wanted:
            return (
                f"The colour picture has {frame.colour.shape[:2]} rows and columns, its intrinsics say "
                f"{wanted}: "
                "read the intrinsics of the mode that the camera runs in."
            )
    return ""


def _wrong_depth(frame: Frame) -> str:
    if frame.depth is None or frame.depth_camera is None:
        return "The camera sends no depth with known intrinsics. Choose colour only, or another camera."
    if frame.depth.ndim != _DEPTH_DIMENSIONS or frame.depth.dtype != np.float32:
        return (
            f"The depth picture is {frame.depth.shape} of {frame.depth.dtype}, not rows and columns of "
            "float32 mm."
        )
    wanted = (frame.depth_camera.height, frame.depth_camera.width)
    if frame.depth.shape != wanted:
        return (
            f"The depth picture has {frame.depth.shape} rows and columns, its intrinsics say {wanted}: "
            "read the intrinsics of the mode that the camera runs in."
        )
    return ""


def _patches(picture: npt.NDArray[np.generic]) -> npt.NDArray[np.float32]:
    """(n, side, side) small pieces from all over a picture."""
    height, width = picture.shape[:2]
    side = max(min(_PATCH, height, width), 1)
    tops = np.linspace(0, height - side, _PATCHES).astype(int)
    lefts = np.linspace(0, width - side, _PATCHES).astype(int)
    return np.stack([picture[t : t + side, u : u + side] for t in tops for u in lefts]).astype(np.float32)


def _coherence(patches: npt.NDArray[np.float32]) -> float:
    """Correlation of horizontal neighbours in the few patches that have most of it.

    A bare table shows nothing but the sensor's grain in most patches; where there is anything to see at all,
    some of them have an edge.
    """
    flat = patches - patches.mean(axis=(1, 2), keepdims=True)
    energy = (flat**2).mean(axis=(1, 2))
    shared = (flat[:, :, 1:] * flat[:, :, :-1]).mean(axis=(1, 2))
    return float(np.sort(shared / np.maximum(energy, 1e-6))[-_STRUCTURED:].mean())
