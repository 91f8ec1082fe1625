"""The table while no process runs it, and who may have it next."""

import asyncio
import json
import select
import subprocess
import sys
from pathlib import Path

import chess
import pytest

from kempelen.core.errors import TwinError
from kempelen.core.places import Layout, Place
from kempelen.core.table import Table
from kempelen.twin.client import TwinProcess
from kempelen.twin.keeping import StateLock, forget_state, load_state, save_state
from kempelen.twin.machine import make_controller, make_scene
from kempelen.twin.physics.world import World
from kempelen.twin.spec import CONTROL_FOLDER, TwinSpec

TABLE = Table()
PAWN = Layout({Place("e4"): chess.Piece.from_symbol("P")})


def spec_in(folder: Path, *, resume: bool = False) -> TwinSpec:
    return TwinSpec.of(
        TABLE, PAWN, control=folder / "control", state=str(folder / "table.json"), resume=resume, speed=0
    )


def test_only_one_process_has_a_table(tmp_path: Path) -> None:
    state = tmp_path / "table.json"
    first = StateLock(state)
    with pytest.raises(TwinError, match="has ended"):
        StateLock(state, wanted=lambda: False)
    first.release()
    StateLock(state).release()


def test_who_is_not_wanted_any_more_gets_no_table_even_when_it_is_free(tmp_path: Path) -> None:
    with pytest.raises(TwinError, match="has ended"):
        StateLock(tmp_path / "table.json", wanted=lambda: False)
    StateLock(tmp_path / "table.json").release()


async def test_waiting_until_a_table_is_put_away(tmp_path: Path) -> None:
    state = tmp_path / "table.json"
    lock = StateLock(state)
    waiting = asyncio.ensure_future(StateLock.released(state))
    done, _ = await asyncio.wait({waiting}, timeout=0.05)
    assert not done
    lock.release()
    async with asyncio.timeout(5.0):
        await waiting


def test_what_is_kept_is_what_was(tmp_path: Path) -> None:
    state, spec = tmp_path / "table.json", spec_in(tmp_path)
    controller, world = make_controller(spec), World(make_scene(spec))
    world.place(world.pieces()[0].piece_id, 300.0, 200.0)
    save_state(state, controller, world)
    again = World(make_scene(spec))
    load_state(state, make_controller(spec), again)
    assert [(p.piece_id, p.x, p.y, p.z) for p in again.pieces()] == [
        (p.piece_id, p.x, p.y, p.z) for p in world.pieces()
    ]
    forget_state(state)
    assert not state.exists()
    forget_state(state)  # nothing to forget is nothing wrong


@pytest.mark.parametrize("text", ["", "{}", '{"version": 99}', '{"version": 1, "controller": 3}', "[1, 2]"])
def test_a_damaged_table_is_told_with_what_to_do(tmp_path: Path, text: str) -> None:
    state, spec = tmp_path / "table.json", spec_in(tmp_path)
    state.write_text(text)
    with pytest.raises(TwinError, match=r"table\.json") as caught:
        load_state(state, make_controller(spec), World(make_scene(spec)))
    assert str(state) in caught.value.hint


async def test_a_running_table_is_not_on_disk(tmp_path: Path) -> None:
    """So that nothing older can be taken for it when its process is killed."""
    state = tmp_path / "table.json"
    for resume in (False, True):
        async with TwinProcess(spec_in(tmp_path, resume=resume)) as twin:
            await twin.control.ask("truth")
            assert not state.exists()
        assert state.exists()


def test_an_orphan_that_comes_late_touches_nothing(tmp_path: Path) -> None:
    """Its parent died while it waited for the table; what it finds belongs to somebody else."""
    state = tmp_path / "table.json"
    folder = tmp_path / f"{CONTROL_FOLDER}x"
    folder.mkdir()
    lock = StateLock(state)
    spec = spec_in(tmp_path).model_copy(update={"control": str(folder / "control")})
    command = [sys.executable, "-m", "kempelen.twin"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as orphan:
        assert orphan.stdin is not None
        assert orphan.stdout is not None
        orphan.stdin.write(spec.model_dump_json().encode() + b"\n")
        orphan.stdin.flush()
        assert not select.select([orphan.stdout], [], [], 1.5)[0]  # it waits
        state.write_text("somebody else's")
        orphan.stdin.close()
        answer = json.loads(orphan.stdout.readline())
    lock.release()
    assert "has ended" in answer["error"]
    assert orphan.returncode == 1
    assert state.read_text() == "somebody else's"
    assert not folder.exists()


@pytest.mark.parametrize("line", [b"", b'{"robot_from'])
def test_a_parent_that_dies_before_it_has_said_what_it_wants(line: bytes) -> None:
    command = [sys.executable, "-m", "kempelen.twin"]
    ended = subprocess.run(command, input=line, capture_output=True, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (1, b"", b"")


def test_nonsense_is_answered() -> None:
    command = [sys.executable, "-m", "kempelen.twin"]
    ended = subprocess.run(command, input=b"{}\n", capture_output=True, check=False)
    assert ended.returncode == 1
    assert "robot_from_board" in json.loads(ended.stdout)["error"]
