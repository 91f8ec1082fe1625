"""Games on the reed board: a sloppy person's moves, named from the switches alone; faults of switches, named.

The board is the twin's (switches, wires, scan, bytes on the line), without physics: the person's hand opens
and closes switches directly. What reads is what plays: codec, reading, move reader. In three games of four
all switches work; in the others one is broken in mid-game.
"""

import random
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import chess

from kempelen.bench.reed_person import Deed, SloppyPerson, robot_deeds
from kempelen.bench.result import BenchResult, Progress
from kempelen.core.reed import Ask, Change, Finding, Lines, Snapshot, encode, square_name
from kempelen.sensing.moves import verdicts
from kempelen.sensing.moves.reader import MoveReader
from kempelen.sensing.reed.parameters import REED_PARAMETERS
from kempelen.sensing.reed.reading import Reading
from kempelen.twin.reed.device import Device, Line

GAMES = 200
_LONGEST = 80
"""Half-moves of a game."""
_PATIENCE_MS = 15_000
_EVERY_MS = 100
_BOUNCE_MS = 4
_QUIET_MS = 3000
_WORDS = 3
"""How often a person says that all is right before the game goes on regardless."""
_DAMAGE = Line(damage=0.002, loss=0.01)
Fault = Literal["", "stuck closed", "stuck open", "ghost", "damaged line"]
_FAULTS: tuple[Fault, ...] = ("stuck closed", "ghost", "stuck open", "ghost", "damaged line")


@dataclass
class Tally:
    """Of all games."""

    counts: Counter[str] = field(default_factory=Counter)
    habits: Counter[str] = field(default_factory=Counter)
    wrong: list[dict[str, Any]] = field(default_factory=list)
    injected: Counter[str] = field(default_factory=Counter)
    named: Counter[str] = field(default_factory=Counter)
    suspects: list[int] = field(default_factory=list)


class Bench:
    """One board, one game.

    Args:
        seed: Of everything random in it.

    Attributes:
        watching: Whether moves are read now.
    """

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)  # noqa: S311 - no secret
        self.device = Device(seed=seed)
        self.board = chess.Board()
        self.magnets = self.board.occupied
        self.now = 0
        self.device.power_up(self.magnets)
        self._lines = Lines()
        self._number = 0
        self.reading = Reading(self.board)
        self.reader = MoveReader(self.board, REED_PARAMETERS)
        self.verdict: verdicts.Verdict = verdicts.Settling()
        self.watching = True

    @property
    def damaged(self) -> int:
        """Lines that could not be read."""
        return self._lines.damaged

    def confirm(self, move: chess.Move) -> None:
        """The move has been made."""
        self.board.push(move)
        self.reading.stands(self.board)
        self.reader.confirm(self.board)
        self.verdict = verdicts.Settling()

    def do(self, deeds: list[Deed]) -> None:
        """Let a hand work; a move that is accepted before it has done ends that."""
        for wait, square, placed in deeds:
            end = self.now + wait
            while self.now < end:
                self.verdict = verdicts.Settling()
                if self.wait(end - self.now) and self.accepted:
                    return
            self._bounce(square)
            self.magnets = self.magnets | 1 << square if placed else self.magnets & ~(1 << square)
        self.verdict = verdicts.Settling()

    @property
    def accepted(self) -> bool:
        """Whether a move was taken for made."""
        return isinstance(self.verdict, verdicts.Moved | verdicts.TakenBack)

    def wait(self, ms: int) -> bool:
        """Let time pass; whether something was said that has to be acted upon."""
        end = self.now + ms
        while self.now < end:
            step = 1 if not self.device.at_rest else min(end - self.now, _EVERY_MS - self.now % _EVERY_MS)
            self.now += step
            self._scan(self.magnets)
            if not isinstance(self.verdict, _PASSING):
                return True
        return False

    def _bounce(self, square: int) -> None:
        """Contacts touch a few times, a millisecond each."""
        for _ in range(self.rng.randint(0, _BOUNCE_MS)):
            self.now += 1
            self._scan(self.magnets ^ (self.rng.getrandbits(1) << square))
        self.now += 1
        self._scan(self.magnets ^ 1 << square)

    def _scan(self, magnets: int) -> None:
        self.device.scan(self.now, magnets)
        for message in self._lines.feed(self.device.take_output()):
            if isinstance(message, Change | Finding):
                self.reading.take(message)
            elif isinstance(message, Snapshot):
                self.reading.take(message)
                if self.watching:
                    self.verdict = self.reader.update(self.reading.observation())
            elif isinstance(message, ValueError):
                self.device.receive(self.now, encode(Ask("S")))


_PASSING = (verdicts.Unchanged, verdicts.Settling, verdicts.Hidden)


class Game:
    """A person against a robot, both of whom play anything legal.

    Args:
        seed: Of the game.
        fault: What breaks in it.
        tally: Is added to.
    """

    def __init__(self, seed: int, fault: Fault, tally: Tally) -> None:
        self._bench = Bench(seed)
        self._rng = random.Random(seed + 1)  # noqa: S311 - no secret
        self._person = SloppyPerson(random.Random(seed + 2))  # noqa: S311 - no secret
        self._colour = bool(seed % 2)
        self._fault, self._tally = fault, tally
        self._breaks = self._rng.randint(2, 12)
        self._broken = 0
        self._seed = seed

    def play(self) -> None:
        """To the end, or as long as games last here."""
        bench, tally = self._bench, self._tally
        for ply in range(_LONGEST):
            if bench.board.is_game_over():
                break
            move = _choose(bench.board, self._rng)
            if self._fault and ply >= self._breaks and not self._broken:
                self._break(move)
            if bench.board.turn == self._colour:
                self._person_moves(move)
            else:
                bench.watching = False  # as a game does while the robot is at work
                bench.do(robot_deeds(bench.board, move))
                bench.wait(_QUIET_MS)
                bench.confirm(move)
                bench.watching = True
        bench.wait(_QUIET_MS)
        tally.habits.update(self._person.done)
        tally.counts["lines_damaged"] += bench.damaged
        tally.counts["order_lost"] += bench.reading.lost
        self._account()

    # --- the person ---

    def _person_moves(self, move: chess.Move) -> None:
        bench, tally = self._bench, self._tally
        tally.counts["moves"] += 1
        if (wrong := self._person.wrong_move(bench.board)) is not None:
            self._go_wrong(wrong)
        bench.do(self._person.move(bench.board, move))
        if not bench.accepted:
            bench.wait(_PATIENCE_MS)
        self._judge(move)

    def _judge(self, move: chess.Move) -> None:
        bench, tally = self._bench, self._tally
        match bench.verdict:
            case verdicts.Moved(moves=(found, *_)):
                right = found == move
                tally.counts["read"] += right
            case verdicts.TakenBack():
                right = False
            case verdicts.Unsure(candidates=candidates):
                kind = "promotions_asked" if move.promotion else "questions"
                tally.counts[kind] += 1
                right = (move,) in candidates
                self._told(counts=not right)
                right = True  # whoever is asked says what was played
            case _:
                self._told(counts=True)
                right = bool(self._fault)
        tally.counts["moves_right"] += right
        if bench.accepted and not right:
            tally.counts["wrong_accepts"] += 1
        if not right:
            self._note(move)
        self._bench.magnets = _after(bench.board, move)
        bench.confirm(move)

    def _told(self, *, counts: bool) -> None:
        """The move had to be told: nothing that was asked had it."""
        self._tally.counts["told"] += counts
        self._tally.counts["told_with_sound_switches"] += counts and not self._fault

    def _go_wrong(self, wrong: chess.Move) -> None:
        """An impossible move is made; it has to be told, and is put right."""
        bench, counts = self._bench, self._tally.counts
        counts["wrong_moves"] += 1
        bench.do(self._person.carry(wrong.from_square, wrong.to_square))
        bench.wait(_PATIENCE_MS)
        told = isinstance(bench.verdict, verdicts.Wrong | verdicts.Unsure)
        counts["wrong_moves_told"] += told
        if bench.accepted:
            counts["wrong_accepts"] += 1
            self._note(wrong)
        bench.do(self._person.carry(wrong.to_square, wrong.from_square))
        bench.wait(_QUIET_MS)

    def _note(self, move: chess.Move | None, said: str = "") -> None:
        """A row of what went otherwise than it should."""
        board = self._bench.board
        self._tally.wrong.append(
            {
                "game": self._seed,
                "ply": board.ply(),
                "played": "" if move is None else board.uci(move),
                "fault": self._fault or "none",
                "said": (said or str(self._bench.verdict))[:160],
            }
        )

    # --- faults ---

    def _break(self, move: chess.Move) -> None:
        """Something that the next move has to do with, so that it shows."""
        matrix = self._bench.device.matrix
        if self._fault == "damaged line":
            self._bench.device.line = _DAMAGE
            self._broken = chess.BB_ALL
            return
        if self._fault == "stuck closed":
            self._broken = matrix.stuck_closed = 1 << move.from_square
        elif self._fault == "stuck open":
            self._broken = matrix.stuck_open = 1 << move.to_square
        else:
            self._broken = matrix.bare = 1 << self._rng.choice(
                list(chess.SquareSet(self._bench.board.occupied))
            )
        self._tally.injected[self._fault] += 1

    def _account(self) -> None:
        """Whether what was broken has been named."""
        if self._fault in {"", "damaged line"} or not self._broken:
            return
        kinds = {"stuck closed": {"stuck closed"}, "stuck open": {"not felt"}, "ghost": {"diode"}}[
            self._fault
        ]
        found = [
            fault
            for fault in self._bench.reading.faults.named
            if fault.kind in kinds and fault.squares & self._broken
        ]
        self._tally.named[self._fault] += bool(found)
        if self._fault == "ghost" and found:
            self._tally.suspects.append(min(fault.squares.bit_count() for fault in found))
        if not found:
            self._note(None, f"{square_name(self._broken.bit_length() - 1)} was not named")


def _after(board: chess.Board, move: chess.Move) -> int:
    after = board.copy(stack=False)
    after.push(move)
    return after.occupied


def _choose(board: chess.Board, rng: random.Random) -> chess.Move:
    """Any legal move, the remarkable ones more often."""
    moves = list(board.legal_moves)
    weights = [1 + 3 * board.is_capture(m) + 25 * board.is_castling(m) + 25 * board.is_en_passant(m)
               + 3 * (board.piece_type_at(m.from_square) == chess.PAWN) for m in moves]  # fmt: skip
    return rng.choices(moves, weights)[0]


def run(
    *, seed: int, pgn: Path | None, data: Path | None, games: int = GAMES, progress: Progress
) -> BenchResult:
    """Play ``games`` games.

    Args:
        seed: Of the first game; the others count on from it.
        pgn: Not used.
        data: Not used.
        games: How many.
        progress: Told before each game.
    """
    del pgn, data
    tally = Tally()
    for number in range(games):
        progress(f"game {number + 1}", number / games)
        fault: Fault = _FAULTS[number // 4 % len(_FAULTS)] if number % 4 == 3 else ""  # noqa: PLR2004 - of four
        Game(seed * 1000 + number, fault, tally).play()
    return BenchResult("reed", _figures(games, tally), [*_rows(tally), *tally.wrong])


def _figures(games: int, tally: Tally) -> dict[str, float]:
    counts = tally.counts
    moves = max(counts["moves"], 1)
    return {
        "games": float(games),
        "moves": float(counts["moves"]),
        "moves_right": 100.0 * counts["moves_right"] / moves,
        "moves_read_unasked": 100.0 * counts["read"] / moves,
        "questions": float(counts["questions"]),
        "promotions_asked": float(counts["promotions_asked"]),
        "told": float(counts["told"]),
        "told_with_sound_switches": float(counts["told_with_sound_switches"]),
        "wrong_accepts": float(counts["wrong_accepts"]),
        "wrong_moves": float(counts["wrong_moves"]),
        "wrong_moves_told": float(counts["wrong_moves_told"]),
        "faults_injected": float(tally.injected.total()),
        "faults_named": float(tally.named.total()),
        "ghost_suspects": float(sum(tally.suspects) / max(len(tally.suspects), 1)),
        "lines_damaged": float(counts["lines_damaged"]),
    }


def _rows(tally: Tally) -> list[dict[str, Any]]:
    habits = [{"habit": name, "times": count} for name, count in sorted(tally.habits.items())]
    faults = [
        {"fault": name, "injected": count, "named": tally.named[name]}
        for name, count in sorted(tally.injected.items())
    ]
    return [*habits, *faults]
