"""What engines are at hand and whether they work, for ``kempelen doctor``."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import chess

from kempelen.core.errors import KempelenError
from kempelen.engines.find import EngineProgram, Shelf, Source
from kempelen.engines.program import Habits, ProgramEngine
from kempelen.engines.strength import FULL, Level, Means

_TRIAL_SECONDS = 0.05


@dataclass(frozen=True, slots=True)
class EngineReport:
    """What was found out about one engine.

    Attributes:
        name: As it calls itself, or as it was asked for.
        path: Of the program; empty when there is none.
        source: Where it was found, in words.
        options: The options it offers, by name: type and range in words.
        works: It has named a move.
        tongue: The protocol that it speaks.
        fault: Why it does not work.
        hint: What to do about it.
    """

    name: str
    path: str = ""
    source: str = ""
    options: Mapping[str, str] = field(default_factory=dict)
    works: bool = False
    tongue: str = ""
    fault: str = ""
    hint: str = ""


async def probe(named: str = "", *, shelf: Shelf | None = None) -> tuple[EngineReport, ...]:
    """Try the engine that would be used, and a Maia network if there is one; faults are in the reports."""
    shelf = shelf or Shelf.here()
    try:
        reports = [await _try(shelf.find(named), FULL)]
    except KempelenError as error:
        reports = [EngineReport(named or "engine", fault=error.message, hint=error.hint)]
    for elo in shelf.maia_elos[:1]:
        reports.append(await _try(shelf.maia(elo), Level(Means.MAIA, elo)))
    return tuple(reports)


async def probe_all(*, shelf: Shelf | None = None) -> tuple[EngineReport, ...]:
    """Try every engine that is found here: the best at hand, a Maia network, and others known by name."""
    shelf = shelf or Shelf.here()
    reports = list(await probe(shelf=shelf))
    tried = {report.path for report in reports}
    for name in shelf.others():
        program = replace(shelf.find(name), source=Source.PATH)
        if program.command[0] not in tried:
            reports.append(await _try(program, FULL))
    return tuple(reports)


async def _try(program: EngineProgram, level: Level) -> EngineReport:
    path, source = program.command[0], str(program.source)
    try:
        async with ProgramEngine(program, level, Habits(seconds=_TRIAL_SECONDS)) as engine:
            await engine.choose(chess.Board())
            tongue = engine.tongue or ""
            return EngineReport(engine.name, path, source, engine.options, works=True, tongue=tongue)
    except KempelenError as error:
        return EngineReport(program.name, path, source, fault=error.message, hint=error.hint)
