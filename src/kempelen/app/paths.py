"""Where things are kept in the data directory."""

from pathlib import Path

from kempelen.game.journal import FILE_NAME


def journal_path(directory: Path) -> Path:
    """The journal's file."""
    return directory / FILE_NAME


def pgn_path(directory: Path, game: int) -> Path:
    """Where a game's PGN is written after every move."""
    return directory / "games" / f"game-{game}.pgn"


def twin_state_path(directory: Path, game: int) -> Path:
    """Where the twin's table of an unfinished game is kept while no process runs it."""
    return directory / "twin" / f"game-{game}.json"
