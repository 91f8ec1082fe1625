"""`kempelen node`: what is refused before anything is opened, and keys."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from kempelen.cli.node import node
from kempelen.core.errors import ConfigError, LinkError


def run(*words: str) -> str:
    done = CliRunner().invoke(node, list(words), catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


def test_keys_are_made_and_listed(tmp_path: Path) -> None:
    said = run("keys", "pi-3", "--role", "robot", "--data-dir", str(tmp_path))
    assert "Keys of pi-3, which offers a robot" in said
    assert str(tmp_path / "keys" / "pi-3") in said.replace("\n", "")
    listed = run("keys", "--show", "--data-dir", str(tmp_path))
    assert "pi-3" in listed
    assert "good" in listed


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("keys", "--show"), "There are no keys"),
        (("keys", "--role", "king"), "no role 'king'"),
        (("robot", "--table", "Hall 3"), "no name for a table"),
        (("robot", "--port", "node:one"), "is itself at another node"),
        (("engine", "--name", "../x"), "no name for a table"),
        (("engine", "--engine", "node:x"), "is itself at another node"),
        (("board", "--port", "node:one"), "is itself at another node"),
        (("camera", "--camera", "node:one"), "is itself at another node"),
        (("arbiter", "--table", "x", "--engine", "node:y", "--level", "5"), "plays at the level of its node"),
    ],
)
def test_what_cannot_be_is_refused(
    words: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KEMPELEN_DATA_DIR", str(tmp_path))
    with pytest.raises(ConfigError, match=message):
        CliRunner().invoke(node, list(words), catch_exceptions=False)


def test_keys_that_are_not_there_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEMPELEN_DATA_DIR", str(tmp_path))
    with pytest.raises((ConfigError, LinkError), match=r"node\.pem cannot be read"):
        CliRunner().invoke(node, ["view", "--keys", str(tmp_path / "none")], catch_exceptions=False)
