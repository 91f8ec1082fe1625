"""The `kempelen` command, run inside of the test."""

import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from kempelen.cli.main import main
from kempelen.core.table import Table
from kempelen.game.journal import Journal
from kempelen.game.modes import Pairing
from kempelen.game.opening import new_game
from kempelen.game.players import PersonPlayer
from kempelen.game.records import Ended
from kempelen.testing.uci_engines import write_engine


@dataclass(frozen=True)
class Told:
    """What a command left behind."""

    code: int
    out: str
    err: str

    @property
    def all(self) -> str:
        return self.out + self.err


Command = Callable[..., Told]


@pytest.fixture
def kempelen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Iterator[Command]:
    """Run a command with an empty home and an empty input; every file of it is in ``tmp_path``."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("KEMPELEN_DATA_DIR", str(tmp_path / "data"))
    monkeypatch.setenv("COLUMNS", "100")

    def run(*arguments: object, typed: str = "") -> Told:
        source = tmp_path / "typed"
        source.write_text(typed, encoding="utf-8")
        monkeypatch.setattr(sys, "argv", ["kempelen", *map(str, arguments)])
        with source.open(encoding="utf-8") as stdin, monkeypatch.context() as patched:
            patched.setattr(sys, "stdin", stdin)
            code = _exit_code()
        return Told(code, *capfd.readouterr())

    yield run
    sys.stdout.flush()


def _exit_code() -> int:
    try:
        main()
    except SystemExit as end:
        return int(end.code or 0)
    return 0


@pytest.fixture
def engine(tmp_path: Path) -> Path:
    """An engine that starts at once and plays anything."""
    return write_engine(tmp_path, name="quick-engine")


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """The data directory of the command."""
    directory = tmp_path / "data"
    assert os.environ.get("KEMPELEN_DATA_DIR", str(directory))
    return directory


@pytest.fixture
def finished(tmp_path: Path) -> Path:
    """A data directory with one game that is over."""
    directory = tmp_path / "finished"
    table = Table()
    with Journal(directory / "journal.sqlite3") as journal:
        pairing = Pairing.play(PersonPlayer("Ada"), PersonPlayer("Bob"))
        log = new_game(journal, pairing, table)
        log.write(Ended(result="1-0", reason="Black resigns"))
    return directory
