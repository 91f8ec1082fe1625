"""Every state of error, on the screen: what is wrong in plain words, and the next step."""

import re
import socket

from playwright.sync_api import Page, expect

from kempelen.testing.pages import BACK_RANK, FAST, Serve, Visitor, Visitors, ask_twin

FLAT = True


def test_no_robot_at_a_port(operator: Visitor) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    operator.go("Setup")
    page = operator.page
    page.get_by_label("Another port or network address").fill(f"socket://127.0.0.1:{port}")
    page.locator("form").get_by_role("button", name="Connect").click()
    expect(operator.note(re.compile(f"127.0.0.1:{port}"))).to_be_visible()
    expect(
        operator.fault("The table could not be set up").get_by_role("button", name="Connect")
    ).to_be_visible()


def test_an_alarm(serve: Serve, visitors: Visitors) -> None:
    """A reference switch that never closes."""
    server = serve()
    operator = Visitor(visitors.open(server.link)).ready()
    ask_twin(server, "fault", name="dead-switch", axis="x")
    operator.go("Setup")
    operator.button("Home again").click()
    alarm = operator.fault("The robot has raised an alarm")
    expect(alarm).to_be_visible()
    ask_twin(server, "fault", name="dead-switch", axis="x", on=False)
    alarm.get_by_role("button", name="Recover").click()
    operator.fault("The robot must be homed").get_by_role("button", name="Home the robot").click()
    expect(operator.page.get_by_role("region", name="What is wrong").get_by_role("article")).to_have_count(0)
    operator.ready()


def test_a_game_whose_wire_breaks(serve: Serve, visitors: Visitors) -> None:
    server = serve()
    operator = Visitor(visitors.open(server.link)).ready()
    operator.new_game(BACK_RANK)
    operator.must("move", uci="e2e8")
    ask_twin(server, "fault", name="drop-link")
    cut = operator.fault("The game was cut off")
    expect(cut).to_contain_text("The game is kept.")
    cut.get_by_role("button").click()
    operator.played("Qe8", "Rxe8")


def test_a_covered_camera(serve: Serve, visitors: Visitors) -> None:
    server = serve(*FAST)
    operator = Visitor(visitors.open(server.link)).ready()
    operator.new_game(BACK_RANK)
    operator.go("Eyes")
    page = operator.page
    expect(page.get_by_text("sees the board")).to_be_visible()
    ask_twin(server, "camera", change={"lighting": {"covered": True}})
    expect(page.get_by_text("Switch the light on, or uncover the lens.")).to_be_visible()
    ask_twin(server, "camera", change={"lighting": {"covered": False}})
    expect(page.get_by_text("sees the board")).to_be_visible()


def test_an_engine_that_is_not_there(serve: Serve, visitors: Visitors) -> None:
    operator = Visitor(visitors.open(serve(engine="/no/such/engine").link)).ready()
    operator.button(re.compile("^Play against the engine")).click()
    expect(operator.note("is neither a file nor a program that is installed here.")).to_be_visible()
    expect(operator.note("Choose another engine for this game")).to_be_visible()


def test_a_move_that_is_illegal(operator: Visitor) -> None:
    operator.new_game()
    page = operator.page
    page.get_by_role("textbox", name="Type a move").fill("Ke7")
    operator.button("Play").click()
    expect(page.get_by_role("alert").filter(has_text="“Ke7” is no legal move here.")).to_be_visible()
    reply = operator.order("move", uci="e2e5")
    assert not reply["ok"]
    assert reply["hint"].startswith("20 moves are legal here")


UNPLAYABLE = {
    "1. e4 e5 2. Ke3 Nc6": "Ke3",
    "nothing of chess": "This is no game in PGN",
    '[White "Somebody"]\n[Black "Else"]\n\n1. e4 e5 2. Ke3 Nc6 *\n': "Ke3",
}


def test_pgns_that_cannot_be_played(guest: Visitor, visitors: Visitors) -> None:
    """Text without tags is read at once; what has tags is listed, and read when it is to be played."""
    visitors.expected.append("status of 409")
    page = guest.page
    guest.go("New game")
    guest.button(re.compile("^Replay")).click()
    for text, words in UNPLAYABLE.items():
        page.get_by_role("textbox", name="… or paste it").fill(text)
        guest.button("Read it").click()
        if text.startswith("["):
            guest.button("Begin").click()
        expect(page.get_by_role("log", name="Notes")).to_contain_text(words)
        page.get_by_role("log", name="Notes").get_by_role("button", name="Close").first.click()
        expect(page.get_by_role("log", name="Notes")).to_be_empty()


BAD_POSITIONS = {
    "not a position": "This is no position in FEN.",
    "8/8/8/8/8/8/8/K7 w - - 0 1": "Black needs exactly one king.",
    "4k3/8/8/8/8/8/8/P3K3 w - - 0 1": "No pawn can stand on the first or the last rank.",
    "4k3/4R3/8/8/8/8/8/4K3 w - - 0 1": "The side that is not to move is in check.",
}


def test_positions_that_are_none(guest: Visitor) -> None:
    guest.go("New game")
    page = guest.page
    page.get_by_text("Set one up").click()
    for fen, words in BAD_POSITIONS.items():
        page.get_by_role("textbox", name="FEN").fill(fen)
        expect(page.get_by_role("listitem").filter(has_text=words)).to_be_visible()
        expect(guest.button("Begin")).to_be_disabled()


def test_a_table_that_does_not_fit(guest: Visitor) -> None:
    guest.go("Calibrate")
    page = guest.page
    page.get_by_role("tab", name="Trays and pieces").click()
    add_tray_far_away(page)
    expect(page.get_by_text(re.compile("Does not fit: "))).to_be_visible()


def add_tray_far_away(page: Page) -> None:
    x = page.get_by_role("spinbutton", name="x, mm").first
    x.fill("2000")
    x.blur()


def test_a_page_that_is_none(guest: Visitor) -> None:
    guest.page.goto(f"{guest.page.url}no/such/page")
    expect(guest.page.get_by_role("heading", name="There is no such page.")).to_be_visible()
