"""The arbiter with a board sensor: moves count only once they are seen, and people may move the pieces."""

import asyncio
from collections.abc import Callable, Iterator
from pathlib import Path

import chess
import pytest
from tests.unit.game.arbiter_bench import Bench, settle, watch

from kempelen.core import events
from kempelen.core.places import Place
from kempelen.game import mover
from kempelen.game.board_person import BoardPerson
from kempelen.game.journal import Journal
from kempelen.game.modes import Pairing
from kempelen.game.options import ArbiterOptions
from kempelen.game.players import Propose, TakenBack
from kempelen.testing.hands import Step
from kempelen.testing.players import ScriptedPlayer

CAPTURE = "4k3/8/8/3p4/4P3/8/8/4K3 w - - 0 1"
PROMOTION = "3r2k1/4P3/8/8/8/8/8/4K3 w - - 0 1"


@pytest.fixture
def journal(tmp_path: Path) -> Iterator[Journal]:
    with Journal(tmp_path / "journal.sqlite3") as journal:
        yield journal


async def test_each_move_of_the_robot_is_seen_before_it_counts(journal: Journal) -> None:
    bench = Bench(journal, watch(["O-O"]), fen="4k3/8/8/8/8/8/8/4K2R w K - 0 1", eyes=True)
    await bench.arbiter.run()
    assert bench.eyes is not None
    assert bench.eyes.looked == [(), ("K e1-g1", "R h1-f1")], "the set-up, then both at once"
    assert bench.hand.parked == 1


async def test_a_square_is_seen_empty_before_a_piece_is_put_on_it(journal: Journal) -> None:
    """Without parking: the hand is at the tray by then."""
    bench = Bench(journal, watch(["exd8=Q+"]), fen=PROMOTION, eyes=True)
    await bench.arbiter.run()
    assert bench.eyes is not None
    assert [len(look) for look in bench.eyes.looked] == [0, 2, 3]
    assert bench.hand.parked == 1


async def test_the_hand_goes_aside_where_no_look_past_it_is_sure(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mover, "_GLANCE_S", 0.01)
    bench = Bench(journal, watch(["exd5"]), fen=CAPTURE, eyes=True)
    assert bench.eyes is not None
    bench.eyes.dazzled = True
    await bench.arbiter.run()
    assert bench.hand.parked == 2
    assert bench.world.layout == bench.log.state.layout


async def test_a_missed_grip_is_tried_again_by_the_robot(journal: Journal) -> None:
    bench = Bench(journal, watch(["e4"]), eyes=True)
    bench.world.slips = {Place("e2")}
    await bench.arbiter.run()
    assert [str(t) for t in bench.hand.carried] == ["P e2-e4", "P e2-e4"]
    assert bench.person.requests == []
    assert bench.log.state.helps == 0
    assert bench.world.layout == bench.log.state.layout


async def test_a_captured_piece_that_was_missed_is_never_hit(journal: Journal) -> None:
    bench = Bench(journal, watch(["exd5"]), fen=CAPTURE, eyes=True)
    bench.world.slips = {Place("d5")}
    await bench.arbiter.run()
    assert [str(t) for t in bench.hand.carried] == ["p d5-right1"] * 2 + ["P e4-d5"]
    assert bench.world.layout == bench.log.state.layout


async def test_the_first_half_of_castling_missed(journal: Journal) -> None:
    bench = Bench(journal, watch(["O-O"]), fen="4k3/8/8/8/8/8/8/4K2R w K - 0 1", eyes=True)
    bench.world.slips = {Place("e1")}
    await bench.arbiter.run()
    assert [str(t) for t in bench.hand.carried] == ["K e1-g1", "R h1-f1", "K e1-g1"]
    assert bench.world.layout == bench.log.state.layout


def twice_from(bench: Bench, place: str) -> None:
    """The grip misses its piece two times running."""

    async def again(step: Step) -> None:
        await asyncio.sleep(0)
        if step == ("down", Place(place)):
            bench.world.slips.add(Place(place))

    bench.world.before_step = again


async def test_what_the_robot_cannot_put_right_a_person_does(journal: Journal) -> None:
    bench = Bench(journal, watch(["e4"]), eyes=True)
    twice_from(bench, "e2")
    bench.person.tidied = lambda: bench.log.state.layout
    await bench.arbiter.run()
    assert bench.person.requests == ["Put e2, e4 right."]
    names = [type(event).__name__ for event in bench.seen]
    assert names.index("OperatorAnswered") < names.index("MoveCommitted")
    assert bench.world.layout == bench.log.state.layout


async def test_the_game_goes_on_when_it_is_seen_to_be_right(journal: Journal) -> None:
    """Nobody has to press a key; and that somebody helped is written down."""
    bench = Bench(journal, watch(["e4"]), eyes=True)
    twice_from(bench, "e2")
    async with bench.playing() as game:
        await bench.see(events.OperatorAsked)
        bench.world.standing = dict(bench.log.state.layout)
        await game
    assert bench.sans == ["e4"]
    assert bench.log.state.helps == 1


async def test_eyes_that_are_switched_off_are_not_asked(journal: Journal) -> None:
    bench = Bench(journal, watch(["e4"]), eyes=True)
    assert bench.eyes is not None
    bench.eyes.looks = False
    await bench.arbiter.run()
    assert bench.eyes.looked == []


async def test_the_robot_does_not_set_out_while_a_hand_is_over_the_board(journal: Journal) -> None:
    bench = Bench(journal, watch(["e4"]), eyes=True)
    assert bench.eyes is not None
    bench.eyes.hands_off.clear()
    async with bench.playing() as game:
        await bench.see(events.MoveProposed)
        await settle()
        assert bench.of(events.TransferStarted) == []
        bench.eyes.hands_off.set()
        await game
    assert bench.sans == ["e4"]


@pytest.mark.parametrize("done", ["nothing was missed", "missed"])
async def test_killed_while_it_looks(journal: Journal, done: str) -> None:
    """All pieces were let go of, nothing was committed: the next program looks again."""
    bench = Bench(journal, watch(["e4"]), eyes=True)
    if done == "missed":
        bench.world.slips = {Place("e2")}
    async with bench.playing():
        await bench.until("up")
        bench.go()
        await bench.see(events.TransferDone)
        await bench.until("up")  # to park
    again = Bench(journal, watch(["e4"]), eyes=True, resume=bench)
    await again.arbiter.run()
    assert again.arbiter.state.layout == again.world.layout
    assert len(again.arbiter.state.board.move_stack) == 1
    assert len(again.hand.carried) == (done == "missed")


# --- people who move the pieces ---


class Script:
    """Reads what a test says that it reads."""

    def __init__(self) -> None:
        self.on = True
        self.candidates: tuple[chess.Move, ...] = ()
        self.stuck = asyncio.Event()
        self.seen: asyncio.Queue[Propose | TakenBack] = asyncio.Queue()

    async def read(self, board: chess.Board) -> Propose | TakenBack:
        self.board = board
        return await self.seen.get()

    def ask(self, *moves: str) -> None:
        self.candidates = tuple(map(self.board.parse_san, moves))
        self.stuck.set()


def made(uci: str) -> Propose:
    return Propose(chess.Move.from_uci(uci), made=True)


def at_the_board(
    journal: Journal, *replies: str, fen: str = chess.STARTING_FEN, hands: str = "person"
) -> tuple[Bench, Script, BoardPerson]:
    reader = Script()
    person = BoardPerson(reader, "Anna")
    pairing = Pairing.play(person, ScriptedPlayer(["", *replies], name="Engine"))
    options = ArbiterOptions(hands="person" if hands == "person" else "robot")
    return Bench(journal, pairing, fen=fen, options=options, eyes=True), reader, person


def by_hand(bench: Bench, *moves: str) -> None:
    """Somebody moves pieces: "e2e4", or "d5-" for one that is taken off."""
    for move in moves:
        piece = bench.world.standing.pop(Place(move[:2]))
        bench.world.standing[Place(move[2:].lstrip("-") or "right5")] = piece


async def test_a_move_made_on_the_board_is_not_made_again(journal: Journal) -> None:
    bench, reader, person = at_the_board(journal, "d5")
    async with bench.playing():
        await person.wanted.wait()
        by_hand(bench, "e2e4")
        reader.seen.put_nowait(made("e2e4"))
        await bench.see(events.MoveCommitted, 2)
        assert [str(t) for t in bench.hand.carried] == ["p d7-d5"]
        by_hand(bench, "d5-", "e4d5")
        reader.seen.put_nowait(made("e4d5"))
        await bench.see(events.MoveCommitted, 3)
    assert bench.person.requests == []
    assert bench.world.layout == bench.log.state.layout
    assert bench.log.state.helps == 0
    assert person.answered == 0


async def test_a_person_brings_his_own_queen(journal: Journal) -> None:
    """A piece that the trays do not hold is nothing to ask for when it stands on the board already."""
    fen = "4k3/P7/8/8/8/8/8/QQ2K3 w - - 0 1"
    bench, reader, person = at_the_board(journal, fen=fen)
    async with bench.playing():
        await person.wanted.wait()
        del bench.world.standing[Place("a7")]
        bench.world.standing[Place("a8")] = chess.Piece.from_symbol("Q")
        bench.world.disturbed = True  # where the pawn was laid nobody knows
        reader.seen.put_nowait(made("a7a8q"))
        await bench.see(events.MoveCommitted)
    assert bench.person.requests == []
    assert bench.of(events.OperatorAsked) == []
    assert bench.log.state.layout[Place("a8")] == chess.Piece.from_symbol("Q")


async def test_moves_taken_back_on_the_board(journal: Journal) -> None:
    bench, reader, person = at_the_board(journal, "e5")
    async with bench.playing():
        await person.wanted.wait()
        by_hand(bench, "e2e4")
        reader.seen.put_nowait(made("e2e4"))
        await bench.see(events.MoveCommitted, 2)
        await person.wanted.wait()
        by_hand(bench, "e5e7", "e4e2")
        reader.seen.put_nowait(TakenBack(2))
        await bench.see(events.MoveTakenBack, 2)
        await bench.see(events.TurnBegan, 4)
    assert bench.log.state.board.move_stack == []
    assert bench.world.layout == bench.log.state.layout
    assert [str(t) for t in bench.hand.carried] == ["p e7-e5"]
    assert bench.person.requests == []


async def test_killed_between_two_half_moves_taken_back_on_the_board(journal: Journal) -> None:
    bench, reader, person = at_the_board(journal, "e5")
    async with bench.playing():
        await person.wanted.wait()
        by_hand(bench, "e2e4")
        reader.seen.put_nowait(made("e2e4"))
        await bench.see(events.MoveCommitted, 2)
        by_hand(bench, "e5e7", "e4e2")
        reader.seen.put_nowait(TakenBack(2))
        await bench.see(events.MoveTakenBack)
    again = Bench(journal, watch(["d4"]), eyes=True, resume=bench)
    async with again.playing():
        await again.see(events.MoveTakenBack)
        await again.see(events.TurnBegan)
        assert again.hand.carried == []
    assert again.person.requests == []


@pytest.mark.parametrize("answer", ["e4", "e2e4", "E4"])
async def test_a_question_is_answered_by_writing(journal: Journal, answer: str) -> None:
    bench, reader, person = at_the_board(journal, "e5", hands="robot")
    async with bench.playing():
        await person.wanted.wait()
        await settle()
        by_hand(bench, "e2e4")
        reader.ask("e4", "e3")
        person.submit(answer)
        await bench.see(events.MoveCommitted, 2)
    assert [str(t) for t in bench.hand.carried] == ["p e7-e5"]
    assert person.answered == 1


@pytest.mark.parametrize(("answer", "kind"), [("knight", "N"), ("n", "N"), ("a queen", "Q")])
async def test_the_kind_of_a_promoted_piece_is_a_short_answer(
    journal: Journal, answer: str, kind: str
) -> None:
    bench, reader, person = at_the_board(journal, fen="8/4P2k/8/8/8/8/8/4K3 w - - 0 1")
    async with bench.playing():
        await person.wanted.wait()
        await settle()
        reader.ask("e8=Q", "e8=R", "e8=B", "e8=N")
        assert person.submit(answer) == reader.board.parse_san(f"e8={kind}")


async def test_a_written_move_is_carried_as_before(journal: Journal) -> None:
    bench, _, person = at_the_board(journal, "e5", hands="robot")
    async with bench.playing():
        await person.wanted.wait()
        person.submit("e4")
        await bench.see(events.MoveCommitted)
    assert [str(t) for t in bench.hand.carried][:1] == ["P e2-e4"]


async def test_a_written_move_by_hand_needs_no_key_once_it_is_seen(journal: Journal) -> None:
    bench, _, person = at_the_board(journal, "e5")
    async with bench.playing():
        await person.wanted.wait()
        person.submit("e4")
        await bench.see(events.MoveCommitted)
    assert bench.person.requests == ["carry P e2-e4"]


class Friend:
    """Makes written moves, and lets the test decide what is read of it."""

    def __init__(self, reader: Script) -> None:
        self.made: list[str] = []
        self._reader = reader
        self.then: Callable[[], None] = lambda: None

    async def __call__(self, board: chess.Board, move: chess.Move) -> None:
        await asyncio.sleep(0)
        self.made.append(board.san(move))
        self.then()


async def test_what_a_friend_makes_is_known_by_seeing_it_alone() -> None:
    reader = Script()
    friend = Friend(reader)
    person = BoardPerson(reader, maker=friend)
    friend.then = lambda: reader.seen.put_nowait(made("d2d4"))  # whatever was asked for
    asked = asyncio.ensure_future(person.propose(chess.Board(), lambda _: None))
    await person.wanted.wait()
    person.submit("e4")
    assert await asked == made("d2d4")
    assert friend.made == ["e4"]
    assert person.answered == 0


async def test_nothing_is_wanted_of_whoever_types_once_the_move_is_read() -> None:
    """Or the next line of a script would be taken for another move of the same turn."""
    reader = Script()
    friend = Friend(reader)
    person = BoardPerson(reader, maker=friend)
    friend.then = lambda: reader.seen.put_nowait(made("e2e4"))
    asked = asyncio.ensure_future(person.propose(chess.Board(), lambda _: None))
    await person.wanted.wait()
    person.submit("e4")
    wanted = asyncio.ensure_future(person.wanted.wait())
    await asked
    await settle()
    assert not wanted.done()
    wanted.cancel()
    await asyncio.gather(wanted, return_exceptions=True)


async def test_advice_on_a_move_half_made_wants_nothing_of_whoever_types() -> None:
    """Or the next line of a script would be taken for another move of the same turn."""
    reader = Script()
    friend = Friend(reader)
    person = BoardPerson(reader, maker=friend)
    friend.then = reader.stuck.set
    asked = asyncio.ensure_future(person.propose(chess.Board(), lambda _: None))
    await person.wanted.wait()
    person.submit("e4")
    await settle()
    assert friend.made == ["e4"]
    assert not person.to_move
    reader.seen.put_nowait(made("e2e4"))
    assert await asked == made("e2e4")


async def test_a_friend_answers_questions_about_his_own_move() -> None:
    reader = Script()
    friend = Friend(reader)
    person = BoardPerson(reader, maker=friend)
    friend.then = lambda: reader.ask("e3", "e4")
    asked = asyncio.ensure_future(person.propose(chess.Board(), lambda _: None))
    await person.wanted.wait()
    person.submit("e4")
    assert await asked == made("e2e4")
    assert person.answered == 1


async def test_eyes_switched_off_while_a_friends_move_is_waited_for() -> None:
    reader = Script()
    friend = Friend(reader)
    person = BoardPerson(reader, maker=friend)
    asked = asyncio.ensure_future(person.propose(chess.Board(), lambda _: None))
    await person.wanted.wait()
    person.submit("e4")
    await settle()
    reader.on = False
    reader.stuck.set()
    assert await asked == made("e2e4")


async def test_advice_lets_the_person_write_again() -> None:
    reader = Script()
    friend = Friend(reader)
    person = BoardPerson(reader, maker=friend)
    asked = asyncio.ensure_future(person.propose(chess.Board(), lambda _: None))
    await person.wanted.wait()
    person.submit("e4")
    await settle()
    assert not person.to_move
    reader.stuck.set()
    await person.wanted.wait()
    person.submit("e4")
    await settle()
    assert friend.made == ["e4", "e4"]
    asked.cancel()
    await asyncio.gather(asked, return_exceptions=True)
