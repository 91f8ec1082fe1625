"""What people and programs of ill will send: shown as text, refused, and nothing else is disturbed."""

import http.client
import json
import re
import socket
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

from playwright.sync_api import expect

from kempelen.bench.served import Served
from kempelen.testing.pages import BACK_RANK, Serve, Visitor, Visitors

EVIL = '<img src=x onerror="document.title=1"><script>alert(1)</script>'
EVIL_PGN = f'[White "{EVIL.replace(chr(34), chr(39))}"]\n[Black "<b>bold</b>"]\n\n1. f3 e5 2. g4 Qh4# 0-1\n'
HUNDRED_MB = 100 * 1024 * 1024
FLAT = True


def test_html_in_a_pgn_is_text(operator: Visitor) -> None:
    operator.go("New game")
    page = operator.page
    operator.button(re.compile("^Replay")).click()
    page.get_by_role("textbox", name="… or paste it").fill(EVIL_PGN)
    operator.button("Read it").click()
    operator.button("Begin").click()
    expect(page.get_by_role("heading", name="Black wins")).to_be_visible()
    expect(page.get_by_text("<b>bold</b>")).to_be_visible()
    expect(page.get_by_text("<script>alert(1)</script>")).to_be_visible()
    operator.go("History")
    expect(page.get_by_role("link").filter(has_text="<b>bold</b>")).to_be_visible()
    assert page.locator("main img, main script, main b").count() == 0


def test_a_hundred_megabytes(guest: Visitor) -> None:
    """Refused by the page before it is sent, and by the server before it is read."""
    page = guest.page
    guest.go("New game")
    guest.button(re.compile("^Replay")).click()
    page.evaluate(
        """() => {
            const bytes = new DataTransfer();
            bytes.items.add(new File([new Uint8Array(100 * 1024 * 1024)], "large.pgn"));
            document.querySelector('input[type=file]').files = bytes.files;
            document.querySelector('input[type=file]').dispatchEvent(new Event('change', { bubbles: true }));
        }"""
    )
    expect(guest.note(re.compile("too large: at most 2"))).to_be_visible()
    address = urlsplit(page.url)
    connection = http.client.HTTPConnection(str(address.hostname), address.port, timeout=30)
    connection.putrequest("POST", "/api/pgn")
    connection.putheader("Content-Type", "application/json")
    connection.putheader("Content-Length", str(HUNDRED_MB))
    connection.endheaders()
    answer = connection.getresponse()
    assert answer.status == 413
    assert "too large" in json.loads(answer.read())["error"]
    connection.close()


def test_another_sites_page_can_do_nothing(shared: Served, guest: Visitor, visitors: Visitors) -> None:
    cookies = guest.page.context.cookies()
    command = {"name": "home", "id": uuid.uuid4().hex}
    for origin in ("http://evil.example", "null"):
        answer = guest.page.request.post(
            f"{shared.origin}/api/commands", data=command, headers={"Origin": origin}
        )
        assert answer.status == 403
    assert cookies[0]["httpOnly"]
    assert cookies[0]["sameSite"] == "Strict"
    visitors.expected.append(
        "WebSocket connection|blocked by CORS|Failed to load|ERR_|Refused|Content Security"
    )
    page = guest.page
    page.route("http://elsewhere.example/", lambda route: route.fulfill(body="", content_type="text/html"))
    page.goto("http://elsewhere.example/")
    opened = page.evaluate(
        """address => new Promise(done => {
            const socket = new WebSocket(address);
            socket.onopen = () => done(true);
            socket.onerror = () => done(false);
        })""",
        shared.origin.replace("http", "ws") + "/api/ws",
    )
    assert not opened


def test_a_socket_that_never_reads_beside_a_game(serve: Serve, visitors: Visitors) -> None:
    server = serve()
    operator = Visitor(visitors.open(server.link)).ready()
    with deaf(server):
        operator.new_game(BACK_RANK)
        operator.drag("e2", "e8")
        operator.played("Qe8", "Rxe8")
        operator.drag("e1", "e8")
        expect(operator.page.get_by_role("heading", name="White wins")).to_be_visible()


@contextmanager
def deaf(server: Served) -> Iterator[None]:
    """A WebSocket that follows everything and takes nothing."""
    address = urlsplit(server.origin)
    with socket.create_connection((str(address.hostname), int(address.port or 0))) as wire:
        wire.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        wire.sendall(
            f"GET /api/ws HTTP/1.1\r\nHost: {address.netloc}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        assert b"101" in wire.recv(12)
        yield
