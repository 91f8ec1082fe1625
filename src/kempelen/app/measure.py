"""What a game's report needs, taken between moves: placement, times, bounds."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import chess

from kempelen.app.audit import PlacementAudit, disagreements, poses, standing_error
from kempelen.app.report import GameReport
from kempelen.core import events
from kempelen.core.places import Place
from kempelen.core.protocols import OnThinking, TransferReport
from kempelen.core.table import Table
from kempelen.game.arbiter import Arbiter
from kempelen.game.players import Player, Proposal
from kempelen.game.state import GameState
from kempelen.twin.client import Door


@dataclass(frozen=True, slots=True)
class MoveTime:
    """How long the robot worked at one move, parking included, s."""

    san: str
    transfers: int
    seconds: float


class Measurements:
    """Listens to the arbiter and, on the twin, looks at the ground truth between moves.

    Args:
        table: Where places are.
        control: The twin's side door, for the ground truth; None on a real machine.

    Attributes:
        moves: Robot time of each move (twin only).
        reports: Of each transfer that the hand measured.
    """

    def __init__(self, table: Table, control: Door | None) -> None:
        self._control = control
        self._table = table
        self._audit: PlacementAudit | None = None
        self._placed: dict[Place, chess.Piece] = {}
        self._move: events.MoveProposed | None = None
        self._truth: Mapping[str, Any] = {}
        self._first: Mapping[str, Any] = {}
        self.moves: list[MoveTime] = []
        self.reports: list[TransferReport] = []
        self.transfers = 0

    def listen(self, event: events.Event) -> None:
        """Take what the arbiter tells."""
        match event:
            case events.MoveProposed():
                self._move = event
            case events.TransferDone() if self._move is None or not self._move.by_hand:
                self.transfers += 1
                self._placed.pop(event.transfer.source, None)
                self._placed[event.transfer.target] = event.transfer.piece
                if event.report is not None:
                    self.reports.append(event.report)
            case _:
                pass

    async def sample(self) -> None:
        """Between two moves: look where everything stands."""
        if self._control is None:
            return
        before, self._truth = self._truth, await self._control.ask("settle")
        move, self._move = self._move, None
        placed, self._placed = self._placed, {}
        if self._audit is None:
            self._first = self._truth
            self._audit = PlacementAudit(self._table, poses(self._truth))
            self._audit.after_move(placed, self._truth)  # what was finished after an exit
        elif move is not None and move.by_hand:
            self._audit.before = poses(self._truth)  # what a person moved is the person's affair
        elif placed:
            self._audit.after_move(placed, self._truth)
        if move is not None and not move.by_hand and before:
            seconds = float(self._truth["busy_s"]) - float(before["busy_s"])
            self.moves.append(MoveTime(move.san, len(move.transfers), seconds))

    @property
    def twin_seconds(self) -> tuple[float, float]:
        """Simulated time in which the robot worked, and the wall time that went by meanwhile, s."""
        return (
            float(self._truth["busy_s"]) - float(self._first["busy_s"]),
            float(self._truth["wall_s"]) - float(self._first["wall_s"]),
        )

    @property
    def robot_seconds(self) -> float:
        """Time in which the robot worked at moves: the twin's own, or as measured by the hand."""
        return self.twin_seconds[0] if self._first else sum(report.seconds for report in self.reports)

    @property
    def errors(self) -> list[float]:
        """Distance of each placed piece from its place's centre, mm (twin only)."""
        return list(self._audit.errors) if self._audit else []

    @property
    def lost(self) -> list[str]:
        """What was not put down where the game says, a sentence each (twin only)."""
        return list(self._audit.lost) if self._audit else []

    @property
    def toppled(self) -> int:
        """Pieces that have fallen over (twin only)."""
        return self._audit.toppled if self._audit else 0

    @property
    def over_bound(self) -> float:
        """Robot time of all carries, from grip to release, over the sum of their lower bounds.

        No plan can shorten the wait in which the gripper opens; it is not counted. What the wire and the
        controller take beside the plan is.
        """
        bound = sum(report.bound for report in self.reports)
        carried = sum(report.carry - self._table.gripper.open_seconds for report in self.reports)
        return max(carried / bound, 0.0) if bound else 0.0

    def report(self, arbiter: Arbiter, over: events.GameOver | None, *, wall: float) -> GameReport:
        """Everything together; the table can be compared with the game only when the game is ``over``."""
        state, audit = arbiter.state, self._audit
        at_end = audit is not None and over is not None
        return GameReport(
            result=over.result if over else "*",
            reason=over.reason if over else "interrupted",
            final_fen=state.board.fen(),
            plies=state.plies,
            transfers=self.transfers,
            interventions=state.helps,
            placement=audit.summary() if audit else None,
            collisions=audit.collisions if audit else 0,
            robot_time_s=round(self.robot_seconds, 3),
            wall_time_s=round(wall, 3),
            robot_time_over_bound=round(self.over_bound, 4),
            game=arbiter.game,
            standing_max_mm=self._standing(state) if at_end else None,
            disagreements=self._wrong(state, at_end=at_end),
        )

    def _wrong(self, state: GameState, *, at_end: bool) -> list[str]:
        """What was put down wrongly in any move, then what stands wrongly at the end."""
        return self.lost + (disagreements(self._table, state.layout, self._truth) if at_end else [])

    def _standing(self, state: GameState) -> float:
        return round(standing_error(self._table, state.begun.layout, state.layout, self._truth), 4)


class MeasuredPlayer:
    """A player before whose turn the table is looked at; the player itself sees nothing of it."""

    def __init__(self, player: Player, measurements: Measurements) -> None:
        self._player = player
        self._measurements = measurements
        self.spec = player.spec

    async def propose(self, board: chess.Board, on_thinking: OnThinking) -> Proposal:
        """The player's own proposal."""
        await self._measurements.sample()
        return await self._player.propose(board, on_thinking)

    async def answer_draw(self, board: chess.Board) -> bool:
        """The player's own answer."""
        return await self._player.answer_draw(board)
