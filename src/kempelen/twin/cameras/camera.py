"""A virtual camera over the table."""

from dataclasses import dataclass
from typing import Any, Self

import mujoco
import numpy as np

from kempelen.core.camera import Depth, Frame, Picture
from kempelen.core.geometry import Array, Transform
from kempelen.twin.cameras.changes import Poses, seen_region, stale_points
from kempelen.twin.cameras.colour import ColourSensor
from kempelen.twin.cameras.glare import add_glare
from kempelen.twin.cameras.models import KINECT_V2, CameraModel, Principle
from kempelen.twin.cameras.noise import NOMINAL, Noise
from kempelen.twin.cameras.optics import DepthOptics
from kempelen.twin.cameras.region import Region
from kempelen.twin.cameras.render import Renderer, Stage, View, kinematics, make_renderer, mocap_poses
from kempelen.twin.cameras.settings import CameraSpec, Lighting, Placement
from kempelen.twin.cameras.stereo import Stereo
from kempelen.twin.cameras.surfaces import Materials
from kempelen.twin.cameras.tof import TimeOfFlight
from kempelen.twin.physics.model import paint


@dataclass(slots=True)
class _Drawn:
    """What is kept as long as nothing moves, and brought up to date where something has."""

    state: Array
    poses: Poses
    roots: Picture


class _DepthCamera:
    """The depth half: optics and principle.

    Args:
        model: Of the camera.
        rng: Of its noise.
    """

    def __init__(self, model: CameraModel, rng: np.random.Generator) -> None:
        self._lens = model.depth
        self._optics = DepthOptics.of(model)
        stereo = model.principle is Principle.STEREO
        self._sensor: TimeOfFlight | Stereo = (
            Stereo(model, rng) if stereo else TimeOfFlight(model, self._optics, rng)
        )

        canvas = self._optics.canvas
        self._depth = np.zeros((canvas.height, canvas.width), np.float32)
        self._ids = np.full((canvas.height, canvas.width), -1, np.int16)
        self._expected: Any = self._sensor.blank()

    def look(
        self,
        renderer: Renderer,
        pose: Transform,
        materials: Materials,
        noise: Noise,
        stale: Array | None,
    ) -> None:
        """Work out what all frames have in common as long as nothing moves.

        Args:
            renderer: Draws.
            pose: ``robot_from_depth``.
            materials: What is drawn.
            noise: What goes wrong.
            stale: (n, 3) mm, robot frame: whose hull holds all that has changed; None for everything.
        """
        lens, size = self._lens, (self._lens.width, self._lens.height)
        kept = Region.whole(lens) if stale is None else seen_region(stale, View(lens, pose))
        if kept.empty:
            return
        kept = kept.grown(self._sensor.reach, *size)
        taken = kept.grown(self._sensor.reach, *size)
        optics = self._optics.part(taken)
        extent = optics.extent
        drawn = renderer.geometry(View(self._optics.canvas, pose), extent)
        self._depth[extent.slices], self._ids[extent.slices] = drawn
        seen = materials.see(optics, pose, (self._depth, self._ids))
        self._sensor.expect(self._expected, seen, noise, taken, kept)

    def measure(self, noise: Noise) -> Depth:
        """A frame: (h, w) mm."""
        return self._sensor.measure(self._expected, noise)


class VirtualCamera:
    """A depth camera of that model over a stage. Context manager; for one thread.

    Args:
        model: Its optics.
        placement: Where it is; may be changed at any time, like all that follows.
        lighting: In which light.
        noise: What is wrong with its frames.
        seed: Of all noise: the same shots in the same order give the same frames.
        backend: Way of drawing.
        depth: Whether it measures depth at all.
    """

    def __init__(
        self,
        model: CameraModel = KINECT_V2,
        placement: Placement | None = None,
        lighting: Lighting | None = None,
        noise: Noise = NOMINAL,
        *,
        seed: int = 0,
        backend: str = "auto",
        depth: bool = True,
    ) -> None:
        self.model = model
        self._settings = (placement or Placement(), lighting or Lighting(), noise)
        self._backend = backend
        rng = np.random.default_rng(seed)
        self._colour = ColourSensor(rng, model.colour.height, model.colour.width)
        self._depth = _DepthCamera(model, rng) if depth else None
        self._renderer: Renderer | None = None
        self._drawn: _Drawn | None = None
        self._of: Any = None  # the MuJoCo model that the renderer draws
        self.sequence = 0

    @classmethod
    def of(cls, spec: CameraSpec) -> "VirtualCamera":
        """As specified."""
        return cls(
            spec.optics, spec.placement, spec.lighting, spec.noise, seed=spec.seed, backend=spec.backend
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exc: object) -> None:
        """Give back the renderer."""
        self.close()

    @property
    def placement(self) -> Placement:
        """Where it is."""
        return self._settings[0]

    @property
    def lighting(self) -> Lighting:
        """In which light."""
        return self._settings[1]

    @property
    def noise(self) -> Noise:
        """What is wrong with its frames."""
        return self._settings[2]

    @property
    def backend(self) -> str:
        """Way of drawing: the one at work, once there is one."""
        return self._backend if self._renderer is None else self._renderer.name

    def change(
        self,
        *,
        placement: Placement | None = None,
        lighting: Lighting | None = None,
        noise: Noise | None = None,
    ) -> None:
        """Settings that hold from the next frame on."""
        before = self._settings
        self._settings = (placement or before[0], lighting or before[1], noise or before[2])
        if self._settings != before:
            self._drawn = None

    def robot_from_colour(self, stage: Stage) -> Transform:
        """True pose of the colour camera: for tests and training, never for a tracker."""
        return stage.scene.table.robot_from_board @ self.placement.board_from_camera

    def shoot(self, stage: Stage, time: float | None = None) -> Frame:
        """A frame of the stage as it is now.

        Args:
            stage: World, simulation or studio.
            time: Of the frame, s; default the stage's.

        Raises:
            TwinError: nothing can be drawn here.
        """
        drawn = self._draw(stage)
        colour = self._colour.expose(drawn.roots, self.noise)
        depth = None if self._depth is None else self._depth.measure(self.noise)
        if depth is not None and self.lighting.covered:
            depth = np.zeros_like(depth)
        return self._frame(colour, depth, float(stage.data.time) if time is None else time)

    def _frame(self, colour: Picture, depth: Depth | None, time: float) -> Frame:
        self.sequence += 1
        colour.setflags(write=False)
        if depth is not None:
            depth.setflags(write=False)
        return Frame(
            sequence=self.sequence,
            time=time,
            colour=colour,
            depth=depth,
            colour_camera=self.model.colour,
            depth_camera=None if depth is None else self.model.depth,
            colour_from_depth=self.model.colour_from_depth,
        )

    def _draw(self, stage: Stage) -> _Drawn:
        """The scene without chance, drawn anew where something has moved."""
        state = np.concatenate([stage.data.qpos, mocap_poses(stage.data).ravel()])
        renderer, before = self._renderer_of(stage), self._drawn
        if before is not None and np.array_equal(before.state, state):
            return before
        kinematics(stage, self._data)
        renderer.look(self._data, stage.scene, self.lighting)
        poses, stale = Poses(stage.model, self._data), None
        if before is not None:
            stale = stale_points(before.poses, poses, stage.scene, self.lighting)
        pose = self.robot_from_colour(stage)
        if self._depth is not None:
            from_depth = pose @ self.model.colour_from_depth
            self._depth.look(renderer, from_depth, self._materials, self.noise, stale)
        roots = self._roots(renderer, View(self.model.colour, pose), stale, before)
        self._drawn = _Drawn(state, poses, roots)
        return self._drawn

    def _roots(self, renderer: Renderer, view: View, stale: Array | None, before: _Drawn | None) -> Picture:
        """The mean colour picture."""
        lens, reach = view.intrinsics, self._colour.reach(self.noise)
        if before is None or stale is None:
            picture = self._picture(renderer, view, Region.whole(lens))
            return self._colour.develop(picture, self.lighting, self.noise)
        kept = seen_region(stale, view)
        if not kept.empty:
            kept = kept.grown(reach + 1, lens.width, lens.height)
            taken = kept.grown(reach, lens.width, lens.height)
            part = self._colour.develop(self._picture(renderer, view, taken), self.lighting, self.noise)
            before.roots[kept.slices] = part[kept.within(taken)]
        return before.roots

    def _picture(self, renderer: Renderer, view: View, region: Region) -> Picture:
        """What falls onto the lens."""
        out = renderer.colour(view, region)
        if self.lighting.glare:
            light, materials = self.lighting, self._materials
            out = add_glare(out, renderer, view, region, materials=materials, lighting=light)
        return out

    def _renderer_of(self, stage: Stage) -> Renderer:
        if self._renderer is None or self._of is not stage.model:
            self.close()
            paint(stage.model, stage.scene)
            self._renderer = make_renderer(stage.model, self._backend)
            self._of, self._data = stage.model, mujoco.MjData(stage.model)
            self._materials = Materials(stage.model, stage.scene)
        return self._renderer

    def close(self) -> None:
        """Give back the renderer; the next shot makes another."""
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = self._drawn = self._of = None
