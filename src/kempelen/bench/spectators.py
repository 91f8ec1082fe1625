"""`kempelen bench spectators`: one game on the twin, and a crowd that looks on over loopback.

Server, crowd and this program are three processes on one machine, so that they have one clock. A latency
lasts from the instant at which the oldest value of a message changed in the server until a spectator has the
message. Beside the crowd there are a socket that never reads, and an operator whose commands are timed.
"""

import asyncio
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx2
import numpy as np

from kempelen.bench.result import BenchResult, Progress
from kempelen.core.errors import ConfigError
from kempelen.server.doorplate import FILE_NAME, Address, read

TARGET_MS = 150.0
MOST_CLIENTS = 1000
MOST_SECONDS = 600.0
_START_S = 60.0
_SETTLE_S = 3.0
_LOOKS = 10
_ASKED_EVERY_S = 0.5


@dataclass
class _Memory:
    """Of the server, MB."""

    alone: float = 0.0
    crowded: list[float] = field(default_factory=list)


def run(
    *,
    seed: int,
    pgn: Path | None,
    data: Path | None,
    progress: Progress,
    clients: int = 200,
    seconds: float = 20.0,
) -> BenchResult:
    """Measure.

    Args:
        seed: Of the twin.
        pgn: Not used.
        data: Not used.
        progress: Told now and then.
        clients: Spectators.
        seconds: How long they look on.

    Raises:
        ConfigError: more is asked for than is allowed, or the server does not start.
    """
    del pgn, data
    if not 1 <= clients <= MOST_CLIENTS or not 1 <= seconds <= MOST_SECONDS:
        raise ConfigError(
            f"{clients} spectators for {seconds:g} s are out of range.",
            hint=f"Up to {MOST_CLIENTS} spectators, up to {MOST_SECONDS:g} s.",
        )
    with tempfile.TemporaryDirectory(prefix="kempelen-bench-") as folder:
        progress("the server starts", 0.0)
        with _server(Path(folder), seed) as (server, address):
            return asyncio.run(_measure(server, address, clients, seconds, progress))


@contextmanager
def _server(folder: Path, seed: int) -> Iterator[tuple[subprocess.Popen[bytes], Address]]:
    command = [
        sys.executable, "-m", "kempelen", "serve", "--no-browser", "--port", "0", "--data-dir", str(folder),
        "--sensor", "none", "--seed", str(seed),
    ]  # fmt: skip
    with (folder / "server.log").open("wb") as log:
        server = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
    try:
        yield server, _address(folder, server)
    finally:
        server.terminate()
        try:
            server.wait(30)
        except subprocess.TimeoutExpired:
            server.kill()
            server.wait()


def _address(folder: Path, server: subprocess.Popen[bytes]) -> Address:
    """Once it answers."""
    until = time.monotonic() + _START_S
    while time.monotonic() < until and server.poll() is None:
        if (folder / FILE_NAME).exists():
            return read(folder)
        time.sleep(0.05)
    raise ConfigError(
        f"The server has not started within {_START_S:g} s.", hint="Try it by hand: kempelen serve"
    )


async def _measure(
    server: subprocess.Popen[bytes], address: Address, clients: int, seconds: float, progress: Progress
) -> BenchResult:
    memory = _Memory()
    cookies = {"kempelen_session": address.session}
    async with httpx2.AsyncClient(
        base_url=address.origin, cookies=cookies, trust_env=False, timeout=60
    ) as operator:
        await _begin(operator)
        await asyncio.sleep(_SETTLE_S)
        memory.alone = _megabytes(server.pid)
        crowd = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "kempelen.bench.crowd", address.origin, str(clients), str(seconds),
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        )  # fmt: skip
        try:
            asked = asyncio.ensure_future(_ask(operator, seconds))
            for look in range(_LOOKS):
                progress(f"{clients} spectators look on", (look + 1) / (_LOOKS + 1))
                await asyncio.sleep(seconds / _LOOKS)
                memory.crowded.append(_megabytes(server.pid))
            told, _ = await asyncio.wait_for(crowd.communicate(), timeout=seconds + 60)
            answers = await asked
        finally:
            if crowd.returncode is None:
                crowd.kill()
                await crowd.wait()
    return _result(json.loads(told), answers, memory, clients)


async def _begin(operator: httpx2.AsyncClient) -> None:
    """A game, as soon as the twin is connected."""
    until = time.monotonic() + _START_S
    while time.monotonic() < until:
        topics = (await operator.get("/api/state")).json()["topics"]
        if topics["station"]["phase"] == "ready":
            break
        await asyncio.sleep(0.2)
    command = {"name": "new_game", "id": "bench-new-game", "mode": "watch", "level": "5", "move_time": 0.5}
    reply = (await operator.post("/api/commands", json=command)).json()
    if not reply["ok"]:
        raise ConfigError(f"No game could be begun: {reply['error']}", hint=reply["hint"])


async def _ask(operator: httpx2.AsyncClient, seconds: float) -> list[float]:
    """Times of an operator's commands, ms."""
    times = []
    for number in range(int(seconds / _ASKED_EVERY_S)):
        began = time.perf_counter()
        await operator.post(
            "/api/commands", json={"name": "speed", "id": f"bench-speed-{number}", "speed": 1}
        )
        times.append(1000 * (time.perf_counter() - began))
        await asyncio.sleep(_ASKED_EVERY_S)
    return times


def _megabytes(pid: int) -> float:
    """Resident memory of a process; 0 where the system does not tell."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith("VmRSS")), 0.0)


def _result(told: dict[str, Any], answers: list[float], memory: _Memory, clients: int) -> BenchResult:
    settled = memory.crowded[len(memory.crowded) // 2 :]
    rows = [
        _row("event to spectator", told["latencies"]),
        _row("its command, to the operator", answers),
    ]
    figures = {
        "latency_p95_ms": rows[0]["p95_ms"],
        "target_ms": TARGET_MS,
        "spectators": clients,
        "connected": told["connected"],
        "lost": told["lost"],
        "messages": len(told["latencies"]),
        "deaf_socket_closed": int(told["deaf_closed"]),
        "server_mb_alone": round(memory.alone, 1),
        "server_mb_crowded": round(settled[0], 1),
        "server_mb_growth": round(settled[-1] - settled[0], 1),
        "load_of_machine": round(os.getloadavg()[0], 2),
    }
    return BenchResult("spectators", figures, rows)


def _row(what: str, times: list[float]) -> dict[str, Any]:
    known = np.array(times or [float("nan")])
    ms = {"p50_ms": 50, "p95_ms": 95, "max_ms": 100}
    shown = {name: round(float(np.percentile(known, share)), 1) for name, share in ms.items()}
    return {"what": what, "n": len(times), **shown}
