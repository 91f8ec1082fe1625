"""Whole games in the page, by mouse and by keys."""

import re

from playwright.sync_api import expect

from kempelen.testing.pages import BACK_RANK, FAST, Serve, Visitor, Visitors

PAWN_BEFORE_ITS_LAST_STEP = "8/P7/4p3/4P3/8/1k6/8/6K1 w - - 0 1"


def test_from_a_fresh_start_through_the_camera_to_mate(serve: Serve, visitors: Visitors) -> None:
    """Pieces dragged in the page are moved by the virtual hand; the game knows by seeing them alone."""
    somebody = Visitor(visitors.open(serve(*FAST, engine="").link)).ready()
    somebody.go("New game")
    page = somebody.page
    page.get_by_text("Set one up").click()
    page.get_by_role("textbox", name="FEN").fill(BACK_RANK)
    expect(page.get_by_text("A game can begin here.")).to_be_visible()
    somebody.set_level("1")
    somebody.button("Begin").click()

    somebody.drag("e2", "e8")
    somebody.played("Qe8", "Rxe8")
    somebody.drag("e1", "e8")
    over = page.get_by_role("region", name="Game over")
    expect(over.get_by_role("heading")).to_have_text("White wins")
    expect(over).to_contain_text("by checkmate")
    game = somebody.topic("game")
    assert game["by_hand"]
    assert (game["result"], [move["san"] for move in game["moves"]]) == ("1-0", ["Qe8+", "Rxe8", "Rxe8#"])


def test_a_pawn_becomes_a_knight(operator: Visitor) -> None:
    operator.new_game(PAWN_BEFORE_ITS_LAST_STEP)
    operator.drag("a7", "a8")
    dialog = operator.page.get_by_role("dialog", name="Promote the pawn to")
    dialog.get_by_role("button", name="knight").click()
    operator.played("a8=N", ".+")
    expect(operator.square("a8")).to_have_accessible_name("a8, white knight")
    operator.my_turn()
    assert operator.topic("game")["fen"].startswith("N7/")


def test_a_move_by_keys_alone(operator: Visitor) -> None:
    """From the top of the page by Tab to the board, then by arrows; the screen reader hears of it."""
    operator.new_game()
    page = operator.page
    page.locator("body").press("Tab")
    expect(page.get_by_role("link", name="Skip to the content")).to_be_focused()
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    expect(operator.square("e2")).to_be_focused()
    for key in ("Enter", "ArrowUp", "ArrowUp"):
        page.keyboard.press(key)
    expect(operator.square("e4")).to_be_focused()
    expect(operator.square("e4")).to_have_accessible_name(re.compile("can go here"))
    page.keyboard.press("Enter")
    operator.played("e4", ".+")
    expect(page.get_by_role("log", name="News")).to_contain_text("Your move.")


def test_two_operators_and_somebody_who_looks_on(serve: Serve, visitors: Visitors) -> None:
    server = serve()
    first = Visitor(visitors.open(server.link)).ready()
    link = first.post("links", {"role": "operator"})["url"]
    second = Visitor(visitors.open(link))
    watcher = Visitor(visitors.open(server.origin))
    third = Visitor(visitors.open(server.link))  # of a link that was used
    expect(third.note("This link was used before, or is too old.")).to_be_visible()
    assert third.get("me")["role"] == "spectator"

    first.new_game(BACK_RANK)
    second.drag("e2", "e8")
    for one in (first, second, watcher):
        one.played("Qe8", "Rxe8")
    first.drag("e1", "e8")
    for one in (second, watcher):
        expect(one.page.get_by_role("heading", name="White wins")).to_be_visible()
    assert first.topic("clients")["operators"] == 2

    expect(watcher.page.get_by_role("button", name="Emergency stop")).to_have_count(0)
    expect(watcher.page.locator(".controls")).to_have_count(0)
    for name in ("estop", "leave_game", "pause"):
        reply = watcher.order(name)
        assert not reply["ok"]
        assert reply["error"]
    assert "error" in watcher.post("links", {"role": "operator"})
