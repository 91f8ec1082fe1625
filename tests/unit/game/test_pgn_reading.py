import io
import tracemalloc
from pathlib import Path

import chess
import chess.pgn
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from kempelen.core.errors import NotationError
from kempelen.game.pgn import GameScore, list_games, parse_game, read_game
from kempelen.game.pgn_scan import PgnLimits

TWO = """[Event "First"]
[White "Adams"]
[Black "Torre"]
[Result "1-0"]

1. e4 e5 2. Qh5 Nc6 3. Bc4 Nf6 4. Qxf7# 1-0

[Event "Second"]
[Result "0-1"]

1. f3 e5 2. g4 Qh4# 0-1
"""


def ucis(score: GameScore) -> str:
    return " ".join(move.uci() for move in score.moves)


def sans(score: GameScore) -> list[str]:
    board = score.start_board()
    return [board.san_and_push(move) for move in score.moves]


def write(tmp_path: Path, text: str | bytes, name: str = "games.pgn") -> Path:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_a_game_is_read_whole(tmp_path: Path) -> None:
    score = read_game(write(tmp_path, TWO))
    assert score.headers == {"Event": "First", "White": "Adams", "Black": "Torre", "Result": "1-0"}
    assert ucis(score) == "e2e4 e7e5 d1h5 b8c6 f1c4 g8f6 h5f7"
    assert (score.result, score.index, score.line, score.start_fen) == ("1-0", 1, 1, chess.STARTING_FEN)
    assert score.final_board().is_checkmate()
    assert len(score.final_board().move_stack) == 7
    assert score.title == "Adams vs Torre, 1-0, First"


def test_the_second_game_by_its_number(tmp_path: Path) -> None:
    path = write(tmp_path, TWO)
    score = read_game(path, 2)
    assert (score.index, score.line, score.result) == (2, 8, "0-1")
    with pytest.raises(NotationError, match=r"has 2 games; there is no game 3.") as caught:
        read_game(path, 3)
    assert caught.value.hint == "Name one of 1..2."
    with pytest.raises(NotationError, match="there is no game 2"):
        read_game(write(tmp_path, "1. e4 *"), 2)
    with pytest.raises(NotationError, match="There is no game 0"):
        read_game(path, 0)


def test_games_are_listed(tmp_path: Path) -> None:
    first, second = list_games(write(tmp_path, TWO))
    assert (first.index, first.line, first.title) == (1, 1, "Adams vs Torre, 1-0, First")
    assert (second.index, second.line, second.headers["Event"]) == (2, 8, "Second")
    assert second.title == "? vs ?, 0-1, Second"


def test_a_title_cannot_steer_the_terminal() -> None:
    assert parse_game('[White "\x1b[31mTurk"]\n\n1. e4 *').title == "[31mTurk vs ?"


def test_regression_move_number_without_a_blank() -> None:
    assert ucis(parse_game("1.e4 e5 2.Nf3 2...Nc6 3. Bb5 a6 1/2-1/2")) == "e2e4 e7e5 g1f3 b8c6 f1b5 a7a6"
    assert ucis(parse_game("1.e4 e5\n2 Nf3 2... Nc6")) == "e2e4 e7e5 g1f3 b8c6"


def test_regression_capturing_promotion() -> None:
    tag = '[FEN "1n2k3/P7/8/8/8/8/8/4K3 w - - 0 1"]\n[SetUp "1"]\n\n'
    for text in ("1. axb8=Q+ *", "1. axb8Q *", "1. axb8(Q)+ *", "1.axb8=Q+ (1. a8(N) Kf7) 1-0"):
        score = parse_game(tag + text)
        assert ucis(score) == "a7b8q"
        assert score.start_fen == "1n2k3/P7/8/8/8/8/8/4K3 w - - 0 1"


def test_regression_annotation_glyphs() -> None:
    text = "1. e4 $1 e5 $2 $10 2. Nf3! Nc6?! 3. Bb5!! $139 a6 ?? 4. Ba4 += Nf6 +- 5. O-O! $ *"
    assert sans(parse_game(text)) == ["e4", "e5", "Nf3", "Nc6", "Bb5", "a6", "Ba4", "Nf6", "O-O"]


def test_regression_comments_of_several_words() -> None:
    text = """{ Before the
first move: 1. d4 } 1. e4 {best by test} e5{glued} 2. Nf3 ; to the end 2. Qh5
Nc6 {a ; in a comment ( and a paren [%clk 0:01:00]} 3. Bb5 { two
% lines
} a6
% an escaped line 4. Qxf7
{one}{two} 4. Ba4 *"""
    assert sans(parse_game(text)) == ["e4", "e5", "Nf3", "Nc6", "Bb5", "a6", "Ba4"]


def test_nested_variations_are_passed_over() -> None:
    text = "1. e4 (1. d4 d5 (1... Nf6 2. c4 {deep (} (2. Nf3)) 2. c4) 1... e5 (1... c5 1-0) 2. Nf3 *"
    assert sans(parse_game(text)) == ["e4", "e5", "Nf3"]


@pytest.mark.parametrize("newline", ["\r\n", "\n", "\r"])
@pytest.mark.parametrize("prefix", [b"", b"\xef\xbb\xbf"])
def test_line_ends_and_byte_order_mark(tmp_path: Path, newline: str, prefix: bytes) -> None:
    path = write(tmp_path, prefix + TWO.replace("\n", newline).encode())
    assert [heading.line for heading in list_games(path)] == [1, 8]
    assert ucis(read_game(path, 2)) == "f2f3 e7e5 g2g4 d8h4"


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    path = write(tmp_path, '[White "Hübner"]\n\n1. e4 {Schön gespielt} *\n'.encode(encoding))
    assert read_game(path).headers["White"] == "Hübner"
    assert next(list_games(path)).headers["White"] == "Hübner"


def test_tags_as_they_are_found_in_the_wild() -> None:
    text = (
        '; a comment\n%escaped\n[Event "A \\"quoted\\" name and a \\\\"] [Site ""]\n'
        '[White "The "Turk""]\n[ Black  "x" ]\n\n1. e4 *\x1a'
    )
    assert parse_game(text).headers == {
        "Event": 'A "quoted" name and a \\',
        "Site": "",
        "White": 'The "Turk"',
        "Black": "x",
    }


def test_games_without_tags_or_blank_lines_between(tmp_path: Path) -> None:
    text = "1. e4 e5 1-0\n1. d4 d5\n\n1. c4 c5 *\n{after} ; and\n% after\n\n\n1. b3 *"
    path = write(tmp_path, text)
    assert [heading.line for heading in list_games(path)] == [1, 2, 4, 9]
    assert [ucis(read_game(path, n)) for n in (1, 2, 3, 4)] == ["e2e4 e7e5", "d2d4 d7d5", "c2c4 c7c5", "b2b3"]


def test_a_blank_line_within_a_game_does_not_end_it() -> None:
    assert sans(parse_game("1. e4 e5\n\n2. Nf3 Nc6 *")) == ["e4", "e5", "Nf3", "Nc6"]
    assert sans(parse_game("1. e4 (1. d4\n\n1... d5) e5 *")) == ["e4", "e5"]


def test_tags_without_moves_are_a_game_of_their_own(tmp_path: Path) -> None:
    path = write(tmp_path, '[Event "a"]\n\n[Event "b"]\n\n1-0\n\n[Event "c"]\n\n1. e4 *')
    assert [heading.headers["Event"] for heading in list_games(path)] == ["a", "b", "c"]
    assert read_game(path, 2).moves == ()
    with pytest.raises(NotationError, match="neither moves nor a result"):
        read_game(path, 1)


def test_a_comment_may_quote_a_tag() -> None:
    text = '1. e4 {\n[White "quoted"]\n[%eval 0.3]} e5 *'
    assert sans(parse_game(text)) == ["e4", "e5"]


def test_numeric_games_are_read() -> None:
    assert sans(parse_game("1. 5254 5755 2. 7163 2836 *")) == ["e4", "e5", "Nf3", "Nc6"]


def test_a_black_start() -> None:
    fen = "rnbqkbnr/pppppppp/8/8/4P3/8/PPPP1PPP/RNBQKBNR b KQkq - 0 1"
    assert sans(parse_game(f'[FEN "{fen}"]\n\n1... c5 2. Nf3 *')) == ["c5", "Nf3"]
    assert parse_game(f'[FEN "{fen}"]\n[SetUp "0"]\n\n1. c4 *').start_fen == chess.STARTING_FEN


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("\n \r\n\x1a", "is empty"),
        ("Dear Sir, I resign.", "is not a PGN file: line 1 has 'Dear'"),
        ("{intro}\n\nlorem ipsum", "is not a PGN file: line 3 has 'lorem'"),
        ("<html><body>", "is not a PGN file"),
        (
            "1. e4 e5 2. Ke3 *",
            "game 1, line 1: move 2. 'Ke3' is illegal for White on move 2: a king does not go",
        ),
        ("1. e4 e5\n2. Nf3 Nf3 *", "line 2: move 2... 'Nf3' is illegal for Black"),
        ("1. e5 *", "line 1: move 1. 'e5' is illegal"),
        ("1. e4 e5 2. N", "cannot be read as a move. The text ends here; it may be cut off."),
        ("1. e4 blunder *", "move 1... 'blunder' cannot be read"),
        ("1. e4 -- 2. d4 *", "null move"),
        ("1. e4 e5 {and then", "line 1: the comment that begins here is never closed"),
        ("1. e4 (1. d4\nd5", "line 1: the variation that begins here is never closed"),
        ("1. e4) e5", "closes a variation that was never opened"),
        ("1. e4 1-0 e5", "'e5' follows the result 1-0"),
        ('[Result "1-0"]\n\n1. e4 e5\n2. Qh5', "line 4: the moves end after move 2 without a result"),
        ('[Result "0-1"]\n\n1. e4 e5', "the moves end after move 1 without a result, but the tag says 0-1"),
        ('[Result "0-1"]\n\n', "the moves end after move 0 without a result"),
        ('[Event "a"]\n', "neither moves nor a result"),
        ('[Event "a"]\n[White "Mor', "line 2: this tag cannot be read"),
        ('[Event "a"]\n[White Morphy]\n\n1. e4 *', "line 2: this tag cannot be read"),
        ('[Variant "Crazyhouse"]\n\n1. e4 *', "the game is 'Crazyhouse'"),
        ('[FEN "nonsense"]\n\n1. e4 *', "cannot be read as FEN"),
        ('[FEN "8/8/8/8/8/8/8/8 w - - 0 1"]\n\n1. e4 *', "the board is empty"),
    ],
)
def test_a_faulty_text_is_refused_with_the_place(text: str, message: str) -> None:
    with pytest.raises(NotationError) as caught:
        parse_game(text)
    assert message in caught.value.message
    assert caught.value.hint


def test_a_fault_names_its_game_and_line_in_the_file(tmp_path: Path) -> None:
    path = write(tmp_path, TWO.replace("2. g4", "2. g9"))
    assert read_game(path, 1).result == "1-0"
    with pytest.raises(NotationError, match=r"games\.pgn, game 2, line 11: move 2\. 'g9'"):
        read_game(path, 2)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"\x1f\x8b\x08\x00rest", "is a gzip archive"),
        (b"PK\x03\x04rest", "is a zip archive"),
        ("1. e4".encode("utf-16"), "written in UTF-16"),
        (b"\x7fELF\x02\x01\x01\x00", "is a binary file"),
        (b"\x00" * 5000, "is a binary file"),
    ],
)
def test_what_is_no_text_is_refused(tmp_path: Path, data: bytes, message: str) -> None:
    path = write(tmp_path, data)
    for read in (lambda: read_game(path), lambda: list(list_games(path))):
        with pytest.raises(NotationError, match=message) as caught:
            read()
        assert caught.value.hint


def test_files_that_cannot_be_opened(tmp_path: Path) -> None:
    plain = write(tmp_path, "1. e4 *")
    for path, message in (
        (tmp_path / "missing.pgn", "There is no file"),
        (tmp_path, "is a directory"),
        (plain / "below", "cannot be read: Not a directory"),
    ):
        with pytest.raises(NotationError, match=message):
            read_game(path)
    with pytest.raises(NotationError, match="is empty"):
        list(list_games(write(tmp_path, "", "empty.pgn")))


@pytest.mark.parametrize(
    ("text", "limits", "message"),
    [
        ("1. e4 e5 2. Nf3 *", PgnLimits(plies=2), "more than 2 plies"),
        (
            "{" + "x" * 200 + "\n}1. e4 *",
            PgnLimits(game_bytes=100),
            "game 1 .line 1. is too big: it has more than",
        ),
        ("x" * 200, PgnLimits(line_bytes=100), "one line is longer than"),
        ("1. e4 *\n" * 50, PgnLimits(file_bytes=100), "was not found in the first"),
    ],
)
def test_what_is_too_big_is_refused(text: str, limits: PgnLimits, message: str) -> None:
    with pytest.raises(NotationError, match=message) as caught:
        parse_game(text, 40 if limits.file_bytes == 100 else 1, limits=limits)
    assert caught.value.hint


def test_a_list_is_bounded(tmp_path: Path) -> None:
    path = write(tmp_path, "1. e4 *\n" * 5)
    with pytest.raises(NotationError, match="more than 3 games"):
        list(list_games(path, limits=PgnLimits(games=3)))


def test_the_third_of_a_hundred_megabytes_costs_three_games(tmp_path: Path) -> None:
    path = tmp_path / "huge.pgn"
    with path.open("wb") as stream:
        stream.write(TWO.encode() * 2)
        stream.truncate(100_000_000)  # sparse: what is never read is never written either
    tracemalloc.start()
    try:
        assert read_game(path, 3).headers["Event"] == "First"
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 2_000_000


def test_a_single_endless_game_is_refused_in_bounded_memory() -> None:
    class Endless(io.RawIOBase):
        def readable(self) -> bool:
            return True

        def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
            line = b"1. e4 {still going on} e5 (1... c5)\n"
            data = (line * (len(buffer) // len(line) + 1))[: len(buffer)]
            buffer[:] = data
            return len(data)

    from kempelen.game.pgn_scan import raw_games  # noqa: PLC0415 - the only test below the reader

    limits = PgnLimits(game_bytes=500_000)
    with pytest.raises(NotationError, match=r"more than 0\.47\d* MB"):
        next(raw_games(io.BufferedReader(Endless()), where="endless", wanted=lambda _: True, limits=limits))


def test_the_same_moves_as_python_chess_reads() -> None:
    text = (
        TWO
        + '\n[FEN "r3k2r/8/8/8/8/8/8/R3K2R w KQkq - 0 1"]\n\n1. O-O-O {x} (1. O-O O-O-O) O-O 2. Rh8+! $5 *\n'
    )
    stream = io.StringIO(text)
    for number in (1, 2, 3):
        game = chess.pgn.read_game(stream)
        assert game is not None
        assert tuple(game.mainline_moves()) == parse_game(text, number).moves


@given(
    st.text(alphabet='[]{}();%$ \n"\\KQRNBabcdefgh12345678xO-=+#.*/!?0', max_size=120)
    | st.lists(st.sampled_from(TWO.split(" ")), max_size=30).map(" ".join)
)
@example("1-0\n[")
@example('{\n\n[Event "x"')
def test_any_text_is_read_or_refused_in_our_words(text: str) -> None:
    try:
        score = parse_game(text)
    except NotationError as error:
        fault = error
    else:
        score.final_board()
        return
    assert fault.hint


def test_a_comment_never_closed_does_not_swallow_the_next_game(tmp_path: Path) -> None:
    path = write(tmp_path, '[Event "a"]\n\n1. e4 {oops e5 *\n\n[Event "b"]\n\n1. d4 *')
    assert [heading.headers["Event"] for heading in list_games(path)] == ["a", "b"]
    with pytest.raises(NotationError, match="line 3: the comment"):
        read_game(path, 1)
    assert ucis(read_game(path, 2)) == "d2d4"
