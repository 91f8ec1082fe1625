"""Where things are kept in the data directory."""

from datetime import datetime
from pathlib import Path

from kempelen.game.journal import FILE_NAME, JournalReader


def journal_path(directory: Path) -> Path:
    """The journal's file."""
    return directory / FILE_NAME


def pgn_path(directory: Path, game: int) -> Path:
    """Where a game's PGN is written after every move."""
    return directory / "games" / f"game-{game}.pgn"


def twin_state_path(directory: Path, game: int) -> Path:
    """Where the twin's table of an unfinished game is kept while no process runs it."""
    return directory / "twin" / f"game-{game}.json"


def recording_path(directory: Path, when: datetime) -> Path:
    """Where a recording that begins now is written to."""
    return directory / "recordings" / f"{when:%Y-%m-%d-%H%M%S}"


def newest_unfinished(directory: Path) -> int:
    """Number of the newest game that can be gone on with.

    Raises:
        JournalError: There is none.
    """
    with JournalReader(journal_path(directory)) as journal:
        return journal.latest(unfinished=True)
