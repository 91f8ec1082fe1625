"""What each command means to the station."""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import chess

from kempelen.app.cast import GameRequest
from kempelen.app.standing import LAST
from kempelen.app.station import Station
from kempelen.app.station_types import GameOptions
from kempelen.core.errors import ConfigError
from kempelen.core.words import say
from kempelen.game.clock import TimeControl
from kempelen.game.fen import parse_fen
from kempelen.game.modes import Mode
from kempelen.game.pgn import GameScore, parse_game
from kempelen.game.pgn_scan import PgnLimits
from kempelen.server import commands
from kempelen.server.engines import require_offered

PGN_LIMITS = PgnLimits(file_bytes=2_100_000, game_bytes=400_000, line_bytes=400_000, games=5000, plies=2000)
"""For games that come over the network."""

Result = dict[str, Any] | None
Deed = Callable[[], Coroutine[Any, Any, Result]]
_Act = Callable[[Station, Any], Awaitable[Result | object]]


def deed(station: Station, command: commands.Command, owner: str) -> Deed:
    """What to do; nothing is done yet.

    Args:
        station: To whom.
        command: What is asked for.
        owner: Whose jogging it is.
    """
    if isinstance(command, commands.Jog):
        return partial(_quietly, lambda: station.jog(owner, command.direction, command.speed))
    if isinstance(command, commands.JogStop):
        return partial(_quietly, lambda: station.jog_stop(owner))
    act = _ACTS[type(command)]
    return partial(_result, act, station, command)


async def _quietly(act: Callable[[], Awaitable[None]]) -> Result:
    await act()
    return None


async def _result(act: _Act, station: Station, command: commands.Command) -> Result:
    result = await act(station, command)
    return result if isinstance(result, dict) else None


async def _new_game(station: Station, wish: commands.NewGame) -> Result:
    require_offered(station.config, wish.engine, wish.opponent)
    score = await _score(wish.pgn, wish.pgn_game) if wish.mode == "replay" else None
    if wish.mode == "replay" and score is None:
        raise ConfigError(
            say("no_pgn", "A replay needs a game."), hint=say("drop_pgn", "Drop a PGN file, or paste one.")
        )
    start = score.start_fen if score else _position(wish.fen)
    request = GameRequest(
        Mode(wish.mode), start, score=score, person_plays=wish.side == "white",
        take_over_move=wish.take_over if score else None,
        opponent=wish.opponent, opponent_level=wish.opponent_level,
    )  # fmt: skip
    clock = TimeControl(60 * wish.clock.minutes, wish.clock.increment) if wish.clock else None
    options = GameOptions(
        engine=wish.engine or None, level=wish.level, move_time=wish.move_time, hands=wish.hands, clock=clock
    )
    if wish.set_up:
        request = replace(request, standing=station.left_standing(LAST))
    return {"game": await station.begin(request, options)}


async def _set_up(station: Station, wish: commands.SetUp) -> Result:
    return {"game": await station.set_up(_position(wish.fen), wish.standing)}


def _position(fen: str) -> str:
    return parse_fen(fen).fen() if fen.strip() else chess.STARTING_FEN


async def _score(pgn: str, number: int) -> GameScore | None:
    """In a thread: a big file takes a while, and an e-stop must not wait for it."""
    if not pgn.strip():
        return None
    return await asyncio.to_thread(parse_game, pgn, number, limits=PGN_LIMITS)


async def _rematch(station: Station, wish: commands.Rematch) -> Result:
    return {"game": await station.rematch(swapped=wish.swapped)}


async def _resume_game(station: Station, wish: commands.ResumeGame) -> Result:
    return {"game": await station.resume_game(wish.game)}


async def _swap_mode(station: Station, wish: commands.SwapMode) -> None:
    live = station.live
    turn = live.board.turn if live is not None else chess.WHITE
    plays = turn if wish.side is None else wish.side == "white"
    score = await _score(wish.pgn, wish.pgn_game)
    await station.swap_mode(GameRequest(Mode(wish.mode), score=score, person_plays=plays))


async def _move(station: Station, wish: commands.Move) -> Result:
    return {"uci": (await station.move(wish.uci, wish.ply)).uci()}


async def _offer_draw(station: Station, _: commands.OfferDraw) -> Result:
    return {"agreed": await station.offer_draw()}


async def _bumped(station: Station, _: commands.Bumped) -> Result:
    return {"said": await station.bumped()}


async def _record(station: Station, wish: commands.Record) -> Result:
    return {"file": await station.record(on=wish.on)}


_ACTS: Mapping[type[commands.Command], _Act] = {
    commands.Connect: lambda s, c: s.connect(c.kind, c.port),
    commands.Disconnect: lambda s, _: s.disconnect(),
    commands.Home: lambda s, _: s.home(),
    commands.Recover: lambda s, _: s.recover(),
    commands.EStop: lambda s, _: s.stop(),
    commands.CalibrationBegin: lambda s, _: s.calibration_begin(),
    commands.Touch: lambda s, c: s.calibration_touch(c.corner),
    commands.CalibrationByCamera: lambda s, _: s.calibration_by_camera(),
    commands.CalibrationApply: lambda s, c: s.calibration_apply(c.square),
    commands.CalibrationCancel: lambda s, _: s.calibration_cancel(),
    commands.NewGame: _new_game,
    commands.SetUp: _set_up,
    commands.Rematch: _rematch,
    commands.ResumeGame: _resume_game,
    commands.LeaveGame: lambda s, _: s.leave_game(),
    commands.SwapMode: _swap_mode,
    commands.Pause: lambda s, _: s.pause(),
    commands.Resume: lambda s, _: s.resume(),
    commands.Finish: lambda s, _: s.finish(),
    commands.Takeback: lambda s, c: s.takeback(c.plies),
    commands.Resign: lambda s, _: s.resign(),
    commands.OfferDraw: _offer_draw,
    commands.Move: _move,
    commands.HandCarry: lambda s, c: s.hand_carry(c.source, c.target),
    commands.Answer: lambda s, c: s.answer(c.prompt, c.text),
    commands.SetSpeed: lambda s, c: s.set_speed(c.speed),
    commands.SetEyes: lambda s, c: s.set_eyes(on=c.on),
    commands.SetEyeParameter: lambda s, c: s.set_eye_parameter(c.parameter, c.value),
    commands.Record: _record,
    commands.Bumped: _bumped,
}
"""Jogging alone is somebody's, and is dealt with above."""
