"""Runs a game in the terminal: the game itself, its picture and what is typed, side by side."""

import asyncio
import contextlib
import errno
import os
import signal
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import replace

import typer
from rich.console import Console
from rich.table import Table

from kempelen.app.cast import EngineWish, GameRequest
from kempelen.app.config import Config
from kempelen.app.live_game import LiveGame
from kempelen.app.people import Answers
from kempelen.app.report import GameReport
from kempelen.app.table_status import ToldStatus
from kempelen.cli.board import Look
from kempelen.cli.commands import Commander, LeaveError
from kempelen.cli.plain import PlainView, typed_lines
from kempelen.cli.screen import GameScreen
from kempelen.cli.showing import Showing
from kempelen.cli.terminal import MIN_COLUMNS, MIN_ROWS, TerminalView, san_moves
from kempelen.cli.trouble import tell, told_of_warnings
from kempelen.core.errors import KempelenError
from kempelen.core.events import Event, OperatorAnswered, OperatorAsked

INTERRUPTED = 130
_SIGNALS = (signal.SIGTERM, signal.SIGHUP)  # SIGINT is asyncio's own

View = PlainView | TerminalView


class _Output(Console):
    """Standard output; when its reader has gone, the game must come to rest before the program ends."""

    def on_broken_pipe(self) -> None:
        """Instead of ending the program on the spot."""
        raise BrokenPipeError(errno.EPIPE, "nobody reads standard output any more")


def run_game(
    config: Config, request: GameRequest | int, showing: Showing, wish: EngineWish | None = None
) -> None:
    """Play to the end, or until the person leaves; always at rest and resumable afterwards.

    Args:
        config: Everything configured.
        request: A new game, or the number of one in the journal.
        showing: How it is shown.
        wish: Other engines for a game of the journal.
    """
    runner = GameRunner(config, request, showing, wish)
    code = 0
    try:
        asyncio.run(runner.run())
    except (KeyboardInterrupt, LeaveError):
        code = INTERRUPTED
    except asyncio.CancelledError:
        code = 128 + runner.signal
    except BrokenPipeError:
        code = 128 + signal.SIGPIPE
        runner.lose_output()
    except KempelenError as error:
        if not runner.game:
            raise
        tell(error)
        code = error.exit_code
    runner.tell_end()
    raise typer.Exit(code)


class GameRunner:
    """One game with its views.

    Attributes:
        game: Its number; 0 as long as it has not begun.
        signal: The one that ended it.
    """

    def __init__(
        self, config: Config, request: GameRequest | int, showing: Showing, wish: EngineWish | None
    ) -> None:
        self._config = config
        self._wish = wish
        self._request = request
        self._showing = showing
        self._console: Console = _Output()
        self._say: Callable[[str], None] = self._print
        self._report: GameReport | None = None
        self._pgn = ""
        self.game = 0
        self.signal = 0

    def _print(self, text: str | Table) -> None:
        """To standard output, unless its terminal has gone."""
        try:
            self._console.print(text, markup=False, highlight=False, soft_wrap=isinstance(text, str))
        except OSError as error:
            if error.errno != errno.EIO:
                raise

    def _tell(self, text: str) -> None:
        """To whichever view is on."""
        self._say(text)

    async def run(self) -> None:
        """Until the game is over.

        Raises:
            LeaveError: the person left.
            KempelenError: what ended it.
        """
        answers = Answers(self._tell)
        if self._has_picture():
            self._print("Setting up engine, table and robot …")
        with self._told_by_signals(), told_of_warnings(self._tell):
            async with LiveGame(self._config, self._request, answers.ask, self._wish) as game:
                self.game, self._pgn = game.arbiter.game, str(game.pgn)
                commander = Commander(game, answers, self._tell, patient=not _keyboard())
                status = ToldStatus(self._config, game.arbiter.events)
                async with status, self._view(game, commander) as (view, lines):
                    for notice in game.notices:
                        self._say(notice)
                    await self._together(game, commander, view, lines)

    @contextlib.contextmanager
    def _told_by_signals(self) -> Iterator[None]:
        """A closed terminal or a polite kill ends the game as Ctrl-C does."""
        loop, task = asyncio.get_running_loop(), asyncio.current_task()

        def leave(number: int) -> None:
            self.signal = number
            if task is not None:
                task.cancel()

        for number in _SIGNALS:
            loop.add_signal_handler(number, leave, number)
        try:
            yield
        finally:
            for number in _SIGNALS:
                loop.remove_signal_handler(number)

    @contextlib.asynccontextmanager
    async def _view(
        self, game: LiveGame, commander: Commander
    ) -> AsyncIterator[tuple[View, AsyncIterator[str]]]:
        if not self._has_picture():
            yield (
                PlainView(self._console, lambda: game.arbiter.pairing.people, lambda: game.length),
                typed_lines(),
            )
            return
        flipped = game.arbiter.pairing.people == (False,)
        view = TerminalView(
            GameScreen(game, Look.of(self._console), flipped=flipped),
            prompt=commander.prompt,
            moves=lambda: san_moves(game.board) if game.cast.person.to_move else (),
            commands=commander.words,
            console=self._console,
        )
        self._say = view.say
        try:
            async with view.live():
                yield view, view.typed()
        finally:
            self._say = self._print

    def _has_picture(self) -> bool:
        """Whether there is a terminal that can redraw, and wants to."""
        if self._showing.plain or self._console.is_dumb_terminal:
            return False
        if not (_keyboard() and sys.stdout.isatty()):
            return False
        return self._console.width >= MIN_COLUMNS and self._console.height >= MIN_ROWS

    async def _together(
        self, game: LiveGame, commander: Commander, view: View, lines: AsyncIterator[str]
    ) -> None:
        """The game, its picture and its commands; the first to end well or badly ends all."""
        with game.arbiter.events.reader() as reader:
            playing = asyncio.ensure_future(game.play())
            obeying = asyncio.ensure_future(commander.obey(lines))
            showing = asyncio.ensure_future(view.show(_to_show(reader, game)))
            try:
                await asyncio.wait({playing, obeying, showing}, return_when=asyncio.FIRST_COMPLETED)
                if obeying.done():
                    obeying.result()
                await showing
                self._report = await playing
            except BaseException as error:
                self._report = _interrupted(game, error)
                raise
            finally:
                for task in (playing, obeying, showing):
                    task.cancel()
                await asyncio.gather(playing, obeying, showing, return_exceptions=True)

    def lose_output(self) -> None:
        """Nobody reads standard output any more: the end is told to standard error."""
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # its last flush must not fail again
        self._console = Console(stderr=True)

    def tell_end(self) -> None:
        """The result, or how to go on; the report's file last, so that nothing else is lost with it."""
        if self._report is None:
            return
        if self._report.result == "*" and self._report.reason == "interrupted":
            self._print(
                f"The robot is at rest and game {self.game} is kept. "
                f"Go on with it: kempelen resume {self.game}"
            )
        else:
            self._print(summary(self._report))
            self._print(f"Final position: {self._report.final_fen}")
            self._print(f"PGN: {self._pgn}")
            self._print("Look at all games: kempelen games    Play another one: kempelen play")
        if self._showing.report is not None:
            self._report.write(self._showing.report)
            self._print(f"Report: {self._showing.report.absolute()}")


async def _to_show(stream: AsyncIterator[Event], game: LiveGame) -> AsyncIterator[Event]:
    """All events but the requests to a person who is asked in words as well."""
    asked_in_words = game.session.control is None
    async for event in stream:
        if not (asked_in_words and isinstance(event, OperatorAsked | OperatorAnswered)):
            yield event


def _keyboard() -> bool:
    """Whether a person types."""
    return sys.stdin is not None and not sys.stdin.closed and sys.stdin.isatty()


def _interrupted(game: LiveGame, error: BaseException) -> GameReport:
    report = game.report()
    return replace(report, error=error.message) if isinstance(error, KempelenError) else report


def summary(report: GameReport) -> Table:
    """The report for people."""
    table = Table(title=f"Game {report.game}: {report.result}, {report.reason}", show_header=False)
    table.add_row("half-moves, transfers", f"{report.plies}, {report.transfers}")
    if (p := report.placement) is not None and p.n:
        table.add_row(
            "placement error",
            f"mean {p.mean_mm:.2f}, 95 % {p.p95_mm:.2f}, worst {p.max_mm:.2f} mm (n = {p.n})",
        )
        table.add_row("fallen, neighbours moved", f"{p.toppled}, at most {p.neighbour_max_mm:.2f} mm")
    table.add_row("interventions", str(report.interventions))
    table.add_row("robot time", f"{report.robot_time_s:.1f} s in {report.wall_time_s:.1f} s")
    if report.robot_time_over_bound:
        table.add_row("carries over bound", f"{report.robot_time_over_bound:.3f}")
    for line in report.disagreements:
        table.add_row("table differs", line)
    return table
