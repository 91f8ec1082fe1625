import chess
import pytest

from kempelen.core.protocols import Thinking
from kempelen.engines import xboard_lines as lines

BLACK = chess.Board("r3k2r/pppq1ppp/2n5/4p3/8/8/PPPP1PpP/RNBQK2R b KQkq - 0 1")


@pytest.mark.parametrize(
    ("line", "uci"),
    [
        ("move e5e4", "e5e4"),
        ("move e5-e4", "e5e4"),
        ("1. ... e5e4", "e5e4"),
        ("12... Nd4", "c6d4"),
        ("My move is : Nc6-d4", "c6d4"),
        ("White (1) : My move is: o-o", "e8g8"),
        ("move O-O-O", "e8c8"),
        ("move 0-0+", "e8g8"),
        ("move gxh1=Q", "g2h1q"),
        ("move g2g1n", "g2g1n"),
        ("move g2g1N", "g2g1n"),
        ("move g2g1", "g2g1q"),
        ("move Qd7xd2+", "d7d2"),
    ],
)
def test_moves_in_their_accents(line: str, uci: str) -> None:
    text = lines.move_text(lines.without_prompt(line))
    assert text is not None
    assert lines.parse_move(text, BLACK) == chess.Move.from_uci(uci)


@pytest.mark.parametrize("line", ["1. e2e4", "move", "moves to go 5", "4 12 0 5 e2e4", "Hint: e2e4", ""])
def test_other_lines_name_no_move(line: str) -> None:
    assert lines.move_text(line) is None


@pytest.mark.parametrize("text", ["e5e3", "castles", "0000", "@@@@", "", "??"])
def test_what_is_no_legal_move(text: str) -> None:
    assert lines.parse_move(text, BLACK) is None


def test_features_in_quotes_and_without() -> None:
    line = 'feature myname="A \'quoted\' name" ping=1 option="Odds -spin 1 0 9" option="Go -button" rest'
    assert lines.parse_features(line) == {
        "myname": ["A 'quoted' name"],
        "ping": ["1"],
        "option": ["Odds -spin 1 0 9", "Go -button"],
    }
    assert lines.parse_features('feature myname="open') == {"myname": ['"open']}
    assert lines.parse_features("features ping=1") == {}


@pytest.mark.parametrize(
    ("text", "kind", "usual"),
    [
        ("Odds -spin 1 0 9", "spin", 1),
        ("Odds -slider 1 0 9", "spin", 1),
        ("Resign -check 1", "check", True),
        ("Style -combo calm /// *wild", "combo", "wild"),
        ("Book file -file /a b/c", "file", "/a b/c"),
    ],
)
def test_options(text: str, kind: str, usual: object) -> None:
    option = lines.parse_option(text)
    assert option is not None
    assert (option.name, option.type, option.default) == (text.partition(" -")[0], kind, usual)


@pytest.mark.parametrize("text", ["Odds -spin a b c", "Odds -spin 1", "Odds", "Go -button", ""])
def test_damaged_options_are_left_out(text: str) -> None:
    assert lines.parse_option(text) is None


@pytest.mark.parametrize(
    ("line", "result", "resigned"),
    [
        ("resign", "", True),
        ("0-1 {White resigns}", "0-1", True),
        ("1-0 {Black mates}", "1-0", False),
        ("result 1/2-1/2 {Draw}", "1/2-1/2", False),
    ],
)
def test_verdicts(line: str, result: str, resigned: bool) -> None:
    assert lines.verdict(line) == lines.Verdict(result, resigned)


def test_other_lines_are_no_verdict() -> None:
    assert lines.verdict("resigning is for others") is None
    assert lines.verdict("10 1-0 0 1") is None


def test_refusals_name_what_was_refused() -> None:
    assert lines.refused("Illegal move: e2e5") == "e2e5"
    assert lines.refused("Illegal move (pinned): d1e2") == "d1e2"
    assert lines.refused("Error (unknown command): sd") == "sd"
    assert lines.refused("move e2e4") is None


def test_thoughts_of_several_engines() -> None:
    start = chess.Board()
    e4, e5 = chess.Move.from_uci("e2e4"), chess.Move.from_uci("e7e5")
    told = {
        "5 +17 2 33650 1. e4 e5 2. Ke8": Thinking(5, 17, None, (e4, e5), 33650),
        "5. -17 2 10 e2-e4 e7-e5 (book)": Thinking(5, -17, None, (e4, e5), 10),
        " 4       9     0     1231  e4 !": Thinking(4, 9, None, (e4,), 1231),
        "9 100003 0 5 e4": Thinking(9, None, 3, (e4,), 5),
        "9 -100002 0 5": Thinking(9, None, -2, (), 5),
        "9 999998 0 5": Thinking(9, 999998, None, (), 5),
    }
    for line, thinking in told.items():
        assert lines.parse_thinking(line, start) == thinking
    assert lines.parse_thinking("stat01: 5 6 7", start) is None


def test_a_position_is_edited() -> None:
    board = chess.Board("8/P6k/8/8/8/8/7p/K7 b - - 0 1")
    told = lines.edit_lines(board)
    assert told is not None
    assert told[:3] == ["a2a3", "edit", "#"]
    assert set(told[3:5]) == {"Pa7", "Ka1"}
    assert told[5] == "c"
    assert set(told[6:8]) == {"Kh7", "Ph2"}
    assert told[8:] == ["."]
    assert lines.edit_lines(chess.Board()) is not None


@pytest.mark.parametrize("fen", ["r3k2r/8/8/8/8/8/8/R3K2R w KQk - 0 1", "4k3/8/8/3pP3/8/8/8/4K3 w - d6 0 1"])
def test_what_cannot_be_edited(fen: str) -> None:
    assert lines.edit_lines(chess.Board(fen)) is None
