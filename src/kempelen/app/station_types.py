"""What a `kempelen.app.station.Station` shows and takes, as plain values."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

import chess

from kempelen.core.places import Place
from kempelen.game.clock import TimeControl

Point = tuple[float, float, float]
Remedy = Literal["connect", "home", "recover", "resume", "resume_game", "leave_game"]
PromptKind = Literal["do", "yes_no", "which_move", "advice", "draw"]


class Phase(StrEnum):
    """What a station is doing."""

    OFF = "off"  # no robot is connected
    CONNECTING = "connecting"
    READY = "ready"  # connected; no game runs, but one that is over or was cut off may still be shown
    STARTING = "starting"  # a game is being set up
    PLAYING = "playing"
    LEAVING = "leaving"


class Change(StrEnum):
    """What has changed; the words are those of the topics of pages."""

    STATION = "station"
    ROBOT = "robot"
    GAME = "game"
    PROMPTS = "prompts"
    EYES = "eyes"
    CALIBRATION = "calibration"


@dataclass(frozen=True, slots=True)
class StationFault:
    """Something is wrong.

    Attributes:
        title: A few plain words.
        text: What, where, and what to do.
        remedy: The command that mends it; None where only a person can.
    """

    title: str
    text: str
    remedy: Remedy | None = None


@dataclass(frozen=True, slots=True)
class Prompt:
    """Something that a person is asked, or told.

    Attributes:
        id: To answer it by; no other prompt of this run of the program has it.
        kind: ``do``: put something right, then answer anything; ``yes_no``; ``which_move``: answer one of
            the candidates in UCI; ``advice``: nothing to answer, it goes by itself; ``draw``: yes or no.
        text: In plain words.
        place: Square or slot that it is about.
        piece: That it is about.
        candidates: Moves of ``which_move``, in UCI, the likeliest first.
    """

    id: str
    kind: PromptKind
    text: str
    place: Place | None = None
    piece: chess.Piece | None = None
    candidates: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class GameOptions:
    """How a game differs from the configuration; None: as configured.

    Attributes:
        engine: A path, a name on PATH, "maia-1500"; empty for the best at hand.
        level: "1" to "20", an Elo, "maia-1500", "full".
        move_time: Of the engine, s.
        hands: Who carries a person's pieces.
        clock: Time control; None for none.
    """

    engine: str | None = None
    level: str | None = None
    move_time: float | None = None
    hands: Literal["auto", "robot", "person"] | None = None
    clock: TimeControl | None = None


@dataclass(frozen=True, slots=True)
class CalibrationState:
    """A calibration in the making.

    Attributes:
        active: Whether one is being made.
        touched: Outer corners so far, mm, robot frame.
        residuals: Of the fit through them, mm, by corner; empty with fewer than two.
        square: As fitted, or as known, mm.
        problem: Why it cannot be used as it is; empty when it can.
        fits: What would not fit on a table so measured, a sentence each.
    """

    active: bool = False
    touched: tuple[tuple[str, Point], ...] = ()
    residuals: tuple[tuple[str, float], ...] = ()
    square: float | None = None
    problem: str = ""
    fits: tuple[str, ...] = ()
