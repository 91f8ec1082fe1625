"""Views of the world: a picture where OpenGL works, a plain error where it does not."""

import subprocess
from collections.abc import Iterator

import chess
import pytest

from kempelen.core.errors import TwinError
from kempelen.core.table import Table, start_layout
from kempelen.twin.physics import Scene, World, opengl

pytestmark = pytest.mark.physics


@pytest.fixture
def probe(monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    opengl.opengl_library.cache_clear()
    yield monkeypatch
    opengl.opengl_library.cache_clear()


def test_a_view_shows_the_table() -> None:
    if opengl.opengl_library() is None:
        pytest.skip("OpenGL does not work here")
    table = Table()
    picture = World(Scene.from_layout(table, start_layout(table, chess.Board()))).render(64, 48)
    assert picture.shape == (48, 64, 3)
    assert picture.max() > picture.min()


def test_where_drawing_aborts_only_the_probe_dies(probe: pytest.MonkeyPatch) -> None:
    probe.setattr(opengl, "_PROBE", "import os; os.abort()")
    with pytest.raises(TwinError, match=r"OpenGL does not work here.*MUJOCO_GL"):
        World(Scene(Table(), ())).render()


def test_a_probe_that_hangs_counts_as_no(probe: pytest.MonkeyPatch) -> None:
    def hang(*_args: object, **_options: object) -> None:
        raise subprocess.TimeoutExpired("probe", 60.0)

    probe.setattr(subprocess, "run", hang)
    assert opengl.opengl_library() is None


@pytest.mark.parametrize(
    ("width", "height", "camera", "words"),
    [
        (64, 48, "nowhere", "no camera 'nowhere'.*overview"),
        (4000, 48, "overview", "4000 x 48 pixels"),
        (64, 0, "overview", "64 x 0 pixels"),
    ],
)
def test_impossible_views_are_refused(
    probe: pytest.MonkeyPatch, width: int, height: int, camera: str, words: str
) -> None:
    probe.setattr(opengl, "_PROBE", "")
    with pytest.raises(TwinError, match=words):
        World(Scene(Table(), ())).render(width, height, camera)
