"""An eye beside a camera at a node: what it sees travels, its frames do not; a lost node is no camera."""

import asyncio
from collections.abc import Callable
from contextlib import AsyncExitStack

import numpy as np
import pytest

from kempelen.app.eye import Eye, EyeSettings
from kempelen.app.eye_link import RemoteEye
from kempelen.app.eyes import TwinFrames
from kempelen.app.node_devices import EyeBeside
from kempelen.core.camera import Frame
from kempelen.core.errors import LinkError
from kempelen.core.senses import Observation, Sight
from kempelen.nodes.channel import ChannelWaits
from kempelen.nodes.channel_node import ChannelNode
from kempelen.nodes.local_link import LocalNet
from kempelen.testing.eyes import OwnRing

QUICK = ChannelWaits(answer=0.4, again=0.02, found=0.5, lost=0.6)


async def film(ring: OwnRing) -> None:
    """A covered lens, again and again."""
    number = 0
    while True:
        number += 1
        ring.write(Frame(number, number / 30, colour=np.full((240, 320, 3), 128, np.uint8)))
        await asyncio.sleep(0.03)


async def see(eye: Eye, wanted: Callable[[Observation], bool]) -> Observation:
    async with asyncio.timeout(60):
        async for observation in eye.observe():
            if wanted(observation):
                return observation
    raise AssertionError("the eye has ended")


async def test_what_is_seen_travels_and_a_lost_node_is_no_camera() -> None:
    net = LocalNet()
    with OwnRing() as ring:
        async with AsyncExitStack() as stack:
            link = await stack.enter_async_context(net.join())
            await stack.enter_async_context(
                ChannelNode(lambda: EyeBeside(ring).open(), link, "one", "camera", forfeit=0.5)
            )
            filming = asyncio.create_task(film(ring))
            start = lambda: RemoteEye(net.join(), "one", waits=QUICK)  # noqa: E731 - as a game starts it
            eye = await stack.enter_async_context(Eye(TwinFrames(""), EyeSettings(use="colour"), start))
            assert "lens" in (await see(eye, lambda seen: seen.sight is Sight.COVERED)).message
            assert await eye.parameters()
            assert (await eye.picture()).startswith(b"\x89PNG")
            assert eye.pid is None

            net.weather.cut = True
            lost = await see(eye, lambda seen: seen.sight is Sight.NO_CAMERA)
            assert "camera node at table one has not answered" in lost.message
            net.weather.cut = False
            await see(eye, lambda seen: seen.sight is Sight.COVERED)
            assert eye.restarts >= 1
            filming.cancel()
            await asyncio.gather(filming, return_exceptions=True)


async def test_a_node_that_is_not_there_is_told_as_no_camera() -> None:
    start = lambda: RemoteEye(LocalNet().join(), "one", waits=QUICK)  # noqa: E731 - as a game starts it
    async with Eye(TwinFrames(""), None, start) as eye:
        lost = await see(eye, lambda seen: seen.sight is Sight.NO_CAMERA)
        assert "No camera node at table one answers" in lost.message
        assert "kempelen node camera --table one" in lost.message


@pytest.mark.parametrize("message", [b"", b"{}", b"nonsense\n", b'{"op": "format the disk"}\n', b"\xff\n"])
async def test_what_is_no_order_does_not_reach_the_eye(message: bytes) -> None:
    with OwnRing() as ring, pytest.raises(LinkError, match="no order to an eye"):
        EyeBeside(ring).send(message)
