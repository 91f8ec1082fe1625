"""Physics and rendering, each tried in a process of its own: a broken GL library takes its process down."""

import asyncio
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass

from kempelen.app.doctor_rows import Check, fail, ok, warn

PROBE_SECONDS = 60.0
GL_BACKENDS = ("egl", "osmesa", "glfw")

_PHYSICS = """
import mujoco
ball = "<body><freejoint/><geom size='1'/></body>"
model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{ball}</worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_step(model, data)
print(mujoco.__version__)
"""

_RENDERING = """
import mujoco
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
renderer = mujoco.Renderer(model, 32, 32)
renderer.update_scene(data)
picture = renderer.render()
renderer.close()
print(picture.shape)
"""


_TWIN_CAMERA = """
import mujoco
from kempelen.twin.cameras.render import make_renderer
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
print(make_renderer(model, "auto").name)
"""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a probe ended.

    Attributes:
        said: Last line of what it printed, or of its complaint.
    """

    worked: bool
    said: str


async def examine_physics() -> Check:
    """MuJoCo makes a step."""
    outcome = await run_probe(_PHYSICS)
    if outcome.worked:
        return ok("physics", f"MuJoCo {outcome.said}")
    return fail("physics", f"MuJoCo does not work: {outcome.said}", "Install Kempelen again: make setup")


async def examine_rendering(backends: Sequence[str] = GL_BACKENDS) -> Check:
    """MuJoCo draws a picture without a screen, by one of the GL libraries."""
    complaints = []
    for backend in backends:
        outcome = await run_probe(_RENDERING, MUJOCO_GL=backend)
        if outcome.worked:
            return ok("rendering", f"{backend} works")
        complaints.append(f"{backend}: {outcome.said}")
    return warn(
        "rendering",
        f"no GL library draws ({'; '.join(complaints)})",
        "Games need none, the twin's camera is slower without; sudo apt install libegl1 libosmesa6",
    )


async def examine_twin_camera() -> Check:
    """The twin's camera can draw, by whatever way."""
    outcome = await run_probe(_TWIN_CAMERA)
    if outcome.worked:
        return ok("camera", f"the twin's, drawn by {outcome.said}")
    return fail("camera", f"the twin's cannot draw: {outcome.said}", "Play without it: --sensor none")


async def run_probe(code: str, seconds: float = PROBE_SECONDS, **environment: str) -> Outcome:
    """Run Python code in a process of its own, which is gone afterwards.

    Args:
        code: A program.
        seconds: After which it is killed.
        environment: Variables beside this process's own.
    """
    with tempfile.TemporaryDirectory() as directory:  # libraries leave logs where they run
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-c", code,
            stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE,
            cwd=directory, env={**os.environ, **environment},
        )  # fmt: skip
        try:
            async with asyncio.timeout(seconds):
                out, err = await process.communicate()
        except TimeoutError:
            return Outcome(worked=False, said=f"no answer within {seconds:g} s")
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()
    worked = process.returncode == 0
    lines = (out if worked else err).decode(errors="replace").split("\n")
    said = next((line.strip() for line in reversed(lines) if line.strip()), f"exit code {process.returncode}")
    return Outcome(worked, said)
