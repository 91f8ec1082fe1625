"""Which senses are configured, and what that means."""

import pytest

from kempelen.app.config import load_config
from kempelen.app.doctor_reed import examine_reed
from kempelen.app.doctor_rows import Status
from kempelen.core.errors import ConfigError


@pytest.mark.parametrize(
    ("kind", "camera", "reed", "use"),
    [
        ("auto", True, False, "both"),
        ("none", False, False, "both"),
        ("camera", True, False, "both"),
        ("depth", True, False, "depth"),
        ("colour", True, False, "colour"),
        ("reed", False, True, "both"),
        ("depth,reed", True, True, "depth"),
        ("reed,colour", True, True, "colour"),
        ("depth,colour,reed", True, True, "both"),
        ("camera,reed", True, True, "both"),
    ],
)
def test_senses(kind: str, camera: bool, reed: bool, use: str) -> None:
    config = load_config(None, {"sensor.kind": kind})
    assert (config.has_camera, config.sensor.reed, config.sensor.use) == (camera, reed, use)
    assert config.has_eyes == (camera or reed)
    assert config.felt_only == (reed and not camera)
    assert (config.twin_reed is not None) == reed
    assert config.hands == ("person" if camera or reed else "robot")


@pytest.mark.parametrize("kind", ["smell", "reed,none", "reed,reed", "reed,", "auto,reed"])
def test_what_is_no_sense_is_refused(kind: str) -> None:
    with pytest.raises(ConfigError, match="of camera, depth, colour and reed"):
        load_config(None, {"sensor.kind": kind})


def test_a_board_elsewhere_is_not_the_twins() -> None:
    config = load_config(None, {"sensor.kind": "reed", "sensor.port": "/dev/ttyUSB1"})
    assert config.twin_reed is None


async def test_the_doctor_tells_of_a_board_that_is_not_there() -> None:
    twin = await examine_reed(load_config(None, {"sensor.kind": "reed"}))
    assert (twin.status, twin.found) == (Status.OK, "the twin: it brings its own")
    gone = await examine_reed(load_config(None, {"sensor.kind": "reed", "sensor.port": "/dev/nowhere"}))
    assert gone.status is Status.FAIL
    assert "/dev/nowhere does not exist" in gone.found
