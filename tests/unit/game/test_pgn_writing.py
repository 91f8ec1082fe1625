import os
import stat
from pathlib import Path

import chess
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.errors import NotationError
from kempelen.game.pgn import GameScore, parse_game, read_game
from kempelen.game.pgn_write import format_pgn, write_pgn

MOVES = tuple(chess.Move.from_uci(uci) for uci in ("e2e4", "e7e5", "g1f3"))
SCORE = GameScore({"White": "Turk", "Termination": "normal"}, chess.STARTING_FEN, MOVES, "1-0")


def test_the_whole_text() -> None:
    assert format_pgn(SCORE, comment="Black resigns.") == (
        '[Event "?"]\n[Site "?"]\n[Date "????.??.??"]\n[Round "?"]\n[White "Turk"]\n[Black "?"]\n'
        '[Result "1-0"]\n'
        '[Termination "normal"]\n[PlyCount "3"]\n\n1. e4 e5 2. Nf3 { Black resigns. } 1-0\n\n'
    )


def test_another_start_has_its_fen() -> None:
    fen = "rnbqkbnr/pppppppp/8/8/4P3/8/PPPP1PPP/RNBQKBNR b KQkq - 0 1"
    text = format_pgn(GameScore({"FEN": "stale", "SetUp": "0"}, fen, (chess.Move.from_uci("c7c5"),)))
    assert f'[SetUp "1"]\n[FEN "{fen}"]' in text
    assert "1... c5 *" in text
    assert parse_game(text).start_fen == fen
    assert "SetUp" not in format_pgn(GameScore({"SetUp": "1", "FEN": fen}, chess.STARTING_FEN, ()))


def test_tags_are_escaped_and_stay_in_their_line() -> None:
    value = 'a "b" \\ c\nd\x00'
    text = format_pgn(GameScore({"Event": value}, chess.STARTING_FEN, MOVES))
    assert parse_game(text).headers["Event"] == 'a "b" \\ c d '
    with pytest.raises(NotationError, match="no name of a PGN tag"):
        format_pgn(GameScore({"bad tag": ""}, chess.STARTING_FEN, ()))


def test_a_comment_cannot_break_out() -> None:
    text = format_pgn(SCORE, comment="a } 2... Nc6\n{ b")
    assert parse_game(text).moves == MOVES


def test_lines_are_short() -> None:
    board = chess.Board()
    for uci in ("g1f3", "g8f6", "f3g1", "f6g8") * 30:
        board.push_uci(uci)
    text = format_pgn(GameScore({}, chess.STARTING_FEN, tuple(board.move_stack)))
    assert max(len(line) for line in text.splitlines()) < 80
    assert parse_game(text).moves == tuple(board.move_stack)


def test_a_file_is_replaced_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "new" / "game.pgn"
    write_pgn(path, SCORE)
    write_pgn(str(path), GameScore({}, chess.STARTING_FEN, MOVES[:1]))
    assert read_game(path).moves == MOVES[:1]
    assert list(path.parent.iterdir()) == [path]
    assert path.stat().st_mode & 0o777 == 0o644


def test_a_write_that_fails_keeps_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "game.pgn"
    write_pgn(path, SCORE)

    def fail(_: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", fail)
        with pytest.raises(NotationError, match=r"cannot be written to .*game\.pgn: No space left") as caught:
            write_pgn(path, GameScore({}, chess.STARTING_FEN, ()))
    assert caught.value.hint
    assert read_game(path).moves == MOVES
    assert list(tmp_path.iterdir()) == [path]


def test_everything_is_on_disk_before_the_name_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    events: list[str] = []
    sync, replace = os.fsync, Path.replace

    def note_sync(handle: int) -> None:
        events.append("directory" if stat.S_ISDIR(os.fstat(handle).st_mode) else "file")
        sync(handle)

    def note_replace(self: Path, target: Path) -> Path:
        events.append("rename")
        return replace(self, target)

    monkeypatch.setattr("os.fsync", note_sync)
    monkeypatch.setattr(Path, "replace", note_replace)
    write_pgn(tmp_path / "game.pgn", SCORE)
    assert events == ["file", "rename", "directory"]


def test_an_illegal_move_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(NotationError, match="illegal"):
        write_pgn(tmp_path / "game.pgn", GameScore({}, chess.STARTING_FEN, MOVES[1:]))
    assert not any(tmp_path.iterdir())


@given(st.randoms(use_true_random=False), st.integers(0, 60), st.sampled_from(["1-0", "0-1", "1/2-1/2", "*"]))
def test_what_is_written_is_read_back(dice: object, plies: int, result: str) -> None:
    board = chess.Board()
    for _ in range(plies):
        if not (legal := list(board.legal_moves)):
            break
        board.push(dice.choice(legal))  # type: ignore[attr-defined]
    score = GameScore({"Event": "random"}, chess.STARTING_FEN, tuple(board.move_stack), result)
    again = parse_game(format_pgn(score, comment="so it ended"))
    assert (again.moves, again.result, again.headers["Event"]) == (score.moves, result, "random")
