"""Whole games in the page."""

from playwright.sync_api import expect

from kempelen.testing.pages import Visitor

PAWN_BEFORE_ITS_LAST_STEP = "8/P7/4p3/4P3/8/1k6/8/6K1 w - - 0 1"


def test_a_pawn_becomes_a_knight(operator: Visitor) -> None:
    operator.new_game(PAWN_BEFORE_ITS_LAST_STEP)
    operator.drag("a7", "a8")
    dialog = operator.page.get_by_role("dialog", name="Promote the pawn to")
    dialog.get_by_role("button", name="knight").click()
    operator.played("a8=N", ".+")
    expect(operator.square("a8")).to_have_accessible_name("a8, white knight")
    operator.my_turn()
    assert operator.topic("game")["fen"].startswith("N7/")
