"""Pictures of the page for README and documentation: each page, light and dark, on a desktop and on a phone.

Taken from a real server in the middle of a real game that is played through the camera.

Usage: python tools/screenshots.py [folder]
"""

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from playwright.sync_api import Browser, Page, expect, sync_playwright

from kempelen.bench.served import FLAGS, Served, find_chromium
from kempelen.testing.pages import WAIT_MS, Visitor

FOLDER = Path(__file__).parents[1] / "docs" / "images" / "web"
OPTIONS = ("--speed", "max", "--level", "3", "--move-time", "0.1")
SIZES: dict[str, dict[str, Any]] = {
    "desktop": {"viewport": {"width": 1280, "height": 800}},
    "phone": {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True},
}
THEMES = ("light", "dark")
MOVES = ("e2e4", "d2d4", "g1f3", "b1c3")
QUALITY = 82


@dataclass(frozen=True)
class Shot:
    """A page to be taken.

    Attributes:
        name: Of the file.
        path: Of the page.
        view: What the game page shows.
        shown: Selector of what has to be there first.
        settle_ms: How long pictures that come by themselves are waited for.
    """

    name: str
    path: str
    shown: str = "h1"
    view: str = "board"
    settle_ms: int = 800


SHOTS = (
    Shot("game", "/", ".board .pieces-layer"),
    Shot("game-3d", "/", "canvas.ready", view="both", settle_ms=6000),
    Shot("new", "/new"),
    Shot("setup", "/setup"),
    Shot("calibrate", "/calibrate"),
    Shot("table", "/calibrate?part=table"),
    Shot("eyes", "/eyes", settle_ms=5000),
    Shot("history", "/history"),
    Shot("spectator", "/spectator", ".board .pieces-layer"),
    Shot("settings", "/settings"),
    Shot("logs", "/logs"),
    Shot("about", "/about"),
)


def main() -> None:
    """Take them all."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER
    expect.set_options(timeout=WAIT_MS)
    folder.mkdir(parents=True, exist_ok=True)
    with (
        tempfile.TemporaryDirectory(prefix="kempelen-shots-") as data,
        Served(Path(data), *OPTIONS) as server,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=list(FLAGS))
        operator = Visitor(browser.new_page(locale="en-GB"))
        operator.page.set_default_timeout(WAIT_MS)
        operator.page.goto(server.link)
        play(operator.ready())
        cookies = operator.page.context.cookies()
        operator.page.context.close()
        for size, frame in SIZES.items():
            for theme in THEMES:
                look = {"color_scheme": theme, "base_url": server.origin, **frame}
                take_all(browser, cookies, look, folder, f"{size}-{theme}")
    total = sum(file.stat().st_size for file in folder.iterdir())
    sys.stdout.write(f"{len(list(folder.iterdir()))} pictures, {total / 1e6:.2f} MB in {folder}\n")


def play(operator: Visitor) -> None:
    """Some moves, and one that has begun."""
    operator.must("new_game", mode="play", level="3", move_time=0.1, clock={"minutes": 10, "increment": 5})
    for uci in MOVES:
        operator.my_turn()
        reply = operator.order("move", uci=uci)
        if not reply["ok"]:  # the engine has made it impossible
            break
        expect(operator.page.locator(".holder.enabled")).to_have_count(0)
    operator.my_turn()


def take_all(browser: Browser, cookies: list[Any], look: dict[str, Any], folder: Path, suffix: str) -> None:
    """All pages in one size and one theme."""
    for shot in SHOTS:
        context = browser.new_context(locale="en-GB", reduced_motion="reduce", **look)
        context.add_cookies(cookies)
        context.add_init_script(
            f"localStorage.setItem('kempelen.settings', JSON.stringify({{ view: '{shot.view}' }}))"
        )
        page = context.new_page()
        page.set_default_timeout(WAIT_MS)
        take(page, shot, folder / f"{shot.name}-{suffix}.webp")
        context.close()


def take(page: Page, shot: Shot, file: Path) -> None:
    """One picture."""
    page.goto(shot.path)
    page.locator(shot.shown).first.wait_for(state="attached")
    page.wait_for_timeout(shot.settle_ms)
    raw = cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_COLOR)
    if raw is None:
        raise RuntimeError(f"no picture of {shot.path}")
    _, packed = cv2.imencode(".webp", raw, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])
    file.write_bytes(packed.tobytes())


if __name__ == "__main__":
    main()
