"""The station to the hub: what changed becomes topics, what happened becomes words."""

import asyncio
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import fields
from enum import Enum
from types import TracebackType
from typing import Literal, Self

import chess

from kempelen.app.discreet import without_paths
from kempelen.app.narrate import sentence
from kempelen.app.station import Station
from kempelen.app.station_types import Change, Phase
from kempelen.core import events
from kempelen.core.places import Place
from kempelen.core.protocols import Checkpoint, RobotPhase, Thinking
from kempelen.core.senses import Sight
from kempelen.server.hub import Hub
from kempelen.server.messages import Say
from kempelen.server.moves import colour_of
from kempelen.server.topics import ActivityView
from kempelen.server.views import (
    GameViews,
    calibration_view,
    eyes_view,
    prompt_view,
    robot_view,
    station_view,
    thinking_view,
)

_UNSAID = (events.CheckpointReached, events.EngineThinking, events.RobotChanged, events.ClockChanged)
"""Topics tell of them."""
_THOUGHT_S = 0.15
"""Thoughts are shown at most this often."""
_LATER_S = 0.15
"""An end that moves by less is the same."""
_Step = Literal["approaching", "carrying", "leaving"]
_STEPS: Mapping[Checkpoint, _Step] = {
    Checkpoint.GRIPPING: "approaching",
    Checkpoint.CARRYING: "carrying",
    Checkpoint.RELEASED: "leaving",
}


class Bridge:
    """Context manager, in the event loop.

    Args:
        station: What is shown.
        hub: Where.
    """

    def __init__(self, station: Station, hub: Hub) -> None:
        self._station = station
        self._hub = hub
        self._stack = ExitStack()
        self._dirty: set[Change] = set()
        self._due: asyncio.Handle | None = None
        self._games = GameViews()
        self._activity: ActivityView | None = None
        self._thought: tuple[chess.Color, Thinking] | None = None
        self._thinking: asyncio.TimerHandle | None = None
        self._sight, self._message, self._hand = Sight.STARTING, "", False
        self._shows: dict[Change, Callable[[], None]] = {
            Change.STATION: lambda: hub.put("station", station_view(station)),
            Change.ROBOT: self._show_robot,
            Change.GAME: lambda: hub.put("game", self._games.view(station)),
            Change.PROMPTS: self._show_prompts,
            Change.EYES: self._show_eyes,
            Change.CALIBRATION: lambda: hub.put("calibration", calibration_view(station.calibration)),
        }

    def __enter__(self) -> Self:
        """Show everything, and from now on whatever changes."""
        self._stack.callback(self._station.listen(self._changed))
        self._stack.callback(self._station.events.listen(self._happened))
        self._dirty.update(Change)
        self._show()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Show nothing more."""
        self._stack.close()
        for handle in (self._due, self._thinking):
            if handle is not None:
                handle.cancel()

    # --- what changed ---------------------------------------------------------------------------------------

    def _changed(self, change: Change) -> None:
        """Shown in a moment, together with all else that the same step changes."""
        self._dirty.add(change)
        if self._due is None:
            self._due = asyncio.get_running_loop().call_soon(self._show)

    def _show(self) -> None:
        self._due = None
        dirty, self._dirty = self._dirty, set()
        if Change.STATION in dirty and self._station.phase is not Phase.PLAYING:
            self._set_activity(None)
            self._forget_thought()
        for change in Change:
            if change in dirty:
                self._shows[change]()

    def _show_robot(self) -> None:
        state = self._station.robot
        self._hub.put("robot", robot_view(state))
        if state.phase is RobotPhase.HOMING:
            self._set_activity(ActivityView(kind="homing"))
        elif self._activity is not None and self._activity.kind == "homing":
            self._set_activity(None)
        else:
            self._retime()

    def _show_prompts(self) -> None:
        live = self._station.live
        board = live.board if live is not None else None
        self._hub.put("prompts", tuple(prompt_view(prompt, board) for prompt in self._station.prompts))

    def _show_eyes(self) -> None:
        self._hub.put("eyes", eyes_view(self._station, self._sight, self._message, hand=self._hand))

    # --- what happened --------------------------------------------------------------------------------------

    def _happened(self, event: events.Event) -> None:
        if isinstance(event, events.EngineThinking):
            self._think(event)
            return
        self._take(event)
        if not isinstance(event, events.RobotChanged):
            self._changed(Change.GAME)
        if not isinstance(event, _UNSAID):
            self._say(event)

    def _take(self, event: events.Event) -> None:
        """What topics need of it beside the game itself."""
        match event:
            case events.TransferStarted() | events.CheckpointReached():
                self._set_activity(_activity(event, self._activity))
            case events.TurnBegan():
                live = self._station.live
                waiting = live is not None and event.colour in live.arbiter.pairing.people
                self._set_activity(ActivityView(kind="waiting") if waiting else None)
            case events.MoveProposed():
                self._forget_thought()
            case events.TransferDone() | events.Paused() | events.Resumed():
                self._retime()
            case events.GameOver():
                self._set_activity(None)
            case _:
                self._note(event)

    def _note(self, event: events.Event) -> None:
        """What nobody else remembers."""
        match event:
            case events.DrawOffered():
                self._games.draw_offer = event.colour
            case events.DrawDeclined() | events.GameStarted():
                self._games.draw_offer = None
            case events.SensorChanged():
                self._sight, self._message = event.sight, event.message
                self._changed(Change.EYES)
            case events.HandOverBoard():
                self._hand = event.over
                self._changed(Change.EYES)
            case _:
                pass

    def _say(self, event: events.Event) -> None:
        text = event.question if isinstance(event, events.SensorUnsure) else sentence(event)
        data = told(event)
        if isinstance(event, events.MoveCommitted):
            text = f"{'White' if event.colour else 'Black'} has played {event.san}."
        if text:
            kind = type(event).__name__
            self._hub.say(Say(kind=kind, text=without_paths(text), data=data, at=round(time.time(), 3)))

    # --- what the robot is doing ----------------------------------------------------------------------------

    def _set_activity(self, activity: ActivityView | None) -> None:
        self._activity = activity
        self._retime()

    def _retime(self) -> None:
        """When it should be done; as long as that does not move, the same."""
        activity = self._activity
        if activity is not None and activity.kind not in {"waiting", "homing"}:
            live = self._station.live
            left = live.seconds_left if live is not None else None
            ends = None if left is None else round(time.time() + left, 3)
            before = activity.ends_at
            if (ends is None) != (before is None) or (ends and before and abs(ends - before) > _LATER_S):
                activity = self._activity = activity.model_copy(update={"ends_at": ends})
        self._hub.put("activity", activity)

    # --- what the engine thinks -----------------------------------------------------------------------------

    def _think(self, event: events.EngineThinking) -> None:
        self._thought = (event.colour, event.thinking)
        if self._thinking is None:
            self._thinking = asyncio.get_running_loop().call_later(_THOUGHT_S, self._show_thought)

    def _show_thought(self) -> None:
        self._thinking = None
        live = self._station.live
        if self._thought is not None and live is not None:
            self._hub.put("thinking", thinking_view(*self._thought, live.board))

    def _forget_thought(self) -> None:
        """The last one stays to be seen, as the evaluation, until the game is gone."""
        self._show_thought()
        self._thought = None
        if self._station.live is None:
            self._hub.put("thinking", None)


def _activity(
    event: events.TransferStarted | events.CheckpointReached, before: ActivityView | None
) -> ActivityView:
    transfer, number, count = event.transfer, 0, 0
    kind: _Step
    if isinstance(event, events.TransferStarted):
        kind, number, count = "approaching", event.number, event.count
    else:
        kind = _STEPS[event.checkpoint]
        if before is not None:
            number, count = before.number, before.count
    return ActivityView(
        kind=kind, piece=transfer.piece.symbol(), source=transfer.source.name, target=transfer.target.name,
        number=number, count=count,
    )  # fmt: skip


def told(event: events.Event) -> dict[str, str | int | float | bool | None]:
    """The plain values of an event, for pages that say it in their own words."""
    found = {field.name: _plain(field.name, getattr(event, field.name)) for field in fields(event)}
    return {name: value for name, value in found.items() if not isinstance(value, _Unplain)}


class _Unplain:
    """Stands for a value that is not told."""


_UNPLAIN = _Unplain()


def _plain(name: str, value: object) -> str | int | float | bool | _Unplain | None:
    if name == "colour" and isinstance(value, bool):
        return colour_of(value)
    if isinstance(value, Enum):
        return str(value.value)
    if isinstance(value, chess.Piece):
        return value.symbol()
    if isinstance(value, Place):
        return value.name
    if isinstance(value, str):
        return without_paths(value)
    return value if value is None or isinstance(value, int | float | bool) else _UNPLAIN
