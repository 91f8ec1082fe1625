"""Is the camera there that the games are to be seen by?"""

from kempelen.app.camera_pose import load_camera_pose
from kempelen.app.cameras import open_camera, parse_camera
from kempelen.app.config import TWIN_PORT, Config
from kempelen.app.doctor_probe import examine_twin_camera
from kempelen.app.doctor_rows import Check, failed, ok, warn
from kempelen.core.camera import Frame
from kempelen.core.errors import CalibrationError, CameraError, ConfigError

FIRST_FRAME_S = 10.0


async def examine_camera(config: Config) -> Check:
    """The configured camera shows a picture."""
    source = config.camera_source
    if not config.has_camera:
        felt = "the reed board feels" if config.sensor.reed else "is believed"
        return ok("camera", f"none is wanted; what is done on the board {felt}")
    if not source:
        return warn("camera", "none is named", 'Name one, such as [camera] source = "uvc:0"')
    if source == TWIN_PORT:
        return await examine_twin_camera()
    try:
        parse_camera(source)
        async with open_camera(source, config) as camera:
            frame = await camera.newest(-1, FIRST_FRAME_S)
    except (CameraError, ConfigError) as error:
        return failed("camera", error)
    except EOFError:
        frame = None
    if frame is None:
        return warn(
            "camera", f"{source} opens and shows nothing", "Check its cable, or another program using it."
        )
    return ok("camera", f"{source}: {_pictures(frame)}")


def _pictures(frame: Frame) -> str:
    """What it shows."""
    parts = []
    if frame.colour is not None:
        parts.append(f"colour {frame.colour.shape[1]} x {frame.colour.shape[0]}")
    if frame.depth is not None:
        parts.append(f"depth {frame.depth.shape[1]} x {frame.depth.shape[0]}")
    return ", ".join(parts) or "empty frames"


def check_camera_pose(config: Config) -> Check:
    """It is known where the camera stands over the robot."""
    try:
        pose = load_camera_pose(config.camera_calibration_path)
    except CalibrationError as error:
        return failed("camera's place", error)
    if pose is None:
        return warn(
            "camera's place",
            "not known: a bumped board cannot be measured in mid-game",
            "Measure it once: kempelen calibrate --camera",
        )
    x, y, z = pose.robot_from_camera.translation
    return ok("camera's place", f"({x:.0f}, {y:.0f}, {z:.0f}) mm over the robot, {pose.date:%Y-%m-%d %H:%M}")
