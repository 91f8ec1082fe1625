"""Players: engine, replay, person; and their pairings."""

import asyncio
from collections.abc import Mapping
from typing import Self

import chess
import pytest

from kempelen.core.errors import ConfigError, NotationError
from kempelen.core.protocols import EngineChoice, OnThinking, Thinking
from kempelen.game.modes import Mode, Pairing, TakeOver
from kempelen.game.pgn import parse_game
from kempelen.game.players import EnginePlayer, PersonPlayer, Propose, ReplayPlayer, Resign, ScoreEnds
from kempelen.game.records import PlayerSpec
from kempelen.testing.players import ScriptedPlayer

SCORE = parse_game('[White "Morphy"]\n[Black "Duke"]\n[Result "1-0"]\n\n1. e4 e5 2. Nf3 d6 1-0')
THOUGHTS: list[Thinking] = []


class OneMove:
    """An engine with one answer."""

    name = "One"

    def __init__(self, move: str, thinking: Thinking) -> None:
        self.choice = EngineChoice(chess.Move.from_uci(move), thinking)
        self.seconds: float | None = None

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *exc: object) -> None:
        del exc

    async def choose(
        self, board: chess.Board, *, seconds: float | None = None, on_thinking: OnThinking | None = None
    ) -> EngineChoice:
        assert self.choice.move in board.legal_moves
        self.seconds = seconds
        if on_thinking:
            on_thinking(self.choice.thinking)
        return self.choice


def after(*sans: str) -> chess.Board:
    board = chess.Board()
    for san in sans:
        board.push_san(san)
    return board


# --- engine -------------------------------------------------------------------------------------------------


async def test_an_engine_is_asked_with_its_time() -> None:
    engine = OneMove("e2e4", Thinking(depth=12, centipawns=30))
    player = EnginePlayer(engine, seconds=0.3, details={"level": 4})
    thoughts: list[Thinking] = []
    assert await player.propose(chess.Board(), thoughts.append) == Propose(chess.Move.from_uci("e2e4"))
    assert engine.seconds == 0.3
    assert thoughts == [Thinking(depth=12, centipawns=30)]
    assert player.spec == PlayerSpec(kind="engine", name="One", details={"level": 4})


@pytest.mark.parametrize(
    ("centipawns", "limit", "resigns"), [(-900, -800, True), (-900, None, False), (-700, -800, False)]
)
async def test_an_engine_resigns_only_where_it_may(centipawns: int, limit: int | None, resigns: bool) -> None:
    engine = OneMove("e2e4", Thinking(centipawns=centipawns))
    player = EnginePlayer(engine, resign_below=limit)
    assert isinstance(await player.propose(chess.Board(), THOUGHTS.append), Resign) is resigns


async def test_an_engine_that_sees_mate_does_not_count_centipawns() -> None:
    player = EnginePlayer(OneMove("e2e4", Thinking(mate=-3)), resign_below=-800)
    assert isinstance(await player.propose(chess.Board(), THOUGHTS.append), Propose)


@pytest.mark.parametrize(
    ("thinking", "move_number", "agrees"),
    [
        (Thinking(centipawns=10), 40, True),
        (Thinking(centipawns=-200), 40, True),
        (Thinking(centipawns=50), 40, False),
        (Thinking(centipawns=0), 10, False),
        (Thinking(mate=4), 40, False),
        (Thinking(mate=-4), 10, True),
        (Thinking(), 40, False),
    ],
)
async def test_when_an_engine_agrees_to_a_draw(thinking: Thinking, move_number: int, agrees: bool) -> None:
    player = EnginePlayer(OneMove("e2e4", thinking))
    board = chess.Board()
    board.fullmove_number = move_number
    assert not await player.answer_draw(board)  # it has not thought yet
    await player.propose(board, THOUGHTS.append)
    assert await player.answer_draw(board) is agrees


# --- replay -------------------------------------------------------------------------------------------------


async def test_a_replay_follows_the_score_for_both_sides() -> None:
    player = ReplayPlayer(SCORE, name="Morphy")
    assert await player.propose(after(), THOUGHTS.append) == Propose(chess.Move.from_uci("e2e4"))
    assert await player.propose(after("e4", "e5"), THOUGHTS.append) == Propose(chess.Move.from_uci("g1f3"))
    assert await player.propose(after("e4", "e5", "Nf3", "d6"), THOUGHTS.append) == ScoreEnds("1-0")
    assert not await player.answer_draw(after("e4"))


@pytest.mark.parametrize(
    "board", [after("d4"), after("e4", "e5", "Nc3"), chess.Board("4k3/8/8/8/8/8/8/4K3 w - - 0 1")]
)
async def test_a_replay_knows_when_it_is_lost(board: chess.Board) -> None:
    with pytest.raises(NotationError, match="left the score of 'Morphy'"):
        await ReplayPlayer(SCORE, name="Morphy").propose(board, THOUGHTS.append)


async def test_a_replay_comes_back_from_its_spec() -> None:
    spec = PlayerSpec.model_validate_json(ReplayPlayer(SCORE, name="Morphy").spec.model_dump_json())
    player = ReplayPlayer.from_spec(spec)
    assert player.spec == spec
    assert player.score.moves == SCORE.moves
    assert await player.propose(after("e4", "e5", "Nf3", "d6"), THOUGHTS.append) == ScoreEnds("1-0")


@pytest.mark.parametrize("details", [{}, {"moves": "e2e9", "start_fen": "", "result": "*"}])
def test_a_spec_that_is_no_replay(details: Mapping[str, str]) -> None:
    with pytest.raises(NotationError, match="cannot be set up again"):
        ReplayPlayer.from_spec(PlayerSpec(kind="replay", name="X", details=dict(details)))


# --- person -------------------------------------------------------------------------------------------------


async def test_a_person_is_told_at_once_what_is_wrong() -> None:
    person = PersonPlayer("Anna")
    with pytest.raises(NotationError, match="not Anna's turn, so 'e4'"):
        person.submit(" e4 ")
    asked = asyncio.ensure_future(person.propose(chess.Board(), THOUGHTS.append))
    await person.wanted.wait()
    with pytest.raises(NotationError, match="e5"):
        person.submit("exd5 e5")
    assert person.to_move
    assert person.submit("1.e4") == chess.Move.from_uci("e2e4")
    with pytest.raises(NotationError, match="turn"):
        person.submit("d4")
    assert await asked == Propose(chess.Move.from_uci("e2e4"))
    assert not person.wanted.is_set()


async def test_a_cancelled_question_leaves_no_move_behind() -> None:
    person = PersonPlayer()
    asked = asyncio.ensure_future(person.propose(chess.Board(), THOUGHTS.append))
    await person.wanted.wait()
    person.submit("e4")
    asked.cancel()
    await asyncio.gather(asked, return_exceptions=True)
    again = asyncio.ensure_future(person.propose(chess.Board(), THOUGHTS.append))
    await person.wanted.wait()
    person.submit("d4")
    assert await again == Propose(chess.Move.from_uci("d2d4"))


async def test_a_person_answers_draw_offers() -> None:
    person = PersonPlayer()
    with pytest.raises(NotationError, match="No draw"):
        person.answer(agree=True)
    for agree in (True, False):
        offer = asyncio.ensure_future(person.answer_draw(chess.Board()))
        await person.wanted.wait()
        assert person.offered_draw
        person.answer(agree=agree)
        with pytest.raises(NotationError, match="No draw"):
            person.answer(agree=agree)
        assert await offer is agree
        assert not person.wanted.is_set()


async def test_waiting_for_two_things_at_once() -> None:
    person = PersonPlayer()
    move = asyncio.ensure_future(person.propose(chess.Board(), THOUGHTS.append))
    offer = asyncio.ensure_future(person.answer_draw(chess.Board()))
    await asyncio.sleep(0)
    person.answer(agree=False)
    await offer
    assert person.wanted.is_set()
    person.submit("e4")
    await move
    assert not person.wanted.is_set()


# --- pairings -----------------------------------------------------------------------------------------------


def test_pairings() -> None:
    person, engine = PersonPlayer("Anna"), ScriptedPlayer((), name="Engine")
    white = Pairing.play(person, engine)
    black = Pairing.play(person, engine, person_plays=chess.BLACK)
    assert white[chess.WHITE] is person
    assert black[chess.BLACK] is person
    assert (white.people, black.people) == ((chess.WHITE,), (chess.BLACK,))
    assert Pairing.watch(engine, engine).people == ()
    assert white.spec.white.name == "Anna"
    assert white.claims_draws
    replay = Pairing.replay(SCORE)
    assert not replay.claims_draws
    assert (replay.mode, replay.spec.white.name, replay.spec.black.name) == (Mode.REPLAY, "Morphy", "Duke")


def test_take_over_counts_moves_as_score_sheets_do() -> None:
    pairing = Pairing.watch(ScriptedPlayer(()), ScriptedPlayer(()))
    assert TakeOver.at_move(1, pairing).ply == 0
    assert TakeOver.at_move(20, pairing).ply == 38
    assert TakeOver.at_move(20, pairing, colour=chess.BLACK).ply == 39
    assert TakeOver.at_move(20, pairing).spec.pairing == pairing.spec
    with pytest.raises(ConfigError, match="Move 0"):
        TakeOver.at_move(0, pairing)
