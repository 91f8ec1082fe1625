"""Faults on demand, by name, as they come through the side door."""

from collections.abc import Callable, Mapping
from typing import Any

from kempelen.core.errors import TwinError
from kempelen.twin.machine import Controller
from kempelen.twin.physics.world import World

Request = Mapping[str, Any]
_AXES = "XYZAB"


def _axis(world: World, request: Request) -> int:
    axis, there = str(request["axis"]).upper(), _AXES[: len(world.joints)]
    if axis not in there or len(axis) != 1:
        raise TwinError(f"'{request['axis']}' is no axis.", hint=f"Name one of {', '.join(there)}.")
    return there.index(axis)


def _switch(group: set[int], world: World, request: Request) -> None:
    """Put an axis into a set of faulty ones, or take it out with ``"on": false``."""
    if request.get("on", True):
        group.add(_axis(world, request))
    else:
        group.discard(_axis(world, request))


def _garble(controller: Controller, _world: World, request: Request) -> None:
    controller.faults.garble_in = float(request.get("in", 0.0))
    controller.faults.garble_out = float(request.get("out", 0.0))


def _swallow(controller: Controller, _world: World, request: Request) -> None:
    controller.faults.swallow_oks = int(request.get("count", 1))


def _delay(controller: Controller, _world: World, request: Request) -> None:
    controller.faults.reply_delay_s = float(request["seconds"])


def _stall(controller: Controller, world: World, request: Request) -> None:
    _switch(controller.faults.stalled, world, request)


def _dead_switch(controller: Controller, world: World, request: Request) -> None:
    _switch(controller.faults.dead_switches, world, request)


def _lose_steps(controller: Controller, world: World, request: Request) -> None:
    controller.faults.lose_steps(_axis(world, request), int(request["steps"]))


def _reset(controller: Controller, _world: World, _request: Request) -> None:
    controller.faults.reset = True


def _drop_link(controller: Controller, _world: World, _request: Request) -> None:
    controller.faults.link_drop = True


def _knock_over(_controller: Controller, world: World, request: Request) -> None:
    world.knock_over(str(request["piece"]))


FAULTS: Mapping[str, Callable[[Controller, World, Request], None]] = {
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


def apply_fault(controller: Controller, world: World, request: Request) -> None:
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
