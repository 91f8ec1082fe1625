"""`kempelen bench page`: how fast the page is there, how much it loads, how fast its e-stop is on the wire.

A real server with a game on its twin and a headless Chromium are on one machine, so that they have one clock.
Each paint is one in a new browser context: nothing is in its cache.
"""

import gzip
import itertools
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kempelen.bench.result import BenchResult, Progress
from kempelen.bench.served import FLAGS, Served, find_chromium
from kempelen.core.errors import ConfigError, KempelenError

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

PAINTS = 7
STOPS = 15
PAINT_TARGET_MS = 1000.0
SCRIPT_TARGET_KB = 250.0
STOP_TARGET_MS = 100.0
_WAIT_S = 30.0
_OPTIONS = ("--sensor", "none", "--speed", "max", "--level", "1", "--move-time", "0.05")
_RESET = "\x18"
_SEEN = """() => new Promise(done => {
    const look = () => document.querySelector('.board .pieces-layer, .board svg')
        ? requestAnimationFrame(() => done(performance.now())) : requestAnimationFrame(look);
    look();
})"""
_PAINTED = "() => performance.getEntriesByName('first-contentful-paint')[0]?.startTime"
_PRESSED = """() => {
    window.pressed = [];
    addEventListener('pointerdown', event => pressed.push(performance.timeOrigin + event.timeStamp), true);
}"""


def run(*, seed: int, pgn: Path | None, data: Path | None, progress: Progress) -> BenchResult:
    """Measure paints, sizes and stops.

    Args:
        seed: Of the twin.
        pgn: Not used.
        data: Not used.
        progress: Told before each measurement.

    Raises:
        ConfigError: there is no browser, or nothing to drive one with.
        KempelenError: the server or its page does not do what it should.
    """
    del pgn, data
    with (
        tempfile.TemporaryDirectory(prefix="kempelen-bench-") as folder,
        Served(Path(folder), *_OPTIONS, "--seed", str(seed)) as server,
        _browser() as browser,
    ):
        operator = _Operator(browser, server)
        operator.begin()
        rows = [_paint(operator, number, progress) for number in range(PAINTS)]
        stops = list(_stops(operator, progress))
    rows += [{"measured": f"stop {number}", "ms": ms} for number, ms in enumerate(stops, 1)]
    return BenchResult("page", _figures(rows[:PAINTS], stops), rows)


@contextmanager
def _browser() -> Iterator["Browser"]:
    try:
        from playwright.sync_api import sync_playwright  # noqa: PLC0415  # of a development environment
    except ImportError:
        raise ConfigError("Playwright is not installed.", hint="Run: make setup") from None
    program = find_chromium()
    with sync_playwright() as playwright:
        yield playwright.chromium.launch(executable_path=program, args=list(FLAGS))


class _Operator:
    """A session of an operator, in as many browser contexts as are wanted."""

    def __init__(self, browser: "Browser", server: Served) -> None:
        self._browser = browser
        self._origin = server.origin
        self._numbers = itertools.count(1)
        self.page = browser.new_page(base_url=server.origin)
        self.page.goto(server.link)
        self._cookies: list[Any] = list(self.page.context.cookies())

    def begin(self) -> None:
        """A game, so that there is something to paint."""
        self.until(lambda: self.get("/api/state")["topics"]["station"]["phase"] == "ready", "the robot")
        self.order("new_game", mode="play", level="1", move_time=0.05)

    def fresh(self) -> "Page":
        """A page with an empty cache."""
        context = self._browser.new_context(base_url=self._origin, viewport={"width": 1280, "height": 900})
        context.add_cookies(self._cookies)
        return context.new_page()

    def get(self, path: str) -> Any:
        """Read from the API."""
        return self.page.request.get(path).json()

    def order(self, name: str, **values: Any) -> None:
        """Raises: KempelenError: it was refused."""
        body = {"name": name, "id": f"bench-page-{next(self._numbers)}", **values}
        reply = self.page.request.post("/api/commands", data=body).json()
        if not reply.get("ok"):
            raise KempelenError(
                f"The server refused '{name}': {reply.get('error')}", hint=reply.get("hint", "")
            )

    def until(self, happened: Any, what: str) -> Any:
        """Look until something is so.

        Raises:
            KempelenError: it is not so in half a minute.
        """
        ends = time.monotonic() + _WAIT_S
        while time.monotonic() < ends:
            if found := happened():
                return found
            self.page.wait_for_timeout(20)
        raise KempelenError(f"Waited {_WAIT_S:.0f} s for {what}.")


def _paint(operator: _Operator, number: int, progress: Progress) -> dict[str, Any]:
    progress("paints", number / (PAINTS + STOPS))
    page = operator.fresh()
    scripts: list[Any] = []
    page.on("response", lambda answer: scripts.append(answer) if answer.url.endswith(".js") else None)
    page.goto("/")
    board = page.evaluate(_SEEN)
    painted = page.wait_for_function(_PAINTED).json_value()
    size = sum(len(gzip.compress(answer.body(), 9)) for answer in scripts)
    page.context.close()
    return {"paint": number + 1, "first_paint_ms": painted, "board_ms": board, "script_kB": size / 1000}


def _stops(operator: _Operator, progress: Progress) -> Iterator[float]:
    """From the press of the button to the first byte on the wire, ms."""
    page = operator.page
    page.evaluate(_PRESSED)
    for number in range(STOPS):
        progress("stops", (PAINTS + number) / (PAINTS + STOPS))
        newest = max((line["number"] for line in operator.get("/api/logs/wire?limit=1")["lines"]), default=0)
        page.get_by_role("button", name="Emergency stop").click()
        sent = operator.until(lambda after=newest: _sent(operator, after), "the stop on the wire")
        yield 1000 * sent - page.evaluate("pressed.at(-1)")
        if operator.until(lambda: _stopped(operator), "the robot's own word") == "alarm":
            operator.order("recover")
        operator.order("home")


def _stopped(operator: _Operator) -> str:
    """Phase of a robot that has to be homed; else empty."""
    phase: str = operator.get("/api/state")["topics"]["robot"]["phase"]
    return phase if phase in {"alarm", "locked"} else ""


def _sent(operator: _Operator, after: int) -> float | None:
    """When the first reset after a line went out, s since the epoch."""
    lines = operator.get(f"/api/logs/wire?after={after}")["lines"]
    return next((line["at"] for line in lines if line["way"] == "out" and _is_reset(line["text"])), None)


def _is_reset(text: str) -> bool:
    return _RESET in text or "0x18" in text.lower() or "\\x18" in text


def _figures(paints: list[dict[str, Any]], stops: list[float]) -> dict[str, float]:
    first = [row["first_paint_ms"] for row in paints]
    return {
        "first_paint_ms_p50": round(float(np.percentile(first, 50)), 1),
        "first_paint_ms_max": round(max(first), 1),
        "first_paint_target_ms": PAINT_TARGET_MS,
        "board_ms_p50": round(float(np.percentile([row["board_ms"] for row in paints], 50)), 1),
        "script_kB_gzip": round(max(row["script_kB"] for row in paints), 1),
        "script_target_kB": SCRIPT_TARGET_KB,
        "stop_ms_p50": round(float(np.percentile(stops, 50)), 1),
        "stop_ms_p95": round(float(np.percentile(stops, 95)), 1),
        "stop_ms_max": round(max(stops), 1),
        "stop_target_ms": STOP_TARGET_MS,
    }
