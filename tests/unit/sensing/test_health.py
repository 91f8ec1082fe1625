from dataclasses import replace

import numpy as np
import pytest

from kempelen.core.camera import Frame
from kempelen.core.senses import Sight
from kempelen.sensing.health import HealthCheck
from kempelen.testing.depth_scene import DepthScene, start_men

SCENE = DepthScene(posts=start_men())
GOOD = SCENE.frame(noise=1.5)
assert GOOD.colour is not None
assert GOOD.depth is not None
COLOUR, DEPTH = GOOD.colour, GOOD.depth
RNG = np.random.default_rng(3)


def noise(shape: tuple[int, ...], high: float) -> np.ndarray:
    return RNG.uniform(0, high, shape)


def looked(frame: Frame, *, colour: bool = True, depth: bool = True) -> Sight:
    health = HealthCheck(colour=colour, depth=depth).check(frame)
    assert bool(health.message) != health.good
    return health.sight


def test_a_good_frame_is_clear() -> None:
    assert looked(GOOD) is Sight.CLEAR


BAD = {
    "lights off": (replace(GOOD, colour=(noise(COLOUR.shape, 8)).astype(np.uint8)), Sight.DARK),
    "a hand on the lens": (
        replace(GOOD, colour=np.clip(90 + RNG.normal(0, 2, COLOUR.shape), 0, 255).astype(np.uint8)),
        Sight.COVERED,
    ),
    "a picture of noise": (
        replace(GOOD, colour=noise(COLOUR.shape, 255).astype(np.uint8)),
        Sight.NOISE,
    ),
    "no depth at all": (replace(GOOD, depth=np.zeros_like(DEPTH)), Sight.COVERED),
    "depth of noise": (
        replace(GOOD, depth=noise(DEPTH.shape, 4000).astype(np.float32)),
        Sight.NOISE,
    ),
    "depth of another time": (replace(GOOD, depth_time=GOOD.time + 0.2), Sight.MISMATCHED),
    "another size": (replace(GOOD, depth=DEPTH[::2, ::2]), Sight.MISMATCHED),
    "colour of another size": (replace(GOOD, colour=COLOUR[::2, ::2]), Sight.MISMATCHED),
    "integer depth": (replace(GOOD, depth=DEPTH.astype(np.uint16)), Sight.MISMATCHED),
    "grey picture": (replace(GOOD, colour=COLOUR[..., 0]), Sight.MISMATCHED),
    "no colour": (replace(GOOD, colour=None), Sight.MISMATCHED),
    "no depth": (replace(GOOD, depth=None), Sight.MISMATCHED),
}


@pytest.mark.parametrize("what", BAD)
def test_a_bad_frame_has_its_own_state(what: str) -> None:
    frame, sight = BAD[what]
    assert looked(frame) is sight


def test_what_is_not_read_does_not_matter() -> None:
    assert looked(replace(GOOD, depth=None), depth=False) is Sight.CLEAR
    assert looked(replace(GOOD, colour=None), colour=False) is Sight.CLEAR
    assert looked(replace(GOOD, depth_time=GOOD.time + 0.2), colour=False) is Sight.CLEAR


@pytest.mark.parametrize("gain", [0.35, 1.0, 1.5])
@pytest.mark.parametrize("grain", [0.0, 12.0])
def test_neither_dim_light_nor_grain_makes_a_picture_bad(gain: float, grain: float) -> None:
    picture = np.clip(gain * COLOUR + RNG.normal(0, grain or 1e-9, COLOUR.shape), 0, 255)
    assert looked(replace(GOOD, colour=picture.astype(np.uint8))) is Sight.CLEAR
