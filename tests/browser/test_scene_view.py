"""The 3D view in a real browser: pieces are dragged in it, and the page goes on without it."""

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from kempelen.testing.pages import Visitor

SHOW = "localStorage.setItem('kempelen.settings', JSON.stringify({{ view: '{}' }}))"
POINT = """
([square, height]) => {
  const canvas = document.querySelector(".scene-view canvas");
  const { left, top } = canvas.getBoundingClientRect();
  const { x, y } = canvas.pointOf(square, height);
  return [left + x, top + y];
}
"""
NO_WEBGL = """
const made = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
  return kind.startsWith("webgl") ? null : made.call(this, kind, ...more);
};
"""
LOSE = """
() => {
  const canvas = document.querySelector(".scene-view canvas");
  window.taken = canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
  window.taken.loseContext();
}
"""


@pytest.fixture
def game(operator: Visitor) -> Callable[[str], Page]:
    """A game, and the page that shows it in this view."""

    def begin(view: str, script: str = "") -> Page:
        page = operator.page
        page.add_init_script(SHOW.format(view) + "\n" + script)
        page.set_viewport_size({"width": 1000, "height": 640})
        page.emulate_media(reduced_motion="reduce")  # a preset is there at once
        page.reload()
        operator.ready()
        operator.must("new_game", mode="play", level="full", move_time=0.02)
        return page

    return begin


def drag(page: Page, source: str, target: str) -> None:
    """With the mouse, a piece by its middle."""
    mouse = page.mouse
    mouse.move(*page.evaluate(POINT, [source, 15]))
    mouse.down()
    mouse.move(*page.evaluate(POINT, [target, 13]), steps=4)
    mouse.up()


def test_a_piece_is_dragged_in_the_3d_view(operator: Visitor, game: Callable[[str], Page]) -> None:
    page = game("scene")
    expect(page.locator("canvas.ready")).to_be_visible()
    operator.status("Your move")
    page.wait_for_function("document.querySelector('canvas.ready').pieceCount() > 0")
    page.get_by_role("button", name="From above").click()  # from the side the king hides his pawn
    drag(page, "e2", "e5")
    expect(page.get_by_text("This piece cannot go there")).to_be_attached()
    drag(page, "g1", "f3")
    operator.played("Nf3")


def test_the_view_obeys_the_keyboard_and_comes_back_when_the_graphics_were_lost(
    game: Callable[[str], Page],
) -> None:
    page = game("scene")
    canvas = page.locator("canvas.ready")
    expect(canvas).to_be_visible()
    before = page.evaluate(POINT, ["e4", 0])
    canvas.press("ArrowRight")
    page.wait_for_function(f"(before) => ({POINT})(['e4', 0])[0] !== before[0]", arg=before)
    canvas.press("2")
    expect(page.get_by_role("button", name="From above")).to_have_attribute("aria-pressed", "true")
    page.evaluate(LOSE)
    expect(page.get_by_text("The graphics card has taken the 3D view away")).to_be_visible()
    page.evaluate("window.taken.restoreContext()")
    expect(page.get_by_text("The graphics card has taken the 3D view away")).to_be_hidden()


def test_without_webgl_the_rest_of_the_page_goes_on(
    operator: Visitor, visitors: Any, game: Callable[..., Page]
) -> None:
    visitors.expected.append("WebGL")
    page = game("both", NO_WEBGL)
    expect(page.get_by_text("This browser cannot show 3D here")).to_be_visible()
    move = page.get_by_placeholder("e2e4")
    move.fill("e4")
    move.press("Enter")
    operator.played("e4")
