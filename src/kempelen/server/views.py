"""What a station shows, as the values of topics."""

import time

import chess

from kempelen.app.discreet import without_paths
from kempelen.app.live_game import LiveGame
from kempelen.app.station import Station
from kempelen.app.station_types import CalibrationState, Phase, Prompt, StationFault
from kempelen.core.protocols import RobotState, Thinking
from kempelen.core.senses import Sight
from kempelen.game.clock import ClockReading
from kempelen.server.moves import MoveBook, colour_of
from kempelen.server.said import said
from kempelen.server.topics import (
    CalibrationView,
    Candidate,
    ClockView,
    Colour,
    EyesView,
    Fault,
    GameView,
    PromptView,
    RobotView,
    SideView,
    StationView,
    ThinkingView,
)

_MM = 2  # digits
_CLOCK_S = 0.05
"""A clock that differs by less from the one shown shows the same."""
_LINE = 10


def station_view(station: Station) -> StationView:
    """The table and what is done with it."""
    config = station.config
    return StationView(
        phase=station.phase.value,
        busy=station.busy,
        busy_said=said(station.busy),
        robot_kind=config.robot.kind,
        port=config.robot.port,
        on_twin=config.on_twin,
        speed=station.speed,
        calibrated=config.calibration_path.exists(),
        game=station.live.arbiter.game if station.live else None,
        again=station.again,
        faults=tuple(map(_fault, station.faults)),
    )


def _fault(fault: StationFault) -> Fault:
    return Fault(
        title=fault.title,
        title_said=said(fault.title),
        text=without_paths(fault.text),
        text_said=said(fault.text),
        remedy=fault.remedy,
    )


def robot_view(state: RobotState) -> RobotView:
    """The robot as it reports itself."""
    x, y, z = (round(value, _MM) for value in state.reported_position or (0.0, 0.0, 0.0))
    return RobotView(
        phase=state.phase.value,
        homed=state.homed,
        position=None if state.reported_position is None else (x, y, z),
        gripper=state.gripper.value,
        message=state.message,
    )


def prompt_view(prompt: Prompt, board: chess.Board | None) -> PromptView:
    """Something that a person is asked."""
    return PromptView(
        id=prompt.id,
        kind=prompt.kind,
        text=prompt.text,
        text_said=said(prompt.text),
        square=prompt.place.name if prompt.place is not None and prompt.place.is_square else None,
        piece=prompt.piece.symbol() if prompt.piece else None,
        candidates=tuple(Candidate(uci=uci, san=_san(uci, board)) for uci in prompt.candidates),
    )


def _san(uci: str, board: chess.Board | None) -> str:
    move = chess.Move.from_uci(uci)
    return board.san(move) if board is not None and move in board.legal_moves else uci


def thinking_view(colour: chess.Color, thinking: Thinking, board: chess.Board) -> ThinkingView:
    """What the engine thinks, from White's side."""
    sign = 1 if colour else -1
    board, line = board.copy(stack=False), list[str]()
    for move in thinking.line[:_LINE]:
        if move not in board.legal_moves:
            break
        line.append(board.san(move))
        board.push(move)
    return ThinkingView(
        colour=colour_of(colour),
        depth=thinking.depth,
        centipawns=None if thinking.centipawns is None else sign * thinking.centipawns,
        mate=None if thinking.mate is None else sign * thinking.mate,
        line=tuple(line),
        nodes=thinking.nodes,
        adapted=thinking.adapted,
    )


def calibration_view(state: CalibrationState) -> CalibrationView:
    """A calibration in the making."""
    return CalibrationView(
        active=state.active,
        touched=dict(state.touched),
        residuals=dict(state.residuals),
        square=state.square,
        problem=state.problem,
        fits=state.fits,
    )


def eyes_view(station: Station, sight: Sight, message: str, *, hand: bool) -> EyesView:
    """How the board is seen."""
    eyes = station.eyes
    if eyes is None:
        return EyesView(there=station.config.has_eyes, recording=station.recording)
    return EyesView(
        there=True,
        on=eyes.on,
        sight=sight.value,
        message=message,
        hand=hand,
        recording=station.recording,
    )


class GameViews:
    """The game on the table; what does not change is not worked out again."""

    def __init__(self) -> None:
        self._book = MoveBook()
        self._clock: ClockView | None = None
        self.draw_offer: chess.Color | None = None

    def view(self, station: Station) -> GameView | None:
        """As it is now; None for no game."""
        live = station.live
        if live is None:
            self._clock = None
            return None
        arbiter, board = live.arbiter, live.board
        pairing, ended = arbiter.pairing, live.arbiter.state.ended
        to_move = station.phase is Phase.PLAYING and live.cast.person.to_move
        return GameView(
            number=arbiter.game,
            mode=pairing.mode.value,
            white=SideView(name=pairing.white.spec.name, kind=pairing.white.spec.kind),
            black=SideView(name=pairing.black.spec.name, kind=pairing.black.spec.kind),
            people=tuple(colour_of(colour) for colour in pairing.people),
            start_fen=arbiter.state.begun.start_fen,
            fen=board.fen(),
            moves=self._book.moves(board),
            turn=colour_of(board.turn),
            person_to_move=to_move,
            legal=tuple(move.uci() for move in board.legal_moves) if to_move else (),
            check=_check(board),
            captured=self._book.captured(board),
            paused=arbiter.paused,
            in_transfer=arbiter.paused and arbiter.state.pending is not None,
            draw_offer=None if self.draw_offer is None else colour_of(self.draw_offer),
            result=ended.result if ended else "",
            reason=ended.reason if ended else "",
            length=live.length,
            clock=self._clock_view(station.clock),
            by_hand=_by_hand(station, live),
        )

    def _clock_view(self, reading: ClockReading | None) -> ClockView | None:
        """The one shown before, as long as it goes on showing the right time."""
        if reading is None:
            self._clock = None
            return None
        at, shown = time.time(), self._clock
        running: Colour | None = None if reading.running is None else colour_of(reading.running)
        if shown is None or shown.running != running or _differs(shown, reading, at):
            self._clock = ClockView(
                white=round(reading.white, 3), black=round(reading.black, 3), running=running, at=round(at, 3)
            )
        return self._clock


def _differs(shown: ClockView, reading: ClockReading, at: float) -> bool:
    gone = at - shown.at
    white = shown.white - (gone if shown.running == "white" else 0)
    black = shown.black - (gone if shown.running == "black" else 0)
    return max(abs(white - reading.white), abs(black - reading.black)) > _CLOCK_S


def _check(board: chess.Board) -> str | None:
    king = board.king(board.turn)
    return chess.square_name(king) if king is not None and board.is_check() else None


def _by_hand(station: Station, live: LiveGame) -> bool:
    """Whether a person's moves are made on the board, and seen."""
    eyes = live.eyes
    return eyes is not None and eyes.on and station.config.hands == "person"
