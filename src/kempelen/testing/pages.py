"""Somebody in front of the page: what people do there, by the words that they see."""

import json
import re
import socket
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, ConsoleMessage, Locator, Page, expect

from kempelen.bench.served import Served
from kempelen.testing.scenarios import twin_of
from kempelen.twin.spec import CONTROL_FOLDER

WAIT_MS = 30_000
"""Longest wait for anything on a page; an idle machine needs a tenth of a second."""
FAST = ("--speed", "max", "--level", "1", "--move-time", "0.02")
"""Options of a twin that keeps nobody waiting, and an engine that plays badly at once."""
BLIND = ("--sensor", "none", *FAST)
DRAG_STEPS = 6
_JOG_SPEEDS = (1, 5, 20, 60, 150)
_JOG_KEYS = (("ArrowLeft", "ArrowRight"), ("ArrowDown", "ArrowUp"), ("PageDown", "PageUp"))
_NEAR_ENOUGH = 1.0  # mm
_BRAKING = 0.3
"""So much of the way is left for what passes until a key that was let go of has its effect."""
_PASSES = """([axis, target, up]) => {
    const now = Number(document.querySelectorAll('.axis dd bdi')[axis].textContent.replace(',', ''));
    return up ? now >= target : now <= target;
}"""
Serve = Callable[..., Served]
"""Starts a server; takes its options, and ``data``, ``port`` and ``engine``."""
BACK_RANK = "r5k1/pp3ppp/8/8/8/8/PP2QPPP/4R1K1 w - - 0 1"
"""1. Qe8+ leaves Black nothing but 1... Rxe8, and 2. Rxe8 is mate."""


class Visitor:
    """One browser, one page.

    Args:
        page: Open at an address of the server.
    """

    def __init__(self, page: Page) -> None:
        self.page = page

    # --- what goes straight to the server -------------------------------------------------------------------

    def order(self, name: str, **values: Any) -> dict[str, Any]:
        """A command by HTTP, with this browser's session; the reply."""
        return self.post("commands", {"name": name, "id": uuid.uuid4().hex, **values})

    def must(self, name: str, **values: Any) -> dict[str, Any]:
        """A command that has to be done.

        Raises:
            AssertionError: it was refused.
        """
        reply = self.order(name, **values)
        assert reply.get("ok"), reply
        return reply

    def post(self, path: str, body: Any) -> dict[str, Any]:
        """Post JSON to the API; the answer."""
        answer = self.page.request.post(f"{self._origin}/api/{path}", data=body)
        found: dict[str, Any] = answer.json()
        return found

    def get(self, path: str) -> Any:
        """Read from the API."""
        return self.page.request.get(f"{self._origin}/api/{path}").json()

    def topic(self, name: str) -> Any:
        """What the server shows at the moment."""
        return self.get("state")["topics"][name]

    @property
    def _origin(self) -> str:
        return self.page.evaluate("location.origin")  # type: ignore[no-any-return]

    # --- going about ----------------------------------------------------------------------------------------

    def ready(self) -> "Visitor":
        """Wait until the robot is connected and nothing is being played."""
        expect(self.page.locator("header .status .text")).to_have_text("Ready")
        return self

    def go(self, name: str) -> None:
        """To another page, by its link."""
        self.page.get_by_role("navigation").get_by_role("link", name=name, exact=True).click()

    def button(self, name: str | re.Pattern[str]) -> Locator:
        """By the words on it."""
        return self.page.get_by_role("button", name=name, exact=isinstance(name, str))

    def stop(self) -> None:
        """The emergency stop."""
        self.page.get_by_role("button", name="Emergency stop").click()

    def fault(self, title: str) -> Locator:
        """What the page says is wrong."""
        return (
            self.page.get_by_role("region", name="What is wrong")
            .get_by_role("article")
            .filter(has_text=title)
        )

    def note(self, text: str | re.Pattern[str]) -> Locator:
        """A note at the page's edge."""
        return self.page.get_by_role("log", name="Notes").get_by_text(text)

    # --- at the robot ---------------------------------------------------------------------------------------

    def tool(self) -> tuple[float, float, float]:
        """Where the page says that the robot is, mm."""
        x, y, z = (
            float(text.replace(",", "")) for text in self.page.locator(".axis dd bdi").all_inner_texts()
        )
        return x, y, z

    def drive_to(self, x: float, y: float, z: float) -> None:
        """On the page for calibration: with the jog pad's keys; high over the board, then down."""
        for axis, target in ((0, x), (1, y), (2, z)):
            self._drive(axis, target)

    def rise(self, z: float) -> None:
        """Straight up."""
        self._drive(2, z)

    def _drive(self, axis: int, target: float) -> None:
        """Along one axis: fast as long as it is far, then slower; held until it is there."""
        pad = self.page.get_by_role("group", name="Move the robot")
        while abs(way := target - self.tool()[axis]) > _NEAR_ENOUGH:
            speed = max([one for one in _JOG_SPEEDS if one <= abs(way)], default=_JOG_SPEEDS[0])
            pad.get_by_text(str(speed), exact=True).click()
            pad.focus()
            key = _JOG_KEYS[axis][way > 0]
            self.page.keyboard.down(key)
            short_of = target - way * _BRAKING
            self.page.wait_for_function(_PASSES, arg=[axis, short_of, way > 0])
            self.page.keyboard.up(key)
            expect(self.page.locator(".phase dd")).to_have_text("at rest")

    # --- at the board ---------------------------------------------------------------------------------------

    def new_game(self, fen: str = "", **values: Any) -> None:
        """Begin one against the engine, and wait until it is this person's turn."""
        self.must("new_game", **{"mode": "play", "level": "1", "move_time": 0.02, "fen": fen} | values)
        self.my_turn()

    def my_turn(self) -> None:
        """Wait until the pieces can be taken."""
        expect(self.page.locator(".holder.enabled")).to_be_visible()

    def set_level(self, level: str) -> None:
        """On the page for a new game: the engine's level."""
        self.page.get_by_role("slider", name="Strength").fill(level)

    def square(self, name: str) -> Locator:
        """Of the board."""
        return self.page.locator(f'[role="gridcell"][data-at="{name}"]')

    def drag(self, source: str, target: str) -> None:
        """A piece, with the mouse, as soon as it can be."""
        self.my_turn()
        mouse = self.page.mouse
        mouse.move(*_middle(self.square(source)))
        mouse.down()
        mouse.move(*_middle(self.square(target)), steps=DRAG_STEPS)
        mouse.up()

    def played(self, *moves: str) -> None:
        """Wait until the score begins with these moves, patterns."""
        score = self.page.get_by_role("region", name="Moves").get_by_role("listitem").get_by_role("button")
        for number, san in enumerate(moves):
            expect(score.nth(number)).to_have_text(re.compile(san))

    def doing(self, what: str) -> None:
        """Wait until the robot is said to be doing this."""
        expect(self.page.locator(".now .doing").filter(has_text=what)).to_be_visible()

    def status(self, text: str) -> None:
        """Wait until the game is said to be in this state."""
        expect(self.page.locator(".now .status")).to_have_text(text)


def _middle(square: Locator) -> tuple[float, float]:
    box = square.bounding_box()
    assert box is not None, "the square is not on the page"
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def ask_twin(server: Served, op: str, **arguments: Any) -> dict[str, Any]:
    """Something by the side door of a server's twin.

    Raises:
        AssertionError: it was refused.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as door:
        door.settimeout(WAIT_MS / 1000)
        door.connect(_door_of(twin_of(server.pid)))
        door.sendall(json.dumps({"id": 1, "op": op, **arguments}).encode() + b"\n")
        reply: dict[str, Any] = json.loads(door.makefile().readline())
    assert reply["ok"], reply
    return reply


def _door_of(pid: int) -> str:
    """The socket that a twin listens on."""
    own = {str(fd.readlink()) for fd in Path(f"/proc/{pid}/fd").iterdir()}
    for line in Path("/proc/net/unix").read_text(encoding="ascii").splitlines():
        words = line.split()
        if CONTROL_FOLDER in line and f"socket:[{words[6]}]" in own:
            return words[7]
    raise LookupError(f"process {pid} has no side door")


@dataclass
class Visitors:
    """Opens pages and keeps what goes wrong on them.

    Attributes:
        expected: Patterns of errors on the console that belong to the test.
        troubles: What went wrong on the pages.
        pictures: That were taken of them.
    """

    browser: Browser
    expected: list[str] = field(default_factory=list)
    troubles: list[str] = field(default_factory=list)
    pages: list[Page] = field(default_factory=list)
    pictures: list[Path] = field(default_factory=list)

    def open(self, address: str, *, cookies: Sequence[Any] = (), **settings: Any) -> Page:
        """A browser of its own, with these cookies, at an address."""
        usual = {"viewport": {"width": 1280, "height": 900}, "locale": "en-GB"}
        context = self.browser.new_context(**usual | settings)
        context.add_cookies(cookies)
        page = context.new_page()
        page.set_default_timeout(WAIT_MS)
        page.on("console", self._heard)
        page.on("pageerror", lambda error: self.troubles.append(f"error on the page: {error}"))
        self.pages.append(page)
        page.goto(address)
        return page

    def _heard(self, message: ConsoleMessage) -> None:
        if message.type in {"error", "warning"}:
            self.troubles.append(
                f"console {message.type}: {message.text} ({message.location.get('url', '')})"
            )

    def unexpected(self) -> list[str]:
        """What no test has foreseen."""
        return [text for text in self.troubles if not any(re.search(one, text) for one in self.expected)]

    def photograph(self, folder: Path) -> None:
        """Of each page, as it is."""
        for number, page in enumerate(self.pages):
            # Written by ourselves: Playwright would do it in a thread that stays.
            path = folder / f"page-{number}.png"
            path.write_bytes(page.screenshot())
            self.pictures.append(path)

    def close(self) -> None:
        """All pages."""
        for page in self.pages:
            page.context.close()
