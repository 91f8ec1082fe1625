"""The eye's process: it sees what there is, says why when there is nothing, and comes back from anything."""

import asyncio
import os
import signal
import sys
from collections.abc import Callable

import numpy as np
import pytest

from kempelen.app.eye import Eye, EyeSettings
from kempelen.app.eye_wire import Note, observation_of, seen
from kempelen.core.camera import Frame
from kempelen.core.errors import SensorError
from kempelen.core.senses import Observation, Sight
from kempelen.testing.eyes import OwnRing

COLOUR = EyeSettings(use="colour")
PATIENCE_S = 60.0


def frame(number: int, grey: int) -> Frame:
    """An even picture: of darkness, or of a covered lens."""
    return Frame(number, number / 30, colour=np.full((240, 320, 3), grey, np.uint8))


class Camera:
    """Writes the same picture again and again, as long as it is plugged in."""

    def __init__(self, ring: OwnRing) -> None:
        self.ring = ring
        self.grey = 0
        self.number = 0

    async def run(self) -> None:
        while True:
            if self.ring.ring:
                self.number += 1
                self.ring.write(frame(self.number, self.grey))
            await asyncio.sleep(0.03)


async def see(eye: Eye, wanted: Callable[[Observation], bool]) -> Observation:
    async with asyncio.timeout(PATIENCE_S):
        async for observation in eye.observe():
            if wanted(observation):
                return observation
    raise AssertionError("the eye has ended")


async def test_whatever_happens_is_told_and_passes() -> None:
    """No camera, a dark one, a covered one, an unplugged one, a killed reader: and all pass."""
    with OwnRing() as ring:
        ring.unplug()
        camera = Camera(ring)
        filming = asyncio.create_task(camera.run())
        async with Eye(ring, COLOUR) as eye:
            assert "starting" in (await see(eye, lambda o: o.sight is Sight.NO_CAMERA)).message
            ring.plug_in()
            assert "light" in (await see(eye, lambda o: o.sight is Sight.DARK)).message
            camera.grey = 128
            assert "lens" in (await see(eye, lambda o: o.sight is Sight.COVERED)).message
            ring.unplug()
            assert (await see(eye, lambda o: o.sight is Sight.NO_CAMERA)).message
            ring.plug_in()
            await see(eye, lambda o: o.sight is Sight.COVERED)

            await eye.set("health.dark", 20.0)
            os.kill(eye.pid or 0, signal.SIGKILL)
            lost = await see(eye, lambda o: o.sight is Sight.NO_CAMERA)
            assert "signal 9" in lost.message
            await see(eye, lambda o: o.sight is Sight.COVERED)
            assert eye.restarts == 1
            known = {p["name"]: p for p in await eye.parameters()}
            assert (known["health.dark"]["value"], known["health.dark"]["overridden"]) == (20.0, True)

            with pytest.raises(SensorError, match="no parameter 'health.darkness'"):
                await eye.set("health.darkness", 1.0)
            with pytest.raises(SensorError, match="has not been found"):
                await eye.sighting()
            assert (await eye.picture())[1:4] == b"PNG"
        filming.cancel()
        await asyncio.gather(filming, return_exceptions=True)


async def test_a_camera_that_falls_silent_is_told() -> None:
    with OwnRing() as ring:
        ring.write(frame(1, 128))
        async with Eye(ring, COLOUR) as eye:
            stale = await see(eye, lambda o: o.sight is Sight.STALE)
        assert "No picture" in stale.message


async def test_it_ends_with_its_program() -> None:
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "kempelen.app.eye_process",
        stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.DEVNULL,
    )  # fmt: skip
    assert process.stdin is not None
    process.stdin.write(
        Note("begin", {"use": "both", "overrides": {}, "square": None, "side": "", "usual": ""}).encode()
    )
    await process.stdin.drain()
    process.stdin.close()
    assert await asyncio.wait_for(process.wait(), PATIENCE_S) == 0


async def test_a_hand_between_two_looks_is_not_missed() -> None:
    """A slow reader skips observations, but never the news that something was in the way."""
    with OwnRing() as ring:
        eye = Eye(ring, COLOUR)
        clear = Observation(np.zeros((64, 3)), 1.0)
        looks = eye.observe()
        for observation in (clear, Observation.blind(1.1, Sight.HAND, "a hand"), clear, clear):
            eye._see(observation, eye._marks)
        assert (await anext(looks)).hand
        assert (await anext(looks)).valid


async def test_what_was_taken_before_is_not_fresh() -> None:
    with OwnRing() as ring:
        eye = Eye(ring, COLOUR)
        old, new = Observation(np.zeros((64, 3)), 1.0), Observation(np.zeros((64, 3)), 2.0)
        eye._see(old, eye._marks)
        looks = eye.observe()
        eye._see(old, eye._marks - 1)
        eye._see(new, eye._marks)
        assert (await anext(looks)).time == 2.0


def test_observations_cross_the_pipe_whole() -> None:
    rng = np.random.default_rng(1)
    sent = Observation(
        rng.normal(size=(64, 3)), 12.5, heights=rng.normal(size=64),
        offsets=np.where(rng.random((64, 2)) < 0.5, np.nan, rng.normal(size=(64, 2))),
    )  # fmt: skip
    got = observation_of(seen(sent, 7))
    assert (got.time, got.sight, got.kinds) == (12.5, Sight.CLEAR, None)
    np.testing.assert_allclose(got.log_likelihood, sent.log_likelihood, rtol=1e-6)
    np.testing.assert_allclose(got.heights, sent.heights, rtol=1e-6)  # type: ignore[arg-type]
    np.testing.assert_allclose(got.offsets, sent.offsets, rtol=1e-6)  # type: ignore[arg-type]
