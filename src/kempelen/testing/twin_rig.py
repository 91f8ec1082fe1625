"""The gantry of a twin process, physics included, for contract suites."""

import json
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

from kempelen.core.places import Layout
from kempelen.core.table import Table
from kempelen.robots.grbl.gantry import GrblGantry
from kempelen.robots.transport import open_port
from kempelen.testing.rigs import FAST
from kempelen.twin.spec import TwinSpec


class TwinRig:
    """A twin of its own; blocking calls, so that one process can serve many tests and event loops.

    Args:
        folder: For its socket and the link to its terminal.
        speed: Time scale; 0 for as fast as it can.
    """

    def __init__(self, folder: Path, *, speed: float) -> None:
        self.table = Table()
        spec = TwinSpec.of(
            self.table, Layout({}), control=folder / "control", link=str(folder / "wire"), speed=speed
        )
        self._process = subprocess.Popen(
            [sys.executable, "-m", "kempelen.twin"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        self._tell(spec)
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.connect(spec.control)
        self._answers = self._socket.makefile("rb")

    def _tell(self, spec: TwinSpec) -> None:
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None
        assert stdout is not None
        stdin.write(spec.model_dump_json().encode() + b"\n")
        stdin.flush()
        self.address = str(json.loads(stdout.readline())["address"])

    def ask(self, op: str, **arguments: object) -> dict[str, Any]:
        """One request to the twin's side door, one answer."""
        self._socket.sendall(json.dumps({"id": 0, "op": op, **arguments}).encode() + b"\n")
        answer: dict[str, Any] = json.loads(self._answers.readline())
        assert answer["ok"], answer
        return answer

    def switch_on(self) -> None:
        """As if the power had just come."""
        self.ask("fault", name="reset")

    def close(self) -> None:
        """End the process."""
        self._answers.close()
        self._socket.close()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()
        self._process.wait()

    # --- a rig (`kempelen.testing.contracts.robot.Rig`) ----------------------------------------------------

    def robot(self) -> GrblGantry:
        """A new driver, not entered yet."""
        return GrblGantry(lambda: open_port(self.address), self.table.space, timing=FAST)

    def position(self) -> tuple[float, float, float]:
        """Where the tool point truly is, robot frame, mm."""
        x, y, z = self.ask("truth")["tool"]
        return (x, y, z)

    def gripper_closed(self) -> bool:
        """What the gripper is told."""
        return bool(self.ask("truth")["closed"])

    def unplug(self) -> None:
        """Pull the cable."""
        self.ask("fault", name="drop-link")
