"""The virtual reed board: currents, magnets, debounce; ghosts shown and named."""

import chess
import numpy as np
import pytest

from kempelen.core.geometry import Transform
from kempelen.core.reed import Change, Finding, Wiring, square_name, squares_in
from kempelen.twin.reed.magnets import Magnets
from kempelen.twin.reed.matrix import Matrix, Scan
from kempelen.twin.reed.scanner import CHATTER_MS, DEBOUNCE_MS, Scanner, Told


def squares(*names: str) -> int:
    return sum(1 << chess.parse_square(name) for name in names)


def names(mask: int) -> set[str]:
    return {square_name(square) for square in squares_in(mask)}


THREE = squares("b2", "b5", "f2")


def test_three_corners_feign_the_fourth_without_diodes() -> None:
    scan = Matrix(Wiring.PLAIN).scan(THREE)
    assert names(scan.closed) == {"b2", "b5", "f2", "f5"}
    assert "f5" in names(scan.doubtful)


@pytest.mark.parametrize("wiring", [Wiring.DIODES, Wiring.DIRECT])
def test_and_do_not_with_diodes_or_inputs_of_their_own(wiring: Wiring) -> None:
    scan = Matrix(wiring).scan(THREE)
    assert (scan.closed, scan.doubtful, scan.suspects) == (THREE, 0, [])


def test_one_missing_diode_feigns_the_corner_opposite_to_it() -> None:
    scan = Matrix(bare=squares("b2")).scan(THREE)
    assert names(scan.closed & ~THREE) == {"f5"}
    assert "f5" in names(scan.doubtful)
    assert any(names(some) >= {"b2"} for some in scan.suspects)


def test_what_reads_open_is_open_whatever_is_missing() -> None:
    rng = np.random.default_rng(7)
    for _ in range(100):
        contacts, bare = (int(rng.integers(0, 2**63)) & int(rng.integers(0, 2**63)) for _ in range(2))
        scan = Matrix(bare=bare).scan(contacts)
        assert scan.closed & contacts == contacts
        assert (scan.closed & ~contacts) & ~scan.doubtful == 0


def test_stuck_switches() -> None:
    matrix = Matrix(stuck_closed=squares("e4"), stuck_open=squares("e2"))
    assert names(matrix.contacts(squares("e2", "d2"))) == {"e4", "d2"}


class Board:
    """A scanner fed a millisecond at a time."""

    def __init__(self, matrix: Matrix, contacts: int) -> None:
        self.matrix, self.scanner, self.now = matrix, Scanner(), 0
        self.scanner.begin(matrix.scan(matrix.contacts(contacts)))
        self.told: list[Told] = []

    def hold(self, contacts: int, ms: int) -> None:
        for _ in range(ms):
            self.now += 1
            self.told += self.scanner.step(self.now, self.matrix.scan(self.matrix.contacts(contacts)))

    @property
    def changes(self) -> list[str]:
        return [
            f"{'+' if each.placed else '-'}{square_name(each.square)}{'?' if each.doubtful else ''}"
            for each in self.told
            if isinstance(each, Change)
        ]


def test_a_bounce_is_one_event_with_the_time_of_its_first_edge() -> None:
    board = Board(Matrix(), 0)
    for contacts in (0, 1, 0, 0, 1, 0, 1):
        board.hold(contacts, 1)
    board.hold(1, DEBOUNCE_MS + 5)
    (change,) = board.told
    assert change == Change(0, 2, 0, placed=True)


def test_a_touch_shorter_than_the_debounce_is_nothing() -> None:
    board = Board(Matrix(), 1)
    board.hold(0, DEBOUNCE_MS - 1)
    board.hold(1, 100)
    assert board.told == []


def test_the_order_of_first_edges_is_kept_though_the_first_bounces_longer() -> None:
    a1, b1 = 1, 2
    board = Board(Matrix(), 0)
    for step in range(15):
        board.hold(a1 * (step % 2) | (b1 if step > 3 else 0), 1)
    board.hold(a1 | b1, 100)
    assert board.changes == ["+a1", "+b1"]


def test_a_switch_that_does_not_come_to_rest_is_named_and_bars_no_other() -> None:
    board = Board(Matrix(), 0)
    for step in range(CHATTER_MS):
        board.hold(step // 5 % 2 | (2 if step > 100 else 0), 1)
    board.hold(2, 50)
    assert [each.what for each in board.told if isinstance(each, Finding)] == ["chatter"]
    assert "+b1" in board.changes


def test_a_missing_diode_is_narrowed_down_to_one() -> None:
    """Others in its row were seen to have theirs."""
    board = Board(Matrix(), squares("b2", "f2", "f5"))
    board.hold(squares("b2", "f2", "f5"), 5)
    board.matrix.bare = squares("b2")
    board.hold(squares("b2", "f2", "b5"), 100)
    found = [each for each in board.told if isinstance(each, Finding)]
    assert names(found[-1].squares) == {"b2"}


def test_a_ghost_is_told_with_its_doubt() -> None:
    board = Board(Matrix(bare=squares("b2")), squares("b2", "f2"))
    board.hold(THREE, 100)
    assert set(board.changes) == {"+b5?", "+f5?"}
    assert names(board.scanner.snapshot(board.now).doubtful) >= {"f5"}


def test_magnets_close_near_and_open_farther_away() -> None:
    magnets = Magnets(Transform.identity(), 50.0, closing=0.3, opening=0.36, bounce_ms=0.0)
    up = np.array([[0.0, 0.0, 1.0]])

    def at(x: float, z: float = 0.0, axis: np.ndarray = up) -> set[str]:
        return names(magnets.move(0.0, ["wP0"], np.array([[25.0 + x, 25.0, z]]), axis))

    assert at(15.5) == set()
    assert at(14.5) == {"a1"}
    assert at(17.5) == {"a1"}
    assert at(18.5) == set()
    assert at(0.0, 30.0) == set()
    assert at(0.0, axis=np.array([[1.0, 0.0, 0.0]])) == set()
    magnets.weak = {"wP0": 0.3}
    assert at(5.5) == set()
    assert at(0.0) == {"a1"}


def test_contacts_bounce_and_come_to_rest() -> None:
    magnets = Magnets(Transform.identity(), 50.0, bounce_ms=8.0, seed=3)
    here = np.array([[25.0, 25.0, 0.0]])
    magnets.move(0.0, ["wP0"], here, np.array([[0.0, 0.0, 1.0]]))
    readings = {magnets.reading(ms / 4) for ms in range(32)}
    assert readings == {0, 1}
    assert not magnets.bouncing(8.0)
    assert magnets.reading(8.0) == 1


def test_a_scan_of_nothing() -> None:
    assert Scan(0, (0,) * 8).doubtful == 0
