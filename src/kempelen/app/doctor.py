"""``kempelen doctor``: is everything here that a game needs, and what to do where it is not.

Nothing is changed and no port of a robot is opened: opening one resets many a controller.
"""

import os
import platform
import shutil
import statistics
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TextIO

from kempelen.app.arm_reach import tilts_told
from kempelen.app.calibration_file import load_calibration
from kempelen.app.config import Config, default_config_path, load_config
from kempelen.app.doctor_camera import check_camera_pose, examine_camera
from kempelen.app.doctor_nodes import at_node, examine_nodes
from kempelen.app.doctor_ports import examine_port, examine_serial_ports
from kempelen.app.doctor_probe import examine_physics, examine_rendering
from kempelen.app.doctor_reed import examine_reed
from kempelen.app.doctor_rows import Check, fail, failed, ok, warn
from kempelen.app.fitting import misfits, tilts
from kempelen.core.calibration import Calibration
from kempelen.core.errors import CalibrationError, ConfigError, FitError
from kempelen.engines.probe import EngineReport, probe
from kempelen.robots.transport import list_ports

LEAST_PYTHON = (3, 11)
LEAST_FREE_MB = 20.0
COMFORTABLE_FREE_MB = 500.0
SLOW_SYNC_SECONDS = 0.05  # every intent is on disk before the robot moves: several a move
_SYNC_TRIALS = 9
_LEAST_COLUMNS = 80


async def examine(
    config_path: Path | None = None, overrides: Mapping[str, object] | None = None
) -> AsyncIterator[Check]:
    """All checks, each as soon as it is done.

    Args:
        config_path: As for `load_config`; when the configuration is wrong, the rest is checked with the
            defaults.
        overrides: As for `load_config`.
    """
    yield check_python(sys.version_info[:3])
    config, row = check_config(config_path, overrides)
    yield row
    async for row in examine_machine(config):
        yield row
    for row in check_terminal(sys.stdout):
        yield row


async def examine_machine(config: Config, *, at_play: bool = False) -> AsyncIterator[Check]:
    """What does not depend on how the program was called.

    Args:
        config: To be checked with.
        at_play: Whether robot and camera are in use: they are left alone then.
    """
    calibration, row = check_calibration(config)
    yield row
    yield check_table(config, calibration)
    yield check_space(config.data_dir)
    yield check_sync(config.data_dir)
    if not (at_play or at_node(config.robot.port)):
        yield await examine_port(config.robot.port)
    for row in examine_serial_ports(list_ports()):
        yield row
    if not at_node(config.engine.path):
        for row in check_engines(await probe(config.engine.path)):
            yield row
    yield await examine_physics()
    yield await examine_rendering()
    if not at_play:
        if not at_node(config.camera_source):
            yield await examine_camera(config)
        if config.sensor.reed and not at_node(config.sensor.port):
            yield await examine_reed(config)
    async for row in examine_nodes(config):
        yield row
    if config.has_camera:
        yield check_camera_pose(config)


def check_python(version: Sequence[int]) -> Check:
    """The interpreter is new enough."""
    found = f"{'.'.join(map(str, version))} on {platform.system()} {platform.machine()}"
    if tuple(version[:2]) < LEAST_PYTHON:
        return fail("Python", found, f"Install Python {'.'.join(map(str, LEAST_PYTHON))} or newer.")
    return ok("Python", found)


def check_config(path: Path | None, overrides: Mapping[str, object] | None) -> tuple[Config, Check]:
    """The configuration can be read; the defaults where it cannot."""
    try:
        config = load_config(path, overrides)
    except ConfigError as error:
        return Config(), failed("configuration", error)
    file = path or default_config_path()
    found = str(file) if file.exists() else f"defaults; {file} does not exist and is not needed"
    return config, ok("configuration", found)


def check_calibration(config: Config) -> tuple[Calibration | None, Check]:
    """The calibration is there where a real machine needs it, and can be believed."""
    try:
        calibration = load_calibration(config.calibration_path)
    except CalibrationError as error:
        return None, failed("calibration", error)
    if calibration is None:
        if config.on_twin:
            return None, ok("calibration", "none; the twin's board stands where the configuration says")
        return None, warn(
            "calibration", f"none at {config.calibration_path}", "Measure the board: kempelen calibrate"
        )
    if not calibration.checked:
        return calibration, warn(
            "calibration",
            f"{calibration}: two corners cannot be checked",
            "Touch a third corner: kempelen calibrate",
        )
    return calibration, ok("calibration", str(calibration))


def check_table(config: Config, calibration: Calibration | None) -> Check:
    """Board, trays, pieces, gripper and work space fit together."""
    try:
        table = config.build_table(calibration)
        findings = misfits(config, table)
    except (FitError, ConfigError) as error:
        return failed("table", error)
    if findings:
        return fail("table", "\n".join(map(str, findings)), "Change the configuration or the table.")
    fits = (
        f"{table.pieces.name} pieces on {table.square:g} mm squares, {len(table.slots)} tray slots: all fits"
    )
    return ok("table", "\n".join(filter(None, (fits, tilts_told(tilts(config, table))))))


def check_space(directory: Path) -> Check:
    """There is room for journal and games."""
    place = _existing(directory)
    free = shutil.disk_usage(place).free / 1e6
    found = f"{free:,.0f} MB free for {directory}"
    if not os.access(place, os.W_OK | os.X_OK):
        return fail("disk", f"{place} cannot be written to", "Allow it, or name another one with --data-dir.")
    if free < LEAST_FREE_MB:
        return fail(
            "disk", found, f"Free at least {LEAST_FREE_MB:.0f} MB, or name another one with --data-dir."
        )
    if free < COMFORTABLE_FREE_MB:
        return warn("disk", found, f"Free some space: {COMFORTABLE_FREE_MB:.0f} MB last for long.")
    return ok("disk", found)


def check_sync(directory: Path) -> Check:
    """The disk confirms a write fast enough: each step of a move waits for it."""
    try:
        seconds = sync_seconds(_existing(directory))
    except OSError as error:
        return fail(
            "disk speed",
            f"{directory}: {error.strerror}",
            "Mend the disk, or name another one with --data-dir.",
        )
    found = f"{1000 * seconds:.1f} ms to confirm a write"
    if seconds > SLOW_SYNC_SECONDS:
        return warn("disk speed", found, "Moves will start late; a faster disk helps: --data-dir.")
    return ok("disk speed", found)


def sync_seconds(directory: Path) -> float:
    """Median time of writing 4 KiB and forcing them to disk, s."""
    times = []
    with tempfile.TemporaryFile(dir=directory) as file:
        for _ in range(_SYNC_TRIALS):
            start = time.perf_counter()
            file.write(bytes(4096))
            file.flush()
            os.fsync(file.fileno())
            times.append(time.perf_counter() - start)
    return statistics.median(times)


def check_engines(reports: Sequence[EngineReport]) -> Iterator[Check]:
    """The engine that would be used has named a move; further ones may fail."""
    for i, report in enumerate(reports):
        where = ", ".join(part for part in (report.source, report.path) if part)
        if report.works:
            yield ok("engine", f"{report.name} ({where})")
        else:
            verdict = fail if i == 0 else warn
            yield verdict("engine", f"{report.name}: {report.fault}", report.hint)


def check_terminal(stream: TextIO) -> Iterator[Check]:
    """The live board can be drawn."""
    encoding = (stream.encoding or "ascii").lower().replace("-", "")
    if encoding != "utf8":
        yield warn("terminal", f"encoding {stream.encoding}", "Pieces appear as letters; set LANG=C.UTF-8.")
    elif not stream.isatty():
        yield ok("terminal", "none: plain lines will be printed")
    elif (columns := shutil.get_terminal_size().columns) < _LEAST_COLUMNS:
        yield warn("terminal", f"{columns} columns", f"Widen it to {_LEAST_COLUMNS} for the live board.")
    else:
        yield ok("terminal", f"{columns} columns, UTF-8")


def _existing(directory: Path) -> Path:
    """The directory, or the nearest one above it that exists."""
    return next(place for place in (directory, *directory.absolute().parents) if place.is_dir())
