"""A running process that speaks the Chess Engine Communication Protocol (xboard), version 1 or 2.

python-chess speaks it too, but only with engines that know ``setboard`` and ``ping``. This side asks for
neither: the game is told as a replay of its moves, and where there is no ``ping`` the engine's own lines keep
step. The engine is in force mode whenever it is not asked for a move.
"""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import Self

import chess
import chess.engine

from kempelen.core.errors import EngineError
from kempelen.core.protocols import OnThinking, Thinking
from kempelen.engines import xboard_lines as lines_of
from kempelen.engines import xboard_search as search
from kempelen.engines.wire import (
    EngineProcess,
    Findings,
    Listening,
    NotSpokenError,
    OptionValue,
    Patience,
    not_started,
)

_AGAIN = 0.3  # s after which it is asked for its features once more
_OLD = 2.0  # s without `feature` after which a program is taken to speak version 1, as the protocol says
_LINES = 64  # as many moves as are judged one by one for a weaker level
_APART_S = 0.02  # s for each of them
_RESIGNED = 900  # centipawns by which an engine that gives up is taken to be behind
_REFUSED_FEATURES = frozenset({"san", "reuse"})  # moves are told by their squares; a process plays many games
_RENAMED = {"memory": "Hash", "smp": "Threads"}
_COMMANDS = {"Hash": "memory", "Threads": "cores"}


class _Protocol(Listening, asyncio.SubprocessProtocol):
    """Hands each line of the output to whoever listens at the moment."""

    def __init__(self) -> None:
        super().__init__()
        self.on_line: Callable[[str], None] | None = None
        self.on_exit: Callable[[], None] | None = None
        self.hung_up = asyncio.Event()

    def process_exited(self) -> None:
        super().process_exited()
        if self.on_exit:
            self.on_exit()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - the signature of asyncio
        self.hung_up.set()

    def sort(self, fd: int, line: bytes) -> None:
        text = lines_of.without_prompt(line.decode("utf-8", "replace"))
        if text and not self._is_routine(text):
            self.note(text.encode())
        if fd == 1 and text and self.on_line:
            self.on_line(text)

    @staticmethod
    def _is_routine(text: str) -> bool:
        """What every healthy engine prints: no last words."""
        return text[0].isdigit() or text.partition(" ")[0] in {"feature", "pong", "move", "#"}


class XBoardProcess(EngineProcess):
    """One process that has told its features; made by `start`, ended by `close`."""

    tongue = "xboard"
    apart = True

    def __init__(
        self, protocol: _Protocol, transport: asyncio.SubprocessTransport, patience: Patience
    ) -> None:
        super().__init__(protocol, transport, patience)
        self._protocol = protocol
        self._features: dict[str, str] = {}
        self._options: dict[str, chess.engine.Option] = {
            "MultiPV": chess.engine.Option("MultiPV", "spin", 1, 1, _LINES, None)
        }
        self._lines = 1
        self._told: chess.Board | None = None  # the game as the engine knows it; None: it must be told anew
        self._game: object = None
        self._owed = False  # a search was broken off: its move is still to come
        self._playing = False  # it is thinking in the opponent's time
        self._pings = 0

    @classmethod
    async def start(cls, command: tuple[str, ...], patience: Patience, *, old: bool = False) -> Self:
        """Start the program and read its features.

        Args:
            command: Program and arguments.
            patience: For its greeting.
            old: A program that tells no features is believed to speak version 1 of the protocol.

        Raises:
            EngineError: It cannot be executed.
            NotSpokenError: It ends at once, or does not speak the protocol.
        """
        loop = asyncio.get_running_loop()
        try:
            transport, protocol = await loop.subprocess_exec(_Protocol, *command, process_group=0)
        except OSError as error:
            raise not_started(command[0], error) from error
        process = cls(protocol, transport, patience)
        try:
            await process._greet(old=old)
        except BaseException:
            await process.close(politely=False)
            raise
        return process

    @property
    def name(self) -> str:
        """As the engine calls itself; empty when it does not."""
        return self._features.get("myname", "")

    @property
    def options(self) -> Mapping[str, chess.engine.Option]:
        """Its own, ``Hash`` and ``Threads`` for memory and cores, and ``MultiPV``, which is ours."""
        return self._options

    async def configure(self, options: Mapping[str, OptionValue], *, lines: int = 1) -> None:
        """See the base class; several lines are had by letting the engine judge one move after the other."""
        self._lines = lines
        async with self._explained("became ready", self._patience.ready):
            for name, value in options.items():
                self._write(self._set(self._options[name], value))
            await self._in_step()

    async def search(
        self,
        board: chess.Board,
        limit: chess.engine.Limit,
        game: object,
        on_thinking: OnThinking | None,
        *,
        ponder: bool = False,
    ) -> Findings:
        """See the base class."""
        judged = min(board.legal_moves.count(), self._lines) if self._lines > 1 else 0
        seconds = (limit.time or 0.0) + judged * 2 * _APART_S + self._patience.grace
        async with self._explained("answered", seconds):
            await self._settle()
            if judged:
                return await self._judge(board, limit, game)
            return await self._move(board, limit, game, on_thinking, ponder=ponder)

    # --- greeting and options

    async def _greet(self, *, old: bool) -> None:
        self._write("xboard")
        deed = "told its features, so it seems to be no xboard engine"
        try:
            async with self._explained(deed, self._patience.hello) as limit:
                await self._features_told(limit, old=old)
                for name in self._features:
                    if name not in {"done", "option"}:
                        self._write(f"{'rejected' if name in _REFUSED_FEATURES else 'accepted'} {name}")
        except EngineError as fault:
            raise NotSpokenError(fault.message, hint=fault.hint) from fault

    async def _features_told(self, limit: asyncio.Timeout, *, old: bool) -> None:
        """Until ``done=1``; ``done=0`` asks for more time, and silence means version 1."""
        loop = asyncio.get_running_loop()
        end = limit.when() or loop.time()
        asking = asyncio.ensure_future(self._ask_features())

        def hear(line: str) -> bool | None:
            for name, values in lines_of.parse_features(line).items():
                asking.cancel()
                self._take_feature(name, values)
                if self._features.get("done") == "0":
                    silence.reschedule(end)
            return True if self._features.get("done") == "1" else None

        try:
            async with asyncio.timeout(min(_OLD, self._patience.hello)) as silence:
                await self._listen(hear)
        except TimeoutError:
            if not self._features and not old:
                seconds = min(_OLD, self._patience.hello)
                raise self._fault(f"it has told no features within {seconds:g} s") from None
        finally:
            asking.cancel()

    async def _ask_features(self) -> None:
        """Again and again: GNU Chess throws away what comes in together with ``xboard``."""
        while True:
            self._write("protover 2")
            await asyncio.sleep(_AGAIN)

    def _take_feature(self, name: str, values: Sequence[str]) -> None:
        self._features[name] = values[-1]
        if name == "option":
            parsed = (lines_of.parse_option(value) for value in values)
            self._options |= {option.name: option for option in parsed if option}
        elif name in _RENAMED and values[-1] == "1":
            ours = _RENAMED[name]
            self._options[ours] = chess.engine.Option(ours, "spin", 1, 1, 1 << 20, None)

    @staticmethod
    def _set(option: chess.engine.Option, value: OptionValue) -> str:
        checked = option.parse(value)
        if option.name in _COMMANDS:
            return f"{_COMMANDS[option.name]} {checked}"
        return f"option {option.name}={int(checked) if isinstance(checked, bool) else checked}"

    # --- one move

    async def _move(
        self,
        board: chess.Board,
        limit: chess.engine.Limit,
        game: object,
        on_thinking: OnThinking | None,
        *,
        ponder: bool,
    ) -> Findings:
        if self._is_answer(board, game):
            self._write(*search.control(board, limit), self._usermove(board.peek()))
        else:
            mode = ("post", "hard" if ponder else "easy")
            await self._tell(board, game, (*search.control(board, limit), *mode))
            self._write("go")
        findings = await self._heard_out(board, limit, on_thinking)
        self._told = board.copy()
        if findings.resigns:
            self._told = None
        else:
            self._told.push(findings.move)
        self._playing = ponder and not findings.resigns
        if not self._playing:
            self._write("force")
        return findings

    async def _heard_out(
        self, board: chess.Board, limit: chess.engine.Limit, on_thinking: OnThinking | None
    ) -> Findings:
        """Listen until it has moved; at the end of its time it is told to move at once."""
        findings = Findings()
        self._told = None  # until the move is known
        now = asyncio.get_running_loop().call_later(limit.time or 3600.0, self._write, "?")
        try:
            await self._listen(lambda line: search.take(line, board, findings, on_thinking))
        except asyncio.CancelledError:
            self._write("?")
            self._owed = True
            raise
        finally:
            now.cancel()
        return findings

    # --- every move by itself

    async def _judge(self, board: chess.Board, limit: chess.engine.Limit, game: object) -> Findings:
        """What the engine makes of each move: it is made, and the answer's score is turned round."""
        findings = Findings()
        moves = sorted(board.legal_moves, key=chess.Move.uci)[: self._lines]
        depth = limit.depth and max(1, limit.depth - 1)  # the move itself is the first half-move
        short = chess.engine.Limit(time=min(_APART_S, (limit.time or 1.0) / len(moves)), depth=depth)
        for move in moves:
            after = board.copy()
            after.push(move)
            thinking = await self._after(after, short, game)
            findings.lines[len(findings.lines) + 1] = search.turned(thinking, move)
        ranked = sorted(findings.lines.values(), key=search.worth, reverse=True)
        findings.lines = dict(enumerate(ranked, start=1))
        findings.move = findings.lines[1].line[0]
        return findings

    async def _after(self, after: chess.Board, limit: chess.engine.Limit, game: object) -> Thinking:
        if after.is_checkmate():
            return Thinking(depth=1, mate=0)
        if not any(after.legal_moves):
            return Thinking(depth=1, centipawns=0)
        answer = await self._move(after, limit, game, None, ponder=False)
        if answer.resigns:
            return Thinking(depth=1, centipawns=-_RESIGNED)
        return answer.lines.get(1, Thinking(depth=1, centipawns=0))

    # --- the engine's board

    def _is_answer(self, board: chess.Board, game: object) -> bool:
        """Whether an engine that thinks in the opponent's time need only be told the move."""
        if not self._playing or self._told is None or game is not self._game:
            return False
        return search.continues(self._told, board) == 1

    async def _tell(self, board: chess.Board, game: object, then: Sequence[str]) -> None:
        """Bring the engine's board to ``board``: the moves that it lacks, or the whole game again."""
        told = self._told
        more = search.continues(told, board) if told is not None and game is self._game else None
        self._playing, self._told = False, None
        self._write("force", *(self._set_up(board.root()) if more is None else ()))
        self._game = game
        moves = board.move_stack[len(board.move_stack) - more :] if more is not None else board.move_stack
        self._write(*map(self._usermove, moves), *then)
        await self._in_step(frozenset(move.uci() for move in moves))

    def _set_up(self, root: chess.Board) -> Sequence[str]:
        if root.fen() == chess.STARTING_FEN:
            return ("new", "force")
        if self._features.get("setboard") == "1":
            return ("new", "force", f"setboard {root.fen()}")
        commands = lines_of.edit_lines(root)
        if commands is None:
            raise EngineError(
                "it knows no setboard, and its edit mode cannot say the castling rights or the en passant "
                f"square of {root.fen()}",
                hint="Use another engine for a game from this position.",
            )
        return ("new", "force", *commands)

    def _usermove(self, move: chess.Move) -> str:
        return f"{'usermove ' if self._features.get('usermove') == '1' else ''}{move.uci()}"

    # --- lines

    async def _settle(self) -> None:
        """Take delivery of the move of a search that was broken off."""
        if self._owed:
            await self._listen(lambda line: bool(lines_of.move_text(line) or lines_of.verdict(line)) or None)
            self._owed = False
            self._write("force")

    async def _in_step(self, moves: frozenset[str] = frozenset()) -> None:
        """Wait, by ``ping``, until the engine has heard everything; it may refuse none of ``moves``."""
        if self._features.get("ping") != "1":
            return
        self._pings += 1
        pong = f"pong {self._pings}"

        def hear(line: str) -> bool | None:
            if search.refuses(line, moves):
                raise EngineError(f"it refuses a legal move of the game: {line}")
            return True if line == pong else None

        self._write(f"ping {self._pings}")
        await self._listen(hear)

    async def _listen(self, hear: Callable[[str], bool | None]) -> None:
        """Give each line to ``hear`` until it says True; its fault is raised here."""
        if self._protocol.exited.is_set():
            raise chess.engine.EngineTerminatedError
        heard: asyncio.Future[None] = asyncio.get_running_loop().create_future()

        def on_line(line: str) -> None:
            try:
                if not heard.done() and hear(line):
                    heard.set_result(None)
            except EngineError as fault:
                heard.set_exception(fault)

        def on_exit() -> None:
            if not heard.done():
                heard.set_exception(chess.engine.EngineTerminatedError())

        self._protocol.on_line, self._protocol.on_exit = on_line, on_exit
        try:
            await heard
        finally:
            self._protocol.on_line = self._protocol.on_exit = None

    def _write(self, *lines: str) -> None:
        stdin = self._transport.get_pipe_transport(0)
        if isinstance(stdin, asyncio.WriteTransport) and not stdin.is_closing():
            stdin.write("".join(f"{line}\n" for line in lines).encode())

    async def _hung_up(self) -> None:
        try:
            async with asyncio.timeout(self._patience.farewell):
                await self._protocol.hung_up.wait()
        except TimeoutError:
            return
