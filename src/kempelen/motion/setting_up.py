"""Setting up a position: from what stands anywhere to a wanted board, with the fewest transfers.

Pieces of one kind and colour are alike. A piece that stands on a square which does not want its kind moves
once; so does each piece that has to come from a tray. More is needed only where kinds stand in each other's
way in a ring: in the graph whose nodes are kinds, with an edge from the kind that stands to the kind that is
wanted on each square that holds a wrong piece, a connected component without a way out (an empty wanted
square, or a piece that leaves the board) is made of rings alone. All its rings can be made one by exchanging
the targets of pieces that are alike, and one ring costs one transfer more, through a free place. Hence::

    fewest = from the trays + misplaced on the board + components without a way out

Which of the pieces that are alike goes where, and in which order, is chosen for little travel.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Self

import chess
import numpy as np
from scipy.optimize import linear_sum_assignment

from kempelen.core.errors import OperatorNeededError
from kempelen.core.geometry import Array
from kempelen.core.pieces import piece_name
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.table import Table

_FIRST = 1e6
"""mm: outweighs every way, so that a piece on the board is used before one in a tray."""


@dataclass(frozen=True, slots=True)
class SettingUp:
    """How to set up a position.

    Attributes:
        transfers: In order; each target is free when its piece arrives.
        fewest: Transfers that no plan can do without.
        carried: Horizontal way with a piece in the hand, mm.
        empty: Horizontal way of the empty hand between the transfers, mm.
    """

    transfers: tuple[Transfer, ...]
    fewest: int
    carried: float
    empty: float

    @property
    def travel(self) -> float:
        """The hand's whole horizontal way, mm."""
        return self.carried + self.empty


@dataclass(frozen=True, slots=True)
class Differences:
    """What separates a table from a wanted board.

    Attributes:
        wrong: Squares on which a piece stands that is not wanted there.
        unfilled: Squares that want a piece which does not stand there.
    """

    wrong: Mapping[chess.Square, chess.Piece]
    unfilled: Mapping[chess.Square, chess.Piece]

    @classmethod
    def between(cls, standing: Layout, wanted: Mapping[chess.Square, chess.Piece]) -> Self:
        """Of what stands and what is wanted."""
        board = standing.board_part()
        return cls(
            {square: piece for square, piece in board.items() if wanted.get(square) != piece},
            {square: piece for square, piece in wanted.items() if board.get(square) != piece},
        )

    @property
    def fetched(self) -> int:
        """Pieces that have to come from the trays."""
        return (Counter(self.unfilled.values()) - Counter(self.wrong.values())).total()

    @property
    def leaving(self) -> int:
        """Pieces that have to leave the board."""
        return (Counter(self.wrong.values()) - Counter(self.unfilled.values())).total()

    def lacking(self, standing: Layout) -> list[chess.Piece]:
        """Pieces that are wanted and stand nowhere, a kind as often as it is lacking."""
        trays = Counter(piece for place, piece in standing.items() if not place.is_square)
        lacking = Counter(self.unfilled.values()) - Counter(self.wrong.values()) - trays
        return sorted(lacking.elements(), key=str)

    @property
    def fewest(self) -> int:
        """The least number of transfers, by the formula above."""
        return self.fetched + len(self.wrong) + _rings(self.wrong, self.unfilled)


def _rings(wrong: Mapping[chess.Square, chess.Piece], unfilled: Mapping[chess.Square, chess.Piece]) -> int:
    """Connected components of kinds without a way out."""
    ways_out = {piece for square, piece in unfilled.items() if square not in wrong}
    ways_out |= set(Counter(wrong.values()) - Counter(unfilled.values()))
    linked: dict[chess.Piece, set[chess.Piece]] = defaultdict(set)
    for square in wrong.keys() & unfilled.keys():
        held, meant = wrong[square], unfilled[square]
        linked[held].add(meant)
        linked[meant].add(held)
    count, seen = 0, set[chess.Piece]()
    for piece in linked:
        if piece not in seen:
            component = _reached(piece, linked)
            seen |= component
            count += not component & ways_out
    return count


def _reached(piece: chess.Piece, linked: Mapping[chess.Piece, set[chess.Piece]]) -> set[chess.Piece]:
    found, front = {piece}, [piece]
    while front:
        new = linked[front.pop()] - found
        found |= new
        front.extend(new)
    return found


def plan_setting_up(
    table: Table, standing: Layout, wanted: Mapping[chess.Square, chess.Piece], start: Array | None = None
) -> SettingUp:
    """The transfers that set up a position.

    Args:
        table: For the distances, and for the slots of pieces that leave the board.
        standing: What stands where now, trays included.
        wanted: What shall stand on the board, as python-chess's piece map; an empty square is wanted empty.
        start: (2,) or (3,) where the hand is at first, robot frame, mm; default above the first piece.

    Raises:
        OperatorNeededError: the table lacks a piece that is wanted, or the trays have no room; the message
            says which and how many.
    """
    planner = _Planner(table, standing, wanted)
    planner.assign()
    planner.merge_rings()
    return planner.in_order(start)


class _Planner:
    """One plan in the making; ``target[source]`` is where the piece that stands on ``source`` goes."""

    def __init__(self, table: Table, standing: Layout, wanted: Mapping[chess.Square, chess.Piece]) -> None:
        self._places = table.places
        self._number = {place: number for number, place in enumerate(self._places)}
        self._centres = np.array([table.centre(place)[:2] for place in self._places])
        across = self._centres[:, None, :] - self._centres[None, :, :]
        self._way = np.hypot(across[..., 0], across[..., 1])  # (places, places) mm
        self._standing, self._differences = standing, Differences.between(standing, wanted)
        self._piece = {self._number[place]: piece for place, piece in standing.items()}
        self._slots = [self._number[slot] for slot in table.slots]
        self.target: dict[int, int] = {}

    # --- who goes where -------------------------------------------------------------------------------------

    def assign(self) -> None:
        """The cheapest pairs of pieces and targets, kind by kind; surplus pieces to near slots."""
        self._require()
        wrong, trays, unfilled = self._sorted_out()
        leaving: list[int] = []
        for piece in sorted({*wrong, *unfilled}, key=str):
            leaving += self._match(wrong[piece], trays[piece], unfilled[piece])
        self._leave(leaving)

    def _sorted_out(self) -> tuple[dict[chess.Piece, list[int]], ...]:
        """By kind and colour: where wrong pieces stand, where tray pieces stand, which squares lack one."""
        wrong, trays, unfilled = (defaultdict[chess.Piece, list[int]](list) for _ in range(3))
        for square, piece in sorted(self._differences.wrong.items()):
            wrong[piece].append(self._number[Place.at(square)])
        for place, piece in sorted(self._standing.items()):
            if not place.is_square:
                trays[piece].append(self._number[place])
        for square, piece in sorted(self._differences.unfilled.items()):
            unfilled[piece].append(self._number[Place.at(square)])
        return wrong, trays, unfilled

    def _require(self) -> None:
        if lacking := Counter(self._differences.lacking(self._standing)):
            named = ", ".join(f"{count} x {piece_name(piece)}" for piece, count in lacking.items())
            raise OperatorNeededError(
                f"The table lacks pieces for this position: {named}.",
                hint="Stand them into free slots of the trays, or choose a position of the pieces at hand.",
            )

    def _match(self, wrong: list[int], trays: list[int], unfilled: list[int]) -> list[int]:
        """Pair sources with unfilled squares; the wrong pieces that are left over leave the board."""
        cost = self._way[np.ix_(wrong + trays, unfilled)].copy()
        cost[: len(wrong)] -= _FIRST
        if len(wrong) > len(unfilled):
            nearest = (
                self._way[np.ix_(wrong, self._slots)].min(axis=1) if self._slots else np.zeros(len(wrong))
            )
            cost[: len(wrong)] -= nearest[:, None]  # what leaving would cost instead
        rows, columns = linear_sum_assignment(cost)
        sources = wrong + trays
        pairs = {sources[row]: unfilled[column] for row, column in zip(rows, columns, strict=True)}
        self.target |= pairs
        return [source for source in wrong if source not in pairs]

    def _leave(self, leaving: list[int]) -> None:
        """To free slots, and where these do not suffice to such as will be free."""
        free = [slot for slot in self._slots if slot not in self._piece]
        if len(free) < len(leaving):
            free += [slot for slot in self._slots if slot in self.target]
        if len(free) < len(leaving):
            raise OperatorNeededError(
                f"The trays have {len(leaving) - len(free)} free slots too few for what leaves the board "
                f"({len(leaving)}).",
                hint="Take pieces that nobody needs out of the trays.",
            )
        rows, columns = linear_sum_assignment(self._way[np.ix_(leaving, free)])
        self.target |= {leaving[row]: free[column] for row, column in zip(rows, columns, strict=True)}

    # --- rings ----------------------------------------------------------------------------------------------

    def merge_rings(self) -> None:
        """Exchange targets of like pieces until no ring shares a kind with anything else that moves."""
        while (exchange := self._cheapest_exchange()) is not None:
            one, other = exchange
            self.target[one], self.target[other] = self.target[other], self.target[one]

    def _cheapest_exchange(self) -> tuple[int, int] | None:
        """A piece in a ring and one that is alike outside of it, at the least additional way."""
        best: tuple[float, int, int] | None = None
        for ring in self._rings_of(self.target):
            for one in ring:
                for other in self.target.keys() - ring:
                    if self._piece[one] == self._piece[other]:
                        candidate = (self._extra(one, other), one, other)
                        best = candidate if best is None or candidate < best else best
        return None if best is None else best[1:]

    def _extra(self, one: int, other: int) -> float:
        way, target = self._way, self.target
        before = way[one, target[one]] + way[other, target[other]]
        return float(way[one, target[other]] + way[other, target[one]] - before)

    @staticmethod
    def _rings_of(target: Mapping[int, int]) -> list[set[int]]:
        """Pieces each of which goes where the next one stands."""
        rings, seen = list[set[int]](), set[int]()
        for first in sorted(target):
            path, here = list[int](), first
            while here in target and here not in seen:
                seen.add(here)
                path.append(here)
                here = target[here]
            if here in path:
                rings.append(set(path[path.index(here) :]))
        return rings

    # --- order ----------------------------------------------------------------------------------------------

    def in_order(self, start: Array | None) -> SettingUp:
        """Nearest next piece whose target is free; a ring is opened where nothing else is left."""
        waiting, piece = dict(self.target), dict(self._piece)
        ways: list[tuple[int, int]] = []
        first = None if start is None else np.asarray(start, dtype=np.float64)[:2]
        while waiting:
            reach = self._reach(ways[-1][1] if ways else None, first)
            ready = [source for source, target in waiting.items() if target not in piece]
            if ready:
                source = min(ready, key=lambda source: (reach[source], source))
                target = waiting.pop(source)
            else:
                source, target = self._opening(waiting, piece, reach)
                waiting[target] = waiting.pop(source)
            piece[target] = piece.pop(source)
            ways.append((source, target))
        return self._told(ways, first)

    def _reach(self, here: int | None, first: Array | None) -> Array:
        """(places,) the way of the empty hand to each place, mm."""
        if here is not None:
            way: Array = self._way[here]
            return way
        if first is None:
            return np.zeros(len(self._places))
        from_first: Array = np.hypot(*(self._centres - first).T)
        return from_first

    def _opening(
        self, waiting: Mapping[int, int], piece: Mapping[int, chess.Piece], reach: Array
    ) -> tuple[int, int]:
        """The piece of a ring that waits on a free place, and that place, at the least additional way."""
        free = [number for number in range(len(self._places)) if number not in piece]
        if not free:
            raise OperatorNeededError(
                "No place on the table is free, so that no piece can be moved.",
                hint="Take pieces that nobody needs out of the trays.",
            )
        ringed = set[int]().union(*self._rings_of(waiting))
        sources = sorted(ringed)
        detour = (
            self._way[np.ix_(sources, free)]
            + self._way[np.ix_([waiting[s] for s in sources], free)]
            + (reach[sources] - [self._way[s, waiting[s]] for s in sources])[:, None]
        )
        row, column = np.unravel_index(int(detour.argmin()), detour.shape)
        return sources[int(row)], free[int(column)]

    def _told(self, ways: Iterable[tuple[int, int]], first: Array | None) -> SettingUp:
        piece, transfers, carried, empty = dict(self._piece), list[Transfer](), 0.0, 0.0
        here: int | None = None
        for source, target in ways:
            moved = piece[target] = piece.pop(source)
            transfers.append(Transfer(moved, self._places[source], self._places[target]))
            carried += float(self._way[source, target])
            empty += float(self._reach(here, first)[source])
            here = target
        return SettingUp(tuple(transfers), self._differences.fewest, carried, empty)
