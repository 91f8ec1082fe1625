"""What can be asked of the arbiter while a game runs."""

import asyncio
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import chess
import pytest
from tests.unit.game.arbiter_bench import FOOLS_MATE, TABLE, Bench, play, replay, settle, watch

from kempelen.core import events
from kempelen.core.errors import FitError, GameError, LinkError, NotationError, StoppedError
from kempelen.core.places import Layout, Transfer
from kempelen.core.protocols import Checkpoint, OnCheckpoint, TransferReport
from kempelen.core.table import DEFAULT_TRAYS, Table
from kempelen.game.arbiter import Arbiter
from kempelen.game.journal import Journal
from kempelen.game.modes import Mode, TakeOver
from kempelen.game.records import Interrupted
from kempelen.game.records import Paused as PausedRecord
from kempelen.testing.hands import FakeHand


@pytest.fixture
def journal(tmp_path: Path) -> Iterator[Journal]:
    with Journal(tmp_path) as journal:
        yield journal


# --- pause --------------------------------------------------------------------------------------------------


async def test_pause_acts_in_mid_transfer_with_the_piece_held(journal: Journal) -> None:
    bench = Bench(journal, watch(FOOLS_MATE))
    async with bench.playing() as game:
        await bench.until("down", "f3")
        await bench.arbiter.pause()
        assert bench.arbiter.paused
        assert bench.seen[-2] == events.Paused(in_transfer=True)
        bench.go()
        await settle()
        assert bench.world.held == chess.Piece.from_symbol("P")
        await bench.arbiter.pause()  # once more changes nothing
        assert sum(isinstance(record, PausedRecord) for _, record in journal.records(1)) == 1
        await bench.arbiter.resume()
        assert await game == events.GameOver("0-1", "checkmate")
    assert bench.world.layout == bench.log.state.layout


async def test_a_pause_between_groups_holds_the_next_one_back(journal: Journal) -> None:
    bench = Bench(journal, watch(FOOLS_MATE))
    pauses: list[asyncio.Task[None]] = []

    def pause_when_carrying(event: events.Event) -> None:
        if isinstance(event, events.CheckpointReached) and event.checkpoint == "carrying" and not pauses:
            pauses.append(asyncio.ensure_future(bench.arbiter.pause()))

    bench.arbiter.events.listen(pause_when_carrying)
    async with bench.playing() as game:
        await bench.see(events.Paused)
        await settle()
        assert bench.world.held == chess.Piece.from_symbol("P")
        await asyncio.gather(*pauses)
        await bench.arbiter.resume()
        await game


async def test_finish_move_completes_all_transfers_and_stays_paused(journal: Journal) -> None:
    castle = "4k3/8/8/8/8/8/8/4K2R w K - 0 1"
    bench = Bench(journal, watch(["O-O", "Kd7"]), fen=castle)
    async with bench.playing() as game:
        await bench.until("down", "g1")
        await bench.arbiter.pause()
        bench.go()
        await bench.arbiter.finish_move()
        assert bench.sans == ["O-O"]
        assert bench.seen[-2] == events.Paused(in_transfer=False)
        assert bench.hand.parked == 1
        await settle()
        assert bench.sans == ["O-O"]
        assert bench.arbiter.paused
        await bench.arbiter.finish_move()  # nothing in hand
        await bench.arbiter.resume()
        await bench.arbiter.resume()
        await game
    assert bench.sans == ["O-O", "Kd7"]


async def test_a_pause_cuts_into_the_finishing_of_a_move(journal: Journal) -> None:
    castle = "4k3/8/8/8/8/8/8/4K2R w K - 0 1"
    bench = Bench(journal, watch(["O-O"]), fen=castle)
    async with bench.playing() as game:
        await bench.until("down", "g1")
        await bench.arbiter.pause()
        finishing = asyncio.ensure_future(bench.arbiter.finish_move())
        await settle()
        bench.go()
        await bench.until("down", "f1")
        await bench.arbiter.pause()
        with pytest.raises(GameError, match="not completed"):
            await finishing
        bench.go()
        await bench.arbiter.resume()
        await game
    assert bench.sans == ["O-O"]


async def test_finish_move_needs_a_pause(journal: Journal) -> None:
    person, pairing = play()
    bench = Bench(journal, pairing)
    async with bench.playing():
        await person.wanted.wait()
        with pytest.raises(GameError, match="not paused"):
            await bench.arbiter.finish_move()


async def test_a_move_typed_in_a_pause_waits(journal: Journal) -> None:
    person, pairing = play(["", "e5"])
    bench = Bench(journal, pairing)
    async with bench.playing():
        await person.wanted.wait()
        await bench.arbiter.pause()
        person.submit("e4")
        await settle()
        assert bench.sans == []
        await bench.arbiter.resume()
        await bench.see(events.MoveCommitted, 2)
        assert bench.sans == ["e4", "e5"]


# --- other modes --------------------------------------------------------------------------------------------


async def test_a_replay_is_taken_over_at_a_move(journal: Journal) -> None:
    person, pairing = play(["e4", "e5", "Nf3", "Nc6", "Bb5", "a6"])
    score = replay("1. e4 e5 2. Nf3 Nc6 3. Bc4 Bc5", "1-0")
    bench = Bench(journal, score, take_over=TakeOver.at_move(3, pairing))
    async with bench.playing():
        await person.wanted.wait()
        assert bench.sans == ["e4", "e5", "Nf3", "Nc6"]
        person.submit("Bb5")
        await bench.see(events.MoveCommitted, 6)
        await bench.arbiter.resign(chess.WHITE)
    assert bench.of(events.ModeSwapped) == [events.ModeSwapped("play", "Anna", "Engine")]
    assert bench.log.state.take_over is None
    assert bench.log.state.names == (("W", "Anna"), ("B", "Engine"))


async def test_modes_are_swapped_while_a_player_thinks(journal: Journal) -> None:
    person, pairing = play(["e4", "e5"])
    bench = Bench(journal, pairing)
    async with bench.playing() as game:
        await person.wanted.wait()
        await bench.arbiter.swap_mode(watch(FOOLS_MATE))
        assert await game == events.GameOver("0-1", "checkmate")
    assert bench.arbiter.pairing.mode is Mode.WATCH
    assert not person.wanted.is_set()


async def test_a_move_proposed_by_the_replaced_player_is_not_played(journal: Journal) -> None:
    person, pairing = play(["e4", "e5"])
    bench = Bench(journal, pairing)
    async with bench.playing() as game:
        await person.wanted.wait()
        await bench.arbiter.pause()
        person.submit("h4")
        await bench.arbiter.swap_mode(watch(FOOLS_MATE))
        await bench.arbiter.resume()
        await game
    assert bench.sans == list(FOOLS_MATE)


async def test_a_replay_cannot_go_on_after_other_moves(journal: Journal) -> None:
    person, pairing = play(["", "e5"])
    bench = Bench(journal, pairing)
    async with bench.playing() as game:
        await person.wanted.wait()
        person.submit("d4")
        await bench.see(events.MoveCommitted, 2)
        await bench.arbiter.swap_mode(replay("1. e4 e5", "*"))
        with pytest.raises(NotationError, match="has left the score"):
            await game


async def test_the_mode_swapped_before_an_exit_is_kept(journal: Journal) -> None:
    person, pairing = play()
    bench = Bench(journal, pairing)
    async with bench.playing():
        await person.wanted.wait()
    swapped = watch(FOOLS_MATE)
    again = Arbiter(journal.reopen(1), FakeHand(bench.world), swapped, TABLE, person=bench.person)
    await again.run()
    assert again.state.pairing == swapped.spec
    assert again.state.names == (("Anna", "A"), ("Engine", "B"))


# --- takeback -----------------------------------------------------------------------------------------------


async def test_a_takeback_is_undone_on_the_table(journal: Journal) -> None:
    person, pairing = play(["", "d5", "", "Qxd5"])
    bench = Bench(journal, pairing)
    async with bench.playing():
        for text, count in (("e4", 2), ("exd5", 4)):
            await person.wanted.wait()
            person.submit(text)
            await bench.see(events.MoveCommitted, count)
        await bench.arbiter.takeback()
        board = chess.Board()
        board.push_san("e4")
        board.push_san("d5")
        assert bench.log.state.board.fen() == board.fen()
        assert bench.world.layout.board_part() == board.piece_map()
        await bench.arbiter.takeback(2)
        assert bench.world.layout.board_part() == chess.Board().piece_map()
        with pytest.raises(GameError, match="0 have been played"):
            await bench.arbiter.takeback(1)
        assert [event.san for event in bench.of(events.MoveTakenBack)] == ["Qxd5", "exd5", "d5", "e4"]  # type: ignore[union-attr]


async def test_a_takeback_waits_for_the_end_of_a_pause(journal: Journal) -> None:
    person, pairing = play(["", "e5"])
    bench = Bench(journal, pairing)
    async with bench.playing():
        await person.wanted.wait()
        person.submit("e4")
        await bench.see(events.MoveCommitted, 2)
        await person.wanted.wait()
        await bench.arbiter.pause()
        taking_back = asyncio.ensure_future(bench.arbiter.takeback())
        await settle()
        assert bench.log.state.plies == 2
        await bench.arbiter.resume()
        await taking_back
        assert bench.log.state.plies == 0


async def test_takeback_while_the_engine_thinks_undoes_the_persons_move(journal: Journal) -> None:
    person, pairing = play()
    slow, _ = play()
    pairing = replace(pairing, black=slow)
    bench = Bench(journal, replace(pairing, black=slow))
    slow.spec = slow.spec.model_copy(update={"kind": "engine"})
    async with bench.playing():
        await person.wanted.wait()
        person.submit("e4")
        await slow.wanted.wait()
        await bench.arbiter.takeback()
        assert bench.log.state.plies == 0
        await person.wanted.wait()


# --- draws and resignation ----------------------------------------------------------------------------------


async def test_a_draw_by_agreement(journal: Journal) -> None:
    person, pairing = play(agrees=True)
    bench = Bench(journal, pairing)
    async with bench.playing() as game:
        await person.wanted.wait()
        assert await bench.arbiter.offer_draw(chess.WHITE)
        assert await game == events.GameOver("1/2-1/2", "draw agreed")
    assert bench.of(events.DrawOffered) == [events.DrawOffered(chess.WHITE)]


async def test_a_draw_declined(journal: Journal) -> None:
    person, pairing = play()
    bench = Bench(journal, pairing)
    async with bench.playing():
        await person.wanted.wait()
        assert not await bench.arbiter.offer_draw(chess.WHITE)
        assert bench.of(events.DrawDeclined) == [events.DrawDeclined(chess.WHITE)]


async def test_a_person_is_asked_and_a_move_declines(journal: Journal) -> None:
    person, pairing = play(["", "e5"])
    bench = Bench(journal, pairing)
    async with bench.playing() as game:
        await person.wanted.wait()
        offer = asyncio.ensure_future(bench.arbiter.offer_draw(chess.BLACK))
        await bench.see(events.DrawOffered)
        await settle()
        with pytest.raises(GameError, match="on offer already"):
            await bench.arbiter.offer_draw(chess.BLACK)
        person.submit("e4")
        assert not await offer
        await bench.see(events.MoveCommitted, 2)
        offer = asyncio.ensure_future(bench.arbiter.offer_draw(chess.BLACK))
        await settle()
        person.answer(agree=True)
        assert await offer
        assert await game == events.GameOver("1/2-1/2", "draw agreed")


async def test_an_offer_ends_with_the_game(journal: Journal) -> None:
    person, pairing = play()
    bench = Bench(journal, pairing)
    async with bench.playing() as game:
        await person.wanted.wait()
        offer = asyncio.ensure_future(bench.arbiter.offer_draw(chess.BLACK))
        await bench.see(events.DrawOffered)
        await bench.arbiter.resign(chess.BLACK)
        await game
        assert not await offer


async def test_resignation_in_mid_move_lets_the_move_finish(journal: Journal) -> None:
    bench = Bench(journal, watch(FOOLS_MATE))
    async with bench.playing() as game:
        await bench.until("down", "f3")
        resigning = asyncio.ensure_future(bench.arbiter.resign(chess.BLACK))
        bench.go()
        assert await game == events.GameOver("1-0", "Black resigns")
        await resigning
    assert bench.sans == ["f3"]
    assert bench.world.layout == bench.log.state.layout


async def test_resignation_in_a_pause_ends_the_game_at_once(journal: Journal) -> None:
    person, pairing = play()
    bench = Bench(journal, pairing)
    async with bench.playing() as game:
        await person.wanted.wait()
        await bench.arbiter.pause()
        await bench.arbiter.resign(chess.WHITE)
        assert await game == events.GameOver("0-1", "White resigns")


async def test_an_order_that_comes_too_late_is_refused(journal: Journal) -> None:
    person, pairing = play()
    bench = Bench(journal, pairing)
    async with bench.playing() as game:
        await person.wanted.wait()
        await bench.arbiter.pause()
        taking_back = asyncio.ensure_future(bench.arbiter.takeback(1))
        await asyncio.sleep(0)
        await bench.arbiter.resign(chess.WHITE)
        await game
        with pytest.raises(GameError, match="before this could be done"):
            await taking_back


# --- stopping and trouble -----------------------------------------------------------------------------------


async def test_stop_ends_the_run_at_once(journal: Journal) -> None:
    bench = Bench(journal, watch(FOOLS_MATE))
    async with bench.playing() as game:
        await bench.until("down", "f3")
        stopping = asyncio.ensure_future(bench.arbiter.stop())
        bench.go()
        with pytest.raises(StoppedError) as caught:
            await game
        await stopping
    assert "kempelen resume 1" in caught.value.hint or "Home" in caught.value.hint
    assert bench.log.state.pending is not None
    assert any(isinstance(record, Interrupted) for _, record in journal.records(1))


async def test_stop_while_a_person_thinks(journal: Journal) -> None:
    person, pairing = play()
    bench = Bench(journal, pairing)
    async with bench.playing() as game:
        await person.wanted.wait()
        await bench.arbiter.stop()
        with pytest.raises(StoppedError, match="stopped") as caught:
            await game
    assert "kempelen resume 1" in caught.value.hint


async def test_cancelling_leaves_the_robot_at_rest_and_the_game_resumable(journal: Journal) -> None:
    bench = Bench(journal, watch(FOOLS_MATE))
    async with bench.playing() as game:
        await bench.until("down", "f3")
        game.cancel()
        with pytest.raises(asyncio.CancelledError):
            await game
    assert not bench.world.sent
    assert bench.world.held is not None
    again = Arbiter(journal.reopen(1), FakeHand(bench.world), watch(FOOLS_MATE), TABLE, person=bench.person)
    assert (await again.run()).reason == "checkmate"
    assert again.state.layout == bench.world.layout


class Unplugged(FakeHand):
    """Its cable comes off in the middle of the third transfer."""

    async def carry(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> TransferReport:
        async def reached(at: Checkpoint) -> None:
            await checkpoint(at)
            if len(self.carried) == 2 and at is Checkpoint.CARRYING:
                raise LinkError("The line was lost.", hint="Plug it in again.")

        return await super().carry(transfer, standing, reached)


async def test_a_lost_line_ends_the_run_and_nothing_is_lost(journal: Journal) -> None:
    bench = Bench(journal, watch(FOOLS_MATE))
    arbiter = Arbiter(bench.log, Unplugged(bench.world), watch(FOOLS_MATE), TABLE, person=bench.person)
    with pytest.raises(LinkError, match="lost"):
        await arbiter.run()
    assert bench.world.held == chess.Piece.from_symbol("P")
    again = Arbiter(journal.reopen(1), FakeHand(bench.world), watch(FOOLS_MATE), TABLE, person=bench.person)
    assert (await again.run()).reason == "checkmate"
    assert again.state.layout == bench.world.layout


async def test_a_failing_takeback_tells_both_sides(journal: Journal) -> None:
    person, pairing = play(["", "e5"])
    bench = Bench(journal, pairing)
    async with bench.playing() as game:
        await person.wanted.wait()
        person.submit("e4")
        await bench.see(events.MoveCommitted, 2)
        await person.wanted.wait()
        bench.hand._stopped = True
        with pytest.raises(StoppedError):
            await bench.arbiter.takeback()
        with pytest.raises(StoppedError):
            await game


# --- a table measured again ---------------------------------------------------------------------------------


async def test_the_table_may_change_in_a_pause(journal: Journal) -> None:
    person, pairing = play(["", "e5"])
    bench = Bench(journal, pairing)
    moved = Table(square=49.5)
    async with bench.playing():
        await person.wanted.wait()
        await bench.arbiter.pause()
        hand = FakeHand(bench.world)
        await hand.prepare()
        await bench.arbiter.change_table(moved, "new digest", hand)
        with pytest.raises(FitError):
            await bench.arbiter.change_table(Table(trays=DEFAULT_TRAYS[:1]), "too small")
        await bench.arbiter.resume()
        person.submit("e4")
        await bench.see(events.MoveCommitted, 2)
        assert bench.log.state.table == "new digest"
        assert len(hand.carried) == 2
        assert bench.hand.carried == []


async def test_the_table_may_not_change_in_mid_move(journal: Journal) -> None:
    bench = Bench(journal, watch(FOOLS_MATE))
    async with bench.playing():
        await bench.until("down", "f3")
        await bench.arbiter.pause()
        with pytest.raises(GameError, match="in hand"):
            await bench.arbiter.change_table(TABLE, "x")
        bench.go()
