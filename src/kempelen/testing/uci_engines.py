"""A small engine that misbehaves on demand, in UCI or in the protocol of xboard.

Run as a program it speaks on stdin and stdout; `write_engine` makes an executable of it with its
arguments built in. It needs python-chess only for moves of its own.
"""

import argparse
import contextlib
import random
import shlex
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

_FOREVER = 3600.0
_SQUARES = 4  # characters of a move without promotion
_SILENTLY = frozenset(
    {"xboard", "accepted", "rejected", "level", "time", "otim", "sd", "st", "post", "easy"}
    | {"memory", "cores", "option", "?", "quit"}
)


def write_engine(directory: Path, *arguments: str, name: str = "engine") -> Path:
    """Write an executable that runs this fake with ``arguments``, and return its path."""
    path = directory / name
    command = shlex.join([sys.executable, __file__, *arguments])
    path.write_text(f"#!/bin/sh\nexec {command}\n")
    path.chmod(0o755)
    return path


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


class FakeEngine:
    """Answers line by line in UCI; on ``go`` it does what its arguments say."""

    none = "bestmove (none)"

    def __init__(self, arguments: argparse.Namespace) -> None:
        self._arguments = arguments
        self._position = "startpos"
        self._lines = 1
        self._goes = 0
        self._dice = random.Random(arguments.seed)  # noqa: S311 - repeatable play, no secret
        self._deeds: dict[str, Callable[[], None]] = {
            "die": self._die,
            "hang": self._hang,
            "none": lambda: _say(self.none),
            "null": lambda: self._answer("0000"),
            "illegal": lambda: self._answer("e2e5"),
            "nonsense": lambda: self._answer("castles"),
            "resign": lambda: _say("resign"),
            "draw": self._offer_draw,
            "garbage": self._print_garbage,
            "flood": self._flood,
        }

    def run(self) -> None:
        """Serve until ``quit`` or the end of the input."""
        for line in self._heard():
            word, _, rest = line.partition(" ")
            if word == "quit" and self._arguments.on_go != "hang":
                return
            self._obey(word, rest)

    def _heard(self) -> Iterator[str]:
        for line in sys.stdin:
            if self._arguments.log:
                with Path(self._arguments.log).open("a") as log:
                    log.write(line)
            yield line.strip()

    def _obey(self, word: str, rest: str) -> None:
        if word == "uci":
            self._introduce()
        elif word == "isready":
            _say("readyok")
        elif word == "setoption" and rest.startswith("name MultiPV value "):
            self._lines = int(rest.rpartition(" ")[2])
        elif word == "position":
            self._position = rest
        elif word == "go":
            self._go()

    def _introduce(self) -> None:
        _say("id name Fake 1.0")
        _say("option name Threads type spin default 1 min 1 max 8")
        _say("option name Hash type spin default 16 min 1 max 1024")
        _say("option name Style type combo default calm var calm var wild")
        if self._arguments.multipv:
            _say("option name MultiPV type spin default 1 min 1 max 64")
        _say("uciok")

    def _go(self) -> None:
        self._goes += 1
        if self._goes == self._arguments.nth and self._is_first_life():
            self._deeds.get(self._arguments.on_go, self._play)()
        else:
            self._play()

    def _is_first_life(self) -> bool:
        """Whether to misbehave: with ``--once FILE`` only before that file exists."""
        if not self._arguments.once:
            return True
        with contextlib.suppress(FileExistsError):
            Path(self._arguments.once).touch(exist_ok=False)
            return True
        return False

    def _play(self) -> None:
        legal = self._shuffled()
        for rank, candidate in enumerate(legal[: self._lines], start=1):
            self._think(rank, candidate)
        self._answer(legal[0])

    def _shuffled(self) -> list[str]:
        import chess  # noqa: PLC0415 - a fake that only misbehaves should start at once

        start, _, moves = self._position.partition("moves")
        board = chess.Board() if "startpos" in start else chess.Board(start.removeprefix("fen ").strip())
        for move in moves.split():
            board.push_uci(move)
        legal = self._dice.sample(list(board.legal_moves), board.legal_moves.count())
        return [move.uci() for move in legal]

    def _think(self, rank: int, move: str) -> None:
        _say(f"info depth 1 multipv {rank} score cp {100 - 50 * rank} nodes 1 pv {move}")

    def _answer(self, move: str) -> None:
        _say(f"bestmove {move}")

    def _offer_draw(self) -> None:
        _say("offer draw")
        self._play()

    def _die(self) -> None:
        sys.stderr.write("\x1b[31mout of matter\x1b[0m\n")
        sys.stderr.flush()
        sys.exit(3)

    def _hang(self) -> None:
        if self._arguments.child:
            subprocess.Popen([sys.executable, "-c", f"import time; time.sleep({_FOREVER})"])
        time.sleep(_FOREVER)

    def _print_garbage(self) -> None:
        sys.stdout.buffer.write(
            b"\xff\xfe\x00 not text\ninfo depth x score cp pv\ninfo string pv e2e4\nreadyok?\n"
        )
        _say("info depth 3 score cp 12 pv e2e4 e7e5 e1e8")
        _say("3 12 0 0 e2e4 e7e5 e1e8")
        self._play()

    def _flood(self) -> None:
        for _ in range(40):
            sys.stdout.write("x" * (1 << 16))
        _say("")
        self._play()


class FakeXBoard(FakeEngine):
    """The same in the protocol of xboard, version 2; with ``--old`` version 1."""

    none = "1/2-1/2 {I am tired}"
    _answers = _ponders = False

    def _obey(self, word: str, rest: str) -> None:
        if word == "protover" and not self._arguments.old:
            _say('feature done=0 myname="Fake 1.0" usermove=1 setboard=1 ping=1 memory=1 smp=1')
            _say('feature option="Style -combo *calm /// wild" option="Odds -spin 3 0 9" done=1')
        elif word == "ping":
            _say(f"pong {rest}")
        elif word in {"new", "setboard"}:
            self._position = f"fen {rest} moves" if rest else "startpos moves"
        elif word == "usermove" or (self._arguments.old and len(word) == _SQUARES and word[1].isdigit()):
            self._position += f" {rest or word}"
            if self._answers and self._ponders:
                self._go()
        else:
            self._turn(word)

    def _turn(self, word: str) -> None:
        if word == "hard":
            self._ponders = True
        elif word in {"go", "force"}:
            self._answers = word == "go"
            if self._answers:
                self._go()
        elif word not in _SILENTLY:
            _say(f"Error (unknown command): {word}")

    def _think(self, rank: int, move: str) -> None:
        _say(f"1 {100 - 50 * rank} 0 1 {move}")

    def _answer(self, move: str) -> None:
        _say(f"1. ... {move}" if self._arguments.old else f"move {move}")
        self._position += f" {move}"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument("--on-go", default="play", help="what to do on the n-th go")
    parser.add_argument("--nth", type=int, default=1, help="which go")
    parser.add_argument("--once", default="", help="misbehave only while this file is absent, and make it")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--multipv", action="store_true", help="offer MultiPV")
    parser.add_argument("--log", default="", help="append what is heard to this file")
    parser.add_argument(
        "--child", action="store_true", help="leave a child behind that holds the output open"
    )
    parser.add_argument("--start", default="", help="'die', or seconds before the first word")
    parser.add_argument("--protocol", default="uci", help="uci, xboard, or none: answers with errors alone")
    parser.add_argument("--old", action="store_true", help="version 1 of xboard's protocol")
    return parser.parse_args()


def main() -> None:
    """Run the fake as a program."""
    arguments = _arguments()
    if arguments.start == "die":
        sys.exit("cannot find my opening book")
    if arguments.start:
        time.sleep(float(arguments.start))
    if arguments.protocol == "none":
        for line in sys.stdin:
            _say(f"Error (unknown command): {line.strip()}")
        return
    (FakeXBoard if arguments.protocol == "xboard" else FakeEngine)(arguments).run()


if __name__ == "__main__":
    main()
