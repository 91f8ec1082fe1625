"""What comes between: pauses, stops, deaths, another board, other players."""

import re
from pathlib import Path

from playwright.sync_api import expect

from kempelen.testing.pages import BACK_RANK, BLIND, Serve, Visitor, Visitors

SLOWLY = 0.5  # so that there is time to press a button
SCHOLAR = '[White "Somebody"]\n[Black "Else"]\n\n1. e4 e5 2. Bc4 Nc6 3. Qh5 Nf6 4. Qxf7# 1-0\n'
FINGERTIPS = 7.0  # mm below the tool point
IN_TRANSFER = "Paused in mid-move, perhaps with a piece in the gripper"
FLAT = True


def test_paused_with_a_piece_in_the_gripper_and_loaded_anew(operator: Visitor) -> None:
    operator.new_game(BACK_RANK)
    operator.must("speed", speed=SLOWLY)
    operator.drag("e2", "e8")
    operator.doing("carrying")
    operator.button("Pause").click()
    operator.status(IN_TRANSFER)
    assert operator.topic("robot")["gripper"] == "closed"

    operator.page.reload()
    operator.status(IN_TRANSFER)
    expect(operator.button("Finish this move")).to_be_visible()
    operator.must("speed", speed=0)
    operator.button("Go on").click()
    operator.played("Qe8", "Rxe8")
    operator.my_turn()


def test_the_emergency_stop_and_back_into_the_game(operator: Visitor) -> None:
    operator.new_game(BACK_RANK)
    operator.must("speed", speed=SLOWLY)
    operator.drag("e2", "e8")
    operator.doing("carrying")
    operator.stop()
    stopped = operator.fault("Emergency stop")
    expect(stopped).to_contain_text("the game is kept")
    stopped.get_by_role("button", name="Recover").click()
    operator.must("speed", speed=0)
    stopped.get_by_role("button", name="Home the robot").click()
    stopped.get_by_role("button", name="Go on with the game").click()
    operator.played("Qe8", "Rxe8")
    operator.my_turn()
    assert operator.topic("game")["number"] == 1


def test_the_stop_is_a_key_too(operator: Visitor) -> None:
    """At rest nothing is lost but the place of the robot."""
    unhomed = operator.fault("The robot must be homed")
    expect(unhomed).to_have_count(0)  # the twin is homed by itself
    operator.page.keyboard.press("F8")
    expect(unhomed.get_by_role("button", name="Home the robot")).to_be_visible()
    expect(operator.page.get_by_role("alert").filter(has_text="Emergency stop sent.")).to_be_attached()


def test_others_take_over_in_the_midst_of_a_replay(operator: Visitor) -> None:
    operator.go("New game")
    operator.button(re.compile("^Replay")).click()
    page = operator.page
    page.get_by_role("textbox", name="… or paste it").fill(SCHOLAR)
    operator.button("Read it").click()
    operator.must("speed", speed=2 * SLOWLY)
    operator.button("Begin").click()
    operator.played("e4")
    operator.button("Pause").click()
    operator.must("speed", speed=0)
    operator.button("Other players").click()
    page.get_by_role("dialog").get_by_role("button", name="I play White").click()
    if operator.topic("game")["in_transfer"]:
        expect(page.get_by_text("Paused: this is done when you press Go on")).to_be_visible()
    operator.button("Go on").click()  # they take over when the move in hand is done
    expect(operator.note("Others play on from here.")).to_be_visible()
    operator.my_turn()
    game = operator.topic("game")
    assert game["mode"] == "play"
    assert game["moves"][0]["san"] == "e4"
    assert game["number"] == 1


def test_the_board_is_measured_in_the_midst_of_a_game(operator: Visitor) -> None:
    operator.new_game(BACK_RANK)
    operator.go("Calibrate")
    page = operator.page
    operator.button("Measure the board").click()
    expect(page.get_by_text(re.compile("^Drive the closed fingertips .* of a1"))).to_be_visible()
    board = operator.get("scene")["board"]
    (x, y, z), side, high = board["origin"], board["square"], operator.tool()[2]
    for corner, squares in {"a1": 0, "h8": 8}.items():
        operator.rise(high)
        operator.drive_to(x + squares * side, y + squares * side, z + FINGERTIPS)
        operator.button(re.compile(f"^Touch {corner}")).click()
        expect(operator.note(f"Corner {corner} taken.")).to_be_visible()
    operator.button("Apply").click()
    expect(operator.note("The board is calibrated; the game goes on.")).to_be_visible()
    operator.go("Game")
    operator.drag("e2", "e8")
    operator.played("Qe8", "Rxe8")
    assert operator.topic("station")["calibrated"]


def test_the_server_is_killed_and_comes_back_under_an_open_page(
    serve: Serve, visitors: Visitors, tmp_path: Path
) -> None:
    visitors.expected.append(r"WebSocket connection|Failed to load resource|net::ERR_CONNECTION")
    data = tmp_path / "data"
    server = serve(*BLIND, data=data)
    operator = Visitor(visitors.open(server.link)).ready()
    operator.new_game(BACK_RANK)
    operator.drag("e2", "e8")
    operator.played("Qe8", "Rxe8")
    operator.my_turn()
    server.kill()
    lost = operator.page.get_by_role("alert").filter(has_text="The connection to the server is lost.")
    expect(lost).to_be_visible()
    serve(*BLIND, data=data, port=int(server.origin.rpartition(":")[2]))
    expect(lost).to_be_hidden()
    operator.ready()
    operator.button(re.compile("^Go on with the last game")).click()
    operator.played("Qe8", "Rxe8")
    operator.drag("e1", "e8")
    expect(operator.page.get_by_role("heading", name="White wins")).to_be_visible()
    assert operator.get("me")["role"] == "operator"
