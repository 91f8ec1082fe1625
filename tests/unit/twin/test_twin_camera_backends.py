"""Three ways of drawing the same scene."""

import sys
from collections.abc import Mapping
from importlib.util import find_spec

import chess
import mujoco
import numpy as np
import numpy.typing as npt
import pytest

from kempelen.core.camera import Intrinsics
from kempelen.core.errors import TwinError
from kempelen.core.table import Table, start_layout
from kempelen.twin.cameras import Lighting, Placement
from kempelen.twin.cameras import render as module
from kempelen.twin.cameras.region import Region
from kempelen.twin.cameras.render import View, kinematics, make_renderer
from kempelen.twin.cameras.still import Still
from kempelen.twin.physics import Scene, opengl
from kempelen.twin.physics.model import paint

pytestmark = pytest.mark.physics

LENS = Intrinsics.of_view(320, 240, 0.75)
SOME = Region(90, 60, 170, 130)
Pictures = tuple[npt.NDArray[np.float32], npt.NDArray[np.int16], npt.NDArray[np.int64]]


def backends() -> list[str]:
    works = {
        "gl": opengl.opengl_library() is not None,
        "embree": find_spec("embreex") is not None,
        "rays": True,
    }
    return [name for name, here in works.items() if here]


@pytest.fixture(scope="module")
def still() -> Still:
    table = Table()
    still = Still(Scene.from_layout(table, start_layout(table, chess.Board()), seed=4))
    paint(still.model, still.scene)  # as a camera does
    still.data.qpos[3:7] = (0.8, 0.3, 0.5, 0.1)  # one piece has fallen
    return still


@pytest.fixture(scope="module")
def drawn(still: Still) -> Mapping[str, Pictures]:
    return {name: draw(still, name, Region.whole(LENS)) for name in backends()}


def draw(still: Still, name: str, region: Region) -> Pictures:
    view = View(LENS, still.scene.table.robot_from_board @ Placement().board_from_camera)
    renderer, data = make_renderer(still.model, name), mujoco.MjData(still.model)
    kinematics(still, data)
    renderer.look(data, still.scene, Lighting())
    try:
        depth, ids = renderer.geometry(view, region)
        return depth, ids, renderer.colour(view, region).astype(np.int64)
    finally:
        renderer.close()


def test_all_draw_the_same_geometry(drawn: Mapping[str, Pictures]) -> None:
    depth, ids, _ = drawn["rays"]
    assert (ids >= 0).all()
    for name, (other, other_ids, _) in drawn.items():
        same = ids == other_ids
        assert same.mean() > 0.998, name  # MuJoCo's rays see round capsules, the others see facets
        assert np.quantile(np.abs(other - depth)[same], 0.995) < 0.1, name
        assert np.abs(other - depth)[same].max() < 20.0, name
    if {"gl", "embree"} <= set(drawn):
        (gl, gl_ids, _), (embree, embree_ids, _) = drawn["gl"], drawn["embree"]
        assert np.quantile(np.abs(gl - embree)[gl_ids == embree_ids], 0.9995) < 0.1


def test_all_show_the_same_colours(drawn: Mapping[str, Pictures]) -> None:
    _, _, colour = drawn["rays"]
    for name, (_, _, other) in drawn.items():
        assert np.abs(other - colour).mean() < 8, name
        correlation = np.corrcoef(other.ravel(), colour.ravel())[0, 1]
        assert correlation > 0.95, name


def test_a_part_is_drawn_as_in_the_whole(still: Still, drawn: Mapping[str, Pictures]) -> None:
    for name, whole in drawn.items():
        part = draw(still, name, SOME)
        assert np.abs(part[0] - whole[0][SOME.slices]).max() < 0.05, name
        assert (part[1] == whole[1][SOME.slices]).mean() > 0.999, name
        assert (np.abs(part[2] - whole[2][SOME.slices]) > 3).mean() < 0.002, name


def test_the_first_that_works_is_taken(still: Still, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "opengl_library", lambda: None)
    assert make_renderer(still.model).name == ("embree" if find_spec("embreex") else "rays")
    monkeypatch.setattr(module, "find_spec", lambda _name: None)
    assert make_renderer(still.model).name == "rays"


def test_one_that_is_missing_is_named(still: Still, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "embreex", None)
    with pytest.raises(TwinError, match="cannot draw by Embree"):
        make_renderer(still.model, "embree")
    monkeypatch.setattr(opengl, "opengl_library", lambda: None)
    with pytest.raises(TwinError, match="OpenGL does not work here"):
        make_renderer(still.model, "gl")
