import asyncio
import json
import signal
import socket
import sys
import time
from collections.abc import AsyncIterator
from contextlib import ExitStack, suppress
from pathlib import Path

import numpy as np
import pytest

from kempelen.core.camera import Frame
from kempelen.core.errors import CameraError
from kempelen.frames import condition, host
from kempelen.frames.attached import AttachedCamera
from kempelen.frames.channel import Channel, Message, OwnerChannel
from kempelen.frames.condition import CameraState, CameraStatus, Restarting, silence
from kempelen.frames.host import CameraProcess
from kempelen.frames.ring import RingWriter, ring_name
from kempelen.testing.cameras import SCRIPTED

AT_ONCE = Restarting(first=0.01, longest=0.02)


async def until_state(camera: CameraProcess, state: CameraState) -> None:
    async with asyncio.timeout(20):
        while camera.status.state is not state:
            assert await camera.newest(1 << 60, 0.01) is None  # a frame so late never comes: a moment passes


async def frames_of(camera: CameraProcess) -> AsyncIterator[Frame]:
    """As they come, until the recording has ended."""
    after = -1
    with suppress(EOFError):
        while True:
            if (frame := await camera.newest(after, 2.0)) is not None:
                after = frame.sequence
                yield frame
                del frame


async def test_frames_come_in_order_until_the_end() -> None:
    async with CameraProcess(SCRIPTED, {"frames": 20}) as camera:
        seen = []
        async for frame in frames_of(camera):
            assert frame.colour is not None
            assert (frame.colour == frame.sequence).all()
            seen.append(frame.sequence)
        assert seen == sorted(set(seen))
        assert seen[-1] == 19  # the last one is not lost, however late it is read
        assert camera.status.state.value == "ended"
        with pytest.raises(EOFError):
            await camera.newest(19)
    assert camera.status.state.value == "closed"
    assert camera.ring == ""


async def test_settings_and_reports() -> None:
    async with CameraProcess(SCRIPTED, {"frames": 10_000_000}) as camera:
        assert await camera.options() == {"frames": 10_000_000}
        assert camera.status.camera == "scripted"
        async with AttachedCamera(camera.ring) as second:
            assert await second.newest(within=10) is not None


async def test_a_camera_that_is_not_there_is_an_error_with_its_own_words() -> None:
    with pytest.raises(CameraError, match=r"There is no such webcam\.") as caught:
        async with CameraProcess(SCRIPTED, {"absent": "There is no such webcam."}):
            pass
    assert caught.value.hint == "Plug it in."


@pytest.mark.parametrize(
    ("factory", "options"),
    [("no.such.module:Camera", {}), (SCRIPTED + "s", {}), (SCRIPTED, {"colour": "red"}), ("nonsense", {})],
)
async def test_a_driver_that_cannot_be_made(factory: str, options: dict[str, str]) -> None:
    with pytest.raises(CameraError, match="cannot be made with"):
        async with CameraProcess(factory, options):
            pass


async def test_it_is_waited_for_when_that_is_wanted(tmp_path: Path) -> None:
    plug = tmp_path / "plug"
    options = {"absent_until": str(plug)}
    async with CameraProcess(SCRIPTED, options, patient=True, restarting=AT_ONCE) as camera:
        await until_state(camera, CameraState.LOST)
        assert "There is no such camera. Plug it in." in camera.status.message
        assert await camera.newest() is None
        plug.touch()
        await until_state(camera, CameraState.RUNNING)
        assert await camera.newest(within=10) is not None
        assert camera.status.message == ""


async def test_a_killed_process_is_started_again_and_sequences_go_on() -> None:
    async with CameraProcess(SCRIPTED, {"dies_at": 3}, restarting=AT_ONCE) as camera:
        seen = list[int]()
        async for frame in frames_of(camera):
            seen.append(frame.sequence)
            if camera.status.restarts == 2:
                break
        assert seen == sorted(set(seen))
        await until_state(camera, CameraState.LOST)
        assert "killed by signal 9" in camera.status.message
        assert "libcamera: bus error" in camera.status.message
        assert camera.ring == ""


async def test_without_restarts_the_loss_is_final_and_told() -> None:
    async with CameraProcess(SCRIPTED, {"fails_at": 2}, restarting=None) as camera:
        with pytest.raises(CameraError, match="The camera was unplugged"):
            await _all_frames(camera)
        assert camera.status.state is CameraState.LOST


async def test_a_bug_in_a_driver_is_told_by_its_last_words() -> None:
    async with CameraProcess(SCRIPTED, {"breaks_at": 1}, restarting=None) as camera:
        with pytest.raises(CameraError, match=r"exit code 1\. Its last words: ZeroDivisionError"):
            await _all_frames(camera)


async def test_a_camera_without_a_picture_is_given_up() -> None:
    with pytest.raises(CameraError, match=r"no picture within 0\.2 s"):
        async with CameraProcess(SCRIPTED, {"hangs_at": 0}, start_s=0.2):
            pass


async def test_pictures_may_grow() -> None:
    async with CameraProcess(SCRIPTED, {"grows_at": 5, "frames": 200}) as camera:
        sizes = {frame.colour.shape[0] async for frame in frames_of(camera) if frame.colour is not None}
    assert 64 in sizes


async def test_the_process_ends_with_its_owner(tmp_path: Path) -> None:
    program = f"""
import asyncio, os, sys
from kempelen.frames.host import CameraProcess
async def main():
    async with CameraProcess("{SCRIPTED}") as camera:
        print(camera._reader.writer, flush=True)
        await asyncio.sleep(1000)
asyncio.run(main())
"""
    owner = await asyncio.create_subprocess_exec(
        sys.executable, "-c", program, stdout=asyncio.subprocess.PIPE, cwd=tmp_path
    )
    assert owner.stdout is not None
    camera = int(await owner.stdout.readline())
    owner.send_signal(signal.SIGKILL)
    await owner.wait()
    await asyncio.to_thread(_until_gone, camera)


def _until_gone(pid: int) -> None:
    deadline = time.monotonic() + 20
    while _state(pid) != "Z":
        assert time.monotonic() < deadline
        time.sleep(0.005)


def _state(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0]
    except OSError:
        return "Z"


async def test_a_ring_of_somebody_else() -> None:
    picture = Frame(3, 0.0, np.zeros((8, 8, 3), np.uint8))
    with ExitStack() as stack:
        writer = stack.enter_context(RingWriter(ring_name("other"), 3, 1000))
        async with AttachedCamera(writer.name) as camera:
            assert await camera.newest(within=0.01) is None
            asyncio.get_running_loop().call_later(0.02, writer.write_frame, picture)
            frame = await camera.newest(within=30)
            assert frame is not None
            assert frame.sequence == 3
            stack.close()
            with pytest.raises(CameraError, match="has ended"):
                await camera.newest(3, within=30)
            assert camera.status.state is CameraState.LOST


async def test_nobody_s_ring() -> None:
    with pytest.raises(CameraError, match="Nobody writes"):
        async with AttachedCamera("nobody"):
            pass


def test_silence_is_a_state() -> None:
    running = CameraStatus(CameraState.RUNNING)
    assert silence(running, condition.SILENT_S) == running
    silent = silence(running, 7.2)
    assert silent.state is CameraState.SILENT
    assert "7 s" in silent.message


async def test_a_driver_that_hangs_is_ended_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host, "HANG_S", 0.3)
    monkeypatch.setattr(host, "_CLOSE_S", 0.1)
    async with CameraProcess(SCRIPTED, {"hangs_at": 1}, restarting=None) as camera:
        with pytest.raises(CameraError, match=r"has not answered for 0\.3 s"):
            await _all_frames(camera)


async def _all_frames(camera: CameraProcess) -> None:
    async for _ in frames_of(camera):
        pass


async def test_messages_cross_whole() -> None:
    ours, its = socket.socketpair()
    owner, camera = await OwnerChannel.over(ours), Channel(its)
    owner.send("open", factory="a:b", options={"n": 1})
    owner.send("close")
    first = await asyncio.to_thread(camera.receive)
    assert first == Message("open", {"factory": "a:b", "options": {"n": 1}})
    assert await asyncio.to_thread(camera.receive) == Message("close")
    camera.send("status", frames=3)
    assert await owner.receive() == Message("status", {"frames": 3})
    await owner.close()
    assert camera.receive() is None
    camera.send("status", frames=4)  # nobody is there: no error
    camera.close()


@pytest.mark.parametrize("line", [b"nonsense\n", b"[1]\n", b'{"kind": 3}\n'])
def test_what_is_no_message(line: bytes) -> None:
    with pytest.raises(ValueError, match=r".+"):
        Message.decode(line)


def test_a_message_is_one_line() -> None:
    encoded = Message("error", {"message": "two\nlines"}).encode()
    assert encoded.count(b"\n") == 1
    assert json.loads(encoded)["message"] == "two\nlines"
