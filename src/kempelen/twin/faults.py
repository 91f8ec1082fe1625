"""Faults on demand, by name, as they come through the side door."""

from collections.abc import Callable, Mapping
from typing import Any

from kempelen.core.errors import TwinError
from kempelen.twin.grbl import VirtualGrbl
from kempelen.twin.physics.world import World

Request = Mapping[str, Any]
_AXES = "XYZ"


def _axis(request: Request) -> int:
    axis = str(request["axis"]).upper()
    if axis not in _AXES or len(axis) != 1:
        raise TwinError(f"'{request['axis']}' is no axis.", hint="Name X, Y or Z.")
    return _AXES.index(axis)


def _switch(group: set[int], request: Request) -> None:
    """Put an axis into a set of faulty ones, or take it out with ``"on": false``."""
    if request.get("on", True):
        group.add(_axis(request))
    else:
        group.discard(_axis(request))


def _garble(controller: VirtualGrbl, _world: World, request: Request) -> None:
    controller.faults.garble_in = float(request.get("in", 0.0))
    controller.faults.garble_out = float(request.get("out", 0.0))


def _swallow(controller: VirtualGrbl, _world: World, request: Request) -> None:
    controller.faults.swallow_oks = int(request.get("count", 1))


def _delay(controller: VirtualGrbl, _world: World, request: Request) -> None:
    controller.faults.reply_delay_s = float(request["seconds"])


def _stall(controller: VirtualGrbl, _world: World, request: Request) -> None:
    _switch(controller.faults.stalled, request)


def _dead_switch(controller: VirtualGrbl, _world: World, request: Request) -> None:
    _switch(controller.faults.dead_switches, request)


def _lose_steps(controller: VirtualGrbl, _world: World, request: Request) -> None:
    controller.faults.lose_steps(_axis(request), int(request["steps"]))


def _reset(controller: VirtualGrbl, _world: World, _request: Request) -> None:
    controller.faults.reset = True


def _drop_link(controller: VirtualGrbl, _world: World, _request: Request) -> None:
    controller.faults.link_drop = True


def _knock_over(_controller: VirtualGrbl, world: World, request: Request) -> None:
    world.knock_over(str(request["piece"]))


FAULTS: Mapping[str, Callable[[VirtualGrbl, World, Request], None]] = {
    "garble": _garble,
    "swallow-ok": _swallow,
    "delay": _delay,
    "stall": _stall,
    "dead-switch": _dead_switch,
    "lose-steps": _lose_steps,
    "reset": _reset,
    "drop-link": _drop_link,
    "knock-over": _knock_over,
}


def apply_fault(controller: VirtualGrbl, world: World, request: Request) -> None:
    """Break, or mend, what the request names.

    Args:
        controller: Whose `Faults` are changed.
        world: Whose pieces may be knocked over.
        request: ``{"name": "stall", "axis": "X", "on": true}`` and the like.

    Raises:
        TwinError: no such fault, axis or piece.
    """
    name = str(request["name"])
    if name not in FAULTS:
        raise TwinError(f"There is no fault '{name}'.", hint=f"Choose one of: {', '.join(FAULTS)}.")
    FAULTS[name](controller, world, request)
