"""Runs a game in the terminal: the game itself, its picture and what is typed, side by side."""

import asyncio
import contextlib
import sys
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import typer
from rich.console import Console
from rich.table import Table

from kempelen.app.cast import GameRequest
from kempelen.app.config import Config
from kempelen.app.live_game import LiveGame
from kempelen.app.people import Answers
from kempelen.app.report import GameReport
from kempelen.cli.commands import Commander, LeaveError
from kempelen.cli.plain import PlainView, typed_lines
from kempelen.cli.terminal import TerminalView
from kempelen.core.errors import StoppedError

INTERRUPTED = 130


def run_game(config: Config, request: GameRequest | int, report: Path | None) -> None:
    """Play to the end, or until the person leaves; always at rest and resumable afterwards."""
    runner = _Runner(config, request)
    try:
        result = asyncio.run(runner.run())
    except (KeyboardInterrupt, LeaveError):
        raise typer.Exit(runner.farewell()) from None
    except StoppedError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(error.exit_code) from None
    if report is not None:
        result.write(report)
    Console().print(summary(result))


class _Runner:
    def __init__(self, config: Config, request: GameRequest | int) -> None:
        self._config = config
        self._request = request
        self._console = Console()
        self._say: Callable[[str], None] = self._print
        self._game = 0

    def _print(self, text: str) -> None:
        self._console.print(text, markup=False, highlight=False)

    def _tell(self, text: str) -> None:
        """To whichever view is on."""
        self._say(text)

    def farewell(self) -> int:
        """Say how to go on; the exit code."""
        if self._game:
            typer.echo(
                f"The robot is at rest and the game is kept. Go on with it: kempelen resume {self._game}"
            )
        return INTERRUPTED

    async def run(self) -> GameReport:
        answers = Answers(self._tell)
        async with LiveGame(self._config, self._request, answers.ask) as game:
            self._game = game.arbiter.game
            commander = Commander(game, answers, self._tell)
            async with self._view(game, commander) as (show, lines):
                return await self._together(game, commander, show, lines)

    @contextlib.asynccontextmanager
    async def _view(
        self, game: LiveGame, commander: Commander
    ) -> AsyncIterator[tuple[PlainView | TerminalView, AsyncIterator[str]]]:
        if not (sys.stdin.isatty() and sys.stdout.isatty()):
            yield PlainView(self._console), typed_lines()
            return
        people = game.arbiter.pairing.people
        view = TerminalView(
            lambda: game.arbiter.state.board,
            lambda: game.session.robot.state,
            commander.words,
            flipped=people == (False,),
        )
        self._say = view.say
        async with view.live():
            yield view, view.typed()

    async def _together(
        self, game: LiveGame, commander: Commander, view: PlainView | TerminalView, lines: AsyncIterator[str]
    ) -> GameReport:
        """The game, its picture and its commands; the first to end well or badly ends all."""
        with game.arbiter.events.reader() as reader:
            playing = asyncio.ensure_future(game.play())
            obeying = asyncio.ensure_future(commander.obey(lines))
            showing = asyncio.ensure_future(view.show(reader))
            try:
                await asyncio.wait({playing, obeying}, return_when=asyncio.FIRST_COMPLETED)
                if not playing.done():
                    obeying.result()
                report = await playing
                await showing
                return report
            finally:
                for task in (playing, obeying, showing):
                    task.cancel()
                await asyncio.gather(playing, obeying, showing, return_exceptions=True)


def summary(report: GameReport) -> Table:
    """The report for people."""
    table = Table(title=f"Game {report.game}: {report.result}, {report.reason}", show_header=False)
    table.add_row("half-moves, transfers", f"{report.plies}, {report.transfers}")
    if report.placement is not None:
        p = report.placement
        table.add_row(
            "placement error",
            f"mean {p.mean_mm:.2f}, 95 % {p.p95_mm:.2f}, worst {p.max_mm:.2f} mm (n = {p.n})",
        )
        table.add_row("fallen, neighbours moved", f"{p.toppled}, at most {p.neighbour_max_mm:.2f} mm")
    table.add_row("interventions", str(report.interventions))
    table.add_row("robot time", f"{report.robot_time_s:.1f} s in {report.wall_time_s:.1f} s")
    table.add_row("final position", report.final_fen)
    for line in report.disagreements:
        table.add_row("table differs", line)
    return table
