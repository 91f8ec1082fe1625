"""The pad: keys to motion, with the live position. `kempelen jog` is it, `kempelen calibrate` uses it."""

import asyncio
import sys
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager

import numpy as np
import typer
from prompt_toolkit.application import Application
from prompt_toolkit.formatted_text import HTML
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import Layout, Window
from prompt_toolkit.layout.controls import FormattedTextControl

from kempelen.app.config import Config
from kempelen.app.idle_table import IdleTable
from kempelen.app.jogging import Point
from kempelen.core.errors import ConfigError, KempelenError
from kempelen.core.protocols import Follow, Robot

Direction = tuple[float, float, float]

KEYS: Mapping[str, Direction] = {
    "left": (-1, 0, 0), "right": (1, 0, 0), "down": (0, -1, 0), "up": (0, 1, 0), "pagedown": (0, 0, -1),
    "pageup": (0, 0, 1),
}  # fmt: skip
SPEEDS = (1.0, 3.0, 10.0, 30.0, 100.0, 200.0)


class JogPad:
    """Keys to motion, with the live position; hold a key to move, let go to stop.

    Args:
        robot: Homed.
        title: What is being done, shown on top.
    """

    def __init__(self, robot: Robot, title: str) -> None:
        self._robot = robot
        self._title = title
        self._speed = 3
        self._fault = ""
        self._tasks: set[asyncio.Task[None]] = set()

    async def run(self) -> bool:
        """Until Enter (True) or Escape (False)."""
        keys = KeyBindings()
        for key, direction in KEYS.items():
            keys.add(key)(self._on_move(direction))
        keys.add("+")(lambda _: self._faster(1))
        keys.add("-")(lambda _: self._faster(-1))
        keys.add("enter")(lambda event: event.app.exit(result=True))
        keys.add("escape", eager=True)(lambda event: event.app.exit(result=False))
        keys.add("c-c")(lambda event: event.app.exit(result=False))
        pad: Application[bool] = Application(
            Layout(Window(FormattedTextControl(self._text), height=4)),
            key_bindings=keys,
            refresh_interval=0.1,
        )
        try:
            return await pad.run_async(handle_sigint=False)
        finally:
            await self._robot.jog_stop()

    def _on_move(self, direction: Direction) -> Callable[[KeyPressEvent], None]:
        def move(_event: KeyPressEvent) -> None:
            task = asyncio.ensure_future(self._jog(direction))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

        return move

    async def _jog(self, direction: Direction) -> None:
        try:
            await self._robot.jog(direction, SPEEDS[self._speed])
            self._fault = ""
        except KempelenError as error:
            self._fault = str(error)

    def _faster(self, by: int) -> None:
        self._speed = min(max(self._speed + by, 0), len(SPEEDS) - 1)

    def _text(self) -> HTML:
        x, y, z = self._robot.state.reported_position or (float("nan"),) * 3
        return HTML(
            "<b>{}</b>\nx {}  y {}  z {} mm   {}   speed {} mm/s\n"
            "arrows: x, y   PageUp/PageDown: z   +/-: speed   Enter: done   Esc: leave\n"
            "<ansiyellow>{}</ansiyellow>"
        ).format(
            self._title,
            f"{x:8.2f}",
            f"{y:8.2f}",
            f"{z:8.2f}",
            self._robot.state.phase,
            SPEEDS[self._speed],
            self._fault,
        )


@asynccontextmanager
async def homed_robot(config: Config) -> AsyncIterator[Robot]:
    """The configured robot, connected and homed; on the twin a table of its own."""
    async with IdleTable(config) as table:
        typer.echo("Homing …")
        await table.session.robot.home()
        yield table.session.robot


def need_terminal(instead: str) -> None:
    """The pad needs keys.

    Raises:
        ConfigError: there is no terminal.
    """
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise ConfigError("The jog pad needs a terminal with a keyboard.", hint=instead)


async def jog(config: Config, to: Point | None) -> None:
    """Drive by hand, or straight to a point; where the machine then is gets printed."""
    async with homed_robot(config) as robot:
        if to is None:
            await JogPad(robot, "Jog").run()
        else:
            here = robot.state.reported_position or to
            way = np.array([here, to])
            await robot.run([Follow(way, float(np.abs(way[1] - way[0]).max()) / min(robot.space.velocity))])
        x, y, z = robot.state.reported_position or (float("nan"),) * 3
        typer.echo(f"x {x:.3f}  y {y:.3f}  z {z:.3f} mm")
