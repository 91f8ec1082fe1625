"""A real server, real browsers: what every test of the page stands on."""

from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Playwright, expect, sync_playwright

from kempelen.bench.served import FLAGS, Served, find_chromium
from kempelen.core.errors import ConfigError
from kempelen.testing.pages import BLIND, WAIT_MS, Serve, Visitor, Visitors
from kempelen.testing.uci_engines import write_engine

expect.set_options(timeout=WAIT_MS)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.browser)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Fixtures learn whether the test has failed."""
    report = yield
    if call.when == "call":
        item.stash[FAILED] = report.failed
    return report


FAILED = pytest.StashKey[bool]()


@pytest.fixture(scope="module")
def chromium() -> str:
    """Where it is."""
    try:
        return find_chromium()
    except ConfigError as error:
        pytest.skip(f"{error} {error.hint}")


@pytest.fixture(scope="module")
def playwright(chromium: str) -> Iterator[Playwright]:
    """Per module: its loop, as long as it is there, is in the way of tests that run one of their own."""
    del chromium
    with sync_playwright() as playwright:
        yield playwright


@pytest.fixture(scope="module")
def browser(request: pytest.FixtureRequest, playwright: Playwright, chromium: str) -> Iterator[Browser]:
    """A Chromium. A processor that draws 3D is slow: modules that do not look at it set ``FLAT``."""
    flags = [*FLAGS, *(["--disable-3d-apis"] if getattr(request.module, "FLAT", False) else [])]
    with playwright.chromium.launch(executable_path=chromium, args=flags) as browser:
        yield browser


def _server(folder: Path) -> Iterator[Serve]:
    running: list[Served] = []
    fake = str(write_engine(folder, "--multipv"))

    def serve(*options: str, data: Path | None = None, port: int = 0, engine: str = fake) -> Served:
        chosen = [*(options or BLIND), *(["--engine", engine] if engine else [])]
        server = Served(data or folder / f"data-{len(running)}", *chosen, port=port)
        running.append(server.__enter__())
        return server

    yield serve
    for server in running:
        server.__exit__(None, None, None)


@pytest.fixture
def serve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Serve]:
    """Starts a server with options of its own; without any: a fast twin that is played by without eyes.

    The engine makes legal moves at once, unless another one is named; "": the best at hand.
    """
    monkeypatch.delenv("KEMPELEN_SENSOR", raising=False)
    yield from _server(tmp_path)


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """One server for all tests of a module: for what changes nothing at the table."""
    for serve in _server(tmp_path_factory.mktemp("shared")):
        yield serve(*BLIND)


@pytest.fixture(scope="module")
def badge(shared: Served, browser: Browser) -> list[Any]:
    """Cookies of an operator of the shared server: its link works once."""
    with browser.new_context() as context:
        page = context.new_page()
        page.goto(shared.link)
        Visitor(page).ready()
        cookies: list[Any] = context.cookies()
    return cookies


@pytest.fixture
def visitors(browser: Browser, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Visitors]:
    """Pages; anything that goes wrong on one fails the test, and one that fails leaves pictures behind."""
    visitors = Visitors(browser)
    if getattr(request.module, "FLAT", False):
        visitors.expected.append("WebGL")
    yield visitors
    if request.node.stash.get(FAILED, False):
        visitors.photograph(tmp_path)
    visitors.close()
    assert visitors.unexpected() == []


@pytest.fixture
def guest(shared: Served, badge: list[Any], visitors: Visitors) -> Visitor:
    """An operator of the shared server, for what changes nothing at the table."""
    return Visitor(visitors.open(shared.origin, cookies=badge)).ready()


@pytest.fixture
def operator(serve: Serve, visitors: Visitors) -> Visitor:
    """An operator on the game page of a server of its own, the robot connected."""
    return Visitor(visitors.open(serve().link)).ready()
