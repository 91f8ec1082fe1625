"""A headset that is not there: a piece is taken with a controller and set down in VR."""

import json
from pathlib import Path
from typing import Any

from playwright.sync_api import Page, expect

from kempelen.testing.pages import Visitor

IWER = Path(__file__).parents[2] / "web" / "node_modules" / "iwer" / "build" / "iwer.min.js"
SCENE = "localStorage.setItem('kempelen.settings', JSON.stringify({ view: 'scene' }))"
DEVICE = """
window.headset = new IWER.XRDevice(IWER.metaQuest3);
headset.installRuntime({ forceInstall: true });
"""
MOVE_CONTROLLER = """
([x, y, z]) => new Promise((done) => {
  headset.controllers.right.position.set(x, y, z);
  requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done)));
})
"""
PRESS = """
(value) => new Promise((done) => {
  headset.controllers.right.updateButtonValue("trigger", value);
  requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done)));
})
"""
TABLE_HEIGHT = 0.76
STANDS_AT = 0.56
TIP = 0.02
SQUARE = 0.05


def controller_over(square: str, height: float) -> list[float]:
    """Where a controller that points ahead has to be, m, to have its tip so high over a square's middle."""
    x = (ord(square[0]) - ord("a") - 3.5) * SQUARE
    z = (3.5 - int(square[1]) + 1) * SQUARE
    return [x, TABLE_HEIGHT + height, z - STANDS_AT + TIP]


def sent_commands(page: Page) -> list[dict[str, Any]]:
    """Everything the page says over its WebSocket, as it comes."""
    sent: list[dict[str, Any]] = []

    def said(text: str | bytes) -> None:
        message = json.loads(text)
        if message["type"] == "command":
            sent.append(message["command"])

    page.on("websocket", lambda socket: socket.on("framesent", said))
    return sent


def test_a_pawn_is_taken_with_a_controller_and_set_down(operator: Visitor) -> None:
    page = operator.page
    operator.must("new_game", mode="play", level="full", move_time=0.02)
    page.add_init_script(SCENE)
    page.add_init_script(IWER.read_text(encoding="utf-8"))
    page.add_init_script(DEVICE)
    page.set_viewport_size({"width": 720, "height": 540})  # a processor draws what the headset shows
    sent = sent_commands(page)
    page.reload()
    expect(page.locator("canvas.ready")).to_be_visible()
    page.wait_for_function("document.querySelector('canvas.ready').pieceCount() > 0")
    operator.status("Your move")
    page.get_by_role("button", name="Enter VR").click()
    expect(page.get_by_role("button", name="Leave VR")).to_be_visible()
    page.evaluate(MOVE_CONTROLLER, controller_over("e2", 0.036))
    page.evaluate(PRESS, 1)
    page.evaluate(MOVE_CONTROLLER, controller_over("e3", 0.12))
    page.evaluate(MOVE_CONTROLLER, controller_over("e4", 0.036))
    page.evaluate(PRESS, 0)
    page.evaluate("headset.activeSession.end()")  # what stands for the headset covers the page's own button
    expect(page.get_by_role("button", name="Enter VR")).to_be_visible()
    operator.played("e4")
    moves = [command for command in sent if command["name"] == "move"]
    assert [(move["uci"], move["ply"]) for move in moves] == [("e2e4", 0)]
