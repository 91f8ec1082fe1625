"""For everyone: axe finds nothing, all languages fit, nobody needs a mouse or moving pictures."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from kempelen.bench.served import Served
from kempelen.testing.pages import BACK_RANK, Visitor, Visitors

AXE = Path(__file__).parents[2] / "web" / "node_modules" / "axe-core" / "axe.min.js"
STANDARDS = ["wcag2a", "wcag2aa", "wcag21aa", "wcag22aa"]
PAGES = ["", "new", "history", "setup", "calibrate", "calibrate?part=table", "eyes", "spectator"]
PAGES += ["logs", "settings", "about"]
DESKTOP = {"width": 1280, "height": 900}
PHONE = {"width": 390, "height": 844}
LOOKS: dict[str, dict[str, Any]] = {
    "desktop, light": {"viewport": DESKTOP, "color_scheme": "light"},
    "desktop, dark": {"viewport": DESKTOP, "color_scheme": "dark"},
    "phone, light": {"viewport": PHONE, "color_scheme": "light", "has_touch": True},
    "phone, dark": {"viewport": PHONE, "color_scheme": "dark", "has_touch": True},
}


@pytest.fixture
def guest(shared: Served, visitors: Visitors, session: list[dict[str, Any]]) -> Any:
    def open_page(path: str, **context: Any) -> Page:
        return visitors.open(f"{shared.origin}/{path}", cookies=session, base_url=shared.origin, **context)

    return open_page


@pytest.fixture(scope="module")
def session(shared: Served, browser: Any) -> list[dict[str, Any]]:
    """Cookies of an operator, in the middle of a game."""
    page = browser.new_page()
    page.goto(shared.link)
    operator = Visitor(page).ready()
    operator.new_game(BACK_RANK)
    cookies: list[dict[str, Any]] = page.context.cookies()
    page.context.close()
    return cookies


def violations(page: Page) -> list[str]:
    """What axe finds."""
    found = page.evaluate("tags => axe.run({runOnly: {type: 'tag', values: tags}})", STANDARDS)["violations"]
    return [
        f"{one['id']}: {node['target']} {node['failureSummary']}" for one in found for node in one["nodes"]
    ]


def some(values: Iterable[str], *daily: str) -> list[Any]:
    """All of them; only these each time, and the rest when there is time (make soak)."""
    return [one if one in daily else pytest.param(one, marks=pytest.mark.soak) for one in values]


@pytest.mark.parametrize("look", some(LOOKS, "desktop, light", "phone, dark"))
def test_axe_finds_nothing(guest: Any, look: str) -> None:
    page = guest("", bypass_csp=True, reduced_motion="reduce", **LOOKS[look])
    page.add_init_script(AXE.read_text(encoding="utf-8"))
    found = {}
    for path in PAGES:
        page.goto(f"/{path}")
        settled(page)
        if wrong := violations(page):
            found[path] = wrong
    assert found == {}


def settled(page: Page) -> None:
    """Wait until the page is there and has what it reads."""
    expect(page.get_by_role("heading", level=1).first).to_be_visible()
    page.wait_for_load_state("networkidle")


@pytest.mark.parametrize("path", ["", "new", "settings"])
def test_arabic_runs_from_right_to_left_and_fits(guest: Any, path: str) -> None:
    for size in (DESKTOP, PHONE):
        page = guest(path, locale="ar", viewport=size)
        settled(page)
        expect(page.locator("html")).to_have_attribute("dir", "rtl")
        expect(page.locator("html")).to_have_attribute("lang", "ar")
        assert overflow(page) <= 0


def overflow(page: Page) -> int:
    """CSS pixels by which the page, or a board that is cut off, is wider than the window."""
    over: int = page.evaluate(
        """() => {
            const room = document.documentElement.clientWidth;
            const edge = one => one.getBoundingClientRect().right;
            const boards = [...document.querySelectorAll('.board')].map(edge);
            return Math.ceil(Math.max(document.documentElement.scrollWidth, ...boards) - room);
        }"""
    )
    return over


@pytest.mark.parametrize("locale", some(["en", "cs", "de"], "de"))  # its words are the longest
def test_no_page_is_wider_than_a_phone(guest: Any, locale: str) -> None:
    page = guest("", locale=locale, viewport=PHONE)
    too_wide = {}
    for path in PAGES:
        page.goto(f"/{path}")
        settled(page)
        if overflow(page) > 0:
            too_wide[path] = overflow(page)
    assert too_wide == {}


def test_nothing_moves_for_whoever_wants_it_still(guest: Any) -> None:
    page = guest("", reduced_motion="reduce")
    settled(page)
    running = page.evaluate("document.getAnimations().filter(one => one.playState === 'running').length")
    assert running == 0
