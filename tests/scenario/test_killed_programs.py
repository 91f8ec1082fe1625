"""``kill -9`` at any instant, resumed each time: board, journal and game agree in the end."""

import json
from pathlib import Path

import pytest

from kempelen.testing.scenarios import Kill, KilledGame, Program, play_killed, seeded_kills

SPECIAL = Path(__file__).with_name("special.pgn")
FINAL_FEN = "6k1/5ppp/8/8/2nr4/8/P4PPP/R4RK1 w - - 0 7"
REPLAY = ("replay", str(SPECIAL))
FAST = ("--speed", "max")
POINTS = 20
SOAK_POINTS = 200
SCATTER_MM = 3.0  # how far off centre people stand pieces


def assert_agrees(game: KilledGame, interventions: int = 0, standing_mm: float = 2.0) -> None:
    """The game is the one of the file, and what physics has on the table is what the journal says."""
    assert game.state is not None
    assert game.state.ended is not None
    assert game.state.board.fen() == FINAL_FEN
    assert game.state.helps == interventions
    assert game.wrong == []
    if game.report:  # the last program, too, may be killed when the game is over
        placement = game.report["placement"]
        assert game.report["interventions"] == interventions
        assert game.report["final_fen"] == FINAL_FEN
        assert game.report["standing_max_mm"] <= standing_mm
        assert placement["toppled"] == 0
        assert placement["max_mm"] <= 2.0
        assert placement["neighbour_max_mm"] <= 1.0


def games_killed(folder: Path, seed: int, points: int) -> list[KilledGame]:
    """Game after game, until the program has been killed so often."""
    kills, games = seeded_kills(seed), list[KilledGame]()
    while (left := points - sum(game.kills for game in games)) > 0:
        data = folder / f"data-{len(games)}"
        data.mkdir()
        games.append(play_killed(data, REPLAY, kills, *FAST, "--seed", str(len(games)), most=left))
        assert_agrees(games[-1])
    return games


@pytest.mark.physics
def test_killed_at_twenty_points_and_resumed(tmp_path: Path) -> None:
    games = games_killed(tmp_path, seed=1, points=POINTS)
    assert sum(game.kills for game in games) == POINTS
    assert sum(game.held for game in games) >= POINTS // 6, "too few died with a piece held"


@pytest.mark.soak
@pytest.mark.physics
def test_killed_at_two_hundred_points_and_resumed(tmp_path: Path) -> None:
    games = games_killed(tmp_path, seed=2, points=SOAK_POINTS)
    assert sum(game.kills for game in games) == SOAK_POINTS
    assert sum(game.held for game in games) >= SOAK_POINTS // 6
    print(f"{len(games)} games, {SOAK_POINTS} kills, {sum(game.held for game in games)} with a piece held")  # noqa: T201


def test_killed_while_the_last_one_is_still_being_put_away(tmp_path: Path) -> None:
    """Deaths in quick succession: twins that wait for the table are orphaned before they get it."""
    quick = [Kill("carrying", 3, 0.0), *(Kill("", 0, delay) for delay in (1.2, 0.2, 1.6, 1.4, 2.0, 0.6, 1.8))]
    assert_agrees(play_killed(tmp_path, REPLAY, iter(quick), *FAST))


def test_killed_together_with_its_twin(tmp_path: Path) -> None:
    """The table died with its process: somebody sets it up again from the journal, and the report says so."""
    kills = [
        Kill("carrying", 2, 0.0, twin_too=True),
        Kill("stands on", 3, 0.0),
        Kill("carrying", 3, 0.01, twin_too=True),
    ]
    game = play_killed(tmp_path, REPLAY, iter(kills), *FAST)
    assert_agrees(game, interventions=2, standing_mm=SCATTER_MM)
    assert "the virtual person has set up another one" in game.output[1]
    assert "the virtual person has set up another one" not in game.output[2]


def test_killed_with_its_twin_before_any_piece_was_touched(tmp_path: Path) -> None:
    """Laying the table a second time for a game that has not begun is no help to anybody."""
    report = tmp_path / "report.json"
    options = ("--data-dir", str(tmp_path), *FAST, "--report", str(report))
    with Program("play", "--level", "1", *options, typing=True) as program:
        assert Kill("Your move, White.", 1, 0.0, twin_too=True).strike(program)
    with Program("resume", "1", *options, typing=True) as program:
        assert program.until("Your move, White."), program.errors
        program.type("resign")
        assert program.wait() == 0, program.errors
    assert json.loads(report.read_text())["interventions"] == 0


def test_killed_when_the_game_is_over_but_not_put_away(tmp_path: Path) -> None:
    """The table is as the journal says although no report was written; there is nothing to go on with."""
    game = play_killed(tmp_path, REPLAY, iter([Kill("Game over", 1, 0.0)]), *FAST)
    assert_agrees(game)
    with Program("resume", "1", "--data-dir", str(tmp_path)) as program:
        assert program.wait() not in {0, -9}
        assert "Game 1 is over" in program.errors


@pytest.mark.parametrize(
    "delay", [0.03, *(pytest.param(one, marks=pytest.mark.soak) for one in (0.0, 0.1, 0.2))]
)
def test_killed_while_a_person_makes_a_move_by_hand(tmp_path: Path, delay: float) -> None:
    """A capture of two steps; the person finishes what was begun, and does nothing twice."""
    report = tmp_path / "report.json"
    options = ("--data-dir", str(tmp_path), *FAST, "--report", str(report))
    fen = "4k3/8/8/3p4/4P3/8/8/4K3 w - - 0 1"
    begin = ("play", "--hands", "person", "--fen", fen, "--level", "1", "--move-time", "0.05")
    with Program(*begin, *options, typing=True) as program:
        program.type("exd5")
        assert Kill("exd5 by hand", 1, delay).strike(program)
    with Program("resume", "1", *options, typing=True) as program:
        assert program.until("Your move, White."), program.errors
        program.type("resign")
        assert program.wait() == 0, program.errors
    written = json.loads(report.read_text(encoding="utf-8"))
    assert written["final_fen"].split()[0].count("P") == 1
    assert written["plies"] == 2
    assert written["disagreements"] == []
    assert written["interventions"] == 0
