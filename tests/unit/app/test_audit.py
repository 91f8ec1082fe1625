"""Ground truth against what the game says."""

import math
from typing import Any

import chess
import pytest

from kempelen.app.audit import PlacementAudit, disagreements, poses, standing_error
from kempelen.core.places import Layout, Place
from kempelen.core.table import Table

TABLE = Table()
KING, PAWN = chess.Piece.from_symbol("K"), chess.Piece.from_symbol("p")
E1, E2, D5 = Place("e1"), Place("e2"), Place("d5")


def stands(name: str, place: Place, dx: float = 0.0, dy: float = 0.0, tilt: float = 0.0) -> dict[str, Any]:
    x, y, z = TABLE.centre(place)
    kind = name[1].upper()
    return {
        "id": name, "kind": kind, "white": name[0] == "w", "x": x + dx, "y": y + dy, "z": z, "tilt": tilt,
    }  # fmt: skip


def truth(*pieces: dict[str, Any]) -> dict[str, Any]:
    return {"pieces": list(pieces)}


def audit(*pieces: dict[str, Any]) -> PlacementAudit:
    return PlacementAudit(TABLE, poses(truth(*pieces)))


def test_the_error_is_the_distance_from_the_places_centre() -> None:
    done = audit(stands("wk", E1), stands("bp", D5))
    done.after_move({E2: KING}, truth(stands("wk", E2, 3.0, 4.0), stands("bp", D5)))
    summary = done.summary()
    assert done.errors == [pytest.approx(5.0)]
    assert (summary.n, summary.max_mm, summary.toppled, summary.neighbour_max_mm) == (1, 5.0, 0, 0.0)
    assert done.collisions == 0
    assert done.lost == []


def test_a_neighbour_that_was_pushed_is_a_collision_once() -> None:
    done = audit(stands("wk", E1), stands("bp", D5))
    pushed = stands("bp", D5, 1.5)
    done.after_move({E2: KING}, truth(stands("wk", E2), pushed))
    done.after_move({E1: KING}, truth(stands("wk", E1), pushed))
    assert done.neighbours == [pytest.approx(1.5), 0.0]
    assert done.collisions == 1
    assert done.errors == [0.0, 0.0]


def test_pieces_that_fell_are_counted_when_they_fall() -> None:
    lying = math.radians(85)
    done = audit(stands("wk", E1), stands("bp", D5))
    fallen = stands("bp", D5, tilt=lying)
    done.after_move({E2: KING}, truth(stands("wk", E2), fallen))
    assert done.toppled == 1
    done.after_move({E1: KING}, truth(stands("wk", E1), fallen))
    assert done.toppled == 1


def test_a_piece_that_did_not_arrive_is_named() -> None:
    done = audit(stands("wk", E1), stands("bp", D5))
    done.after_move({E2: KING}, truth(stands("wk", E1), stands("bp", D5)))
    assert done.errors == [pytest.approx(50.0)]
    assert done.lost == ["e2 should hold K, nearest is wk at 50.0 mm"]
    done.after_move({D5: KING}, truth(stands("wk", E1), stands("bp", D5)))
    assert done.lost[1].startswith("d5 should hold K, nearest is bp")


def test_nothing_measured_is_no_error() -> None:
    summary = audit().summary()
    assert (summary.n, summary.max_mm, summary.neighbour_max_mm) == (0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("pieces", "wrong"),
    [
        ((stands("wk", E1), stands("bp", D5, 4.0)), []),
        ((stands("wk", E1),), ["d5: the game says p, the table has nothing"]),
        ((stands("wk", D5), stands("bp", E1)), [
            "e1: the game says K, the table has bp", "d5: the game says p, the table has wk",
        ]),
        ((stands("wk", E1, tilt=1.0), stands("bp", D5)), ["e1: K has fallen over"]),
        ((stands("wk", E1, 6.0), stands("bp", D5)), ["e1: the game says K, the table has nothing"]),
    ],
)  # fmt: skip
def test_table_and_game_compared(pieces: tuple[dict[str, Any], ...], wrong: list[str]) -> None:
    assert disagreements(TABLE, Layout({E1: KING, D5: PAWN}), truth(*pieces)) == wrong


def test_what_the_game_never_moved_does_not_count_for_how_well_it_places() -> None:
    begun = Layout({E1: KING, D5: PAWN})
    seen = truth(stands("wk", E2, 0.0, 0.5), stands("bp", D5, 3.0))
    assert standing_error(TABLE, begun, begun, seen) == 0.0
    assert standing_error(TABLE, begun, Layout({E2: KING, D5: PAWN}), seen) == pytest.approx(0.5)
