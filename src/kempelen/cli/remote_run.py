"""Talks to a server that runs, as one of its clients."""

import json
import secrets
import ssl
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import chess
import httpx2
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from kempelen.core.errors import ConfigError, GameError, KempelenError
from kempelen.game.notation import parse_move

_COOKIE = "kempelen_session"
_ANSWER_S = 120.0
"""Homing a real machine takes a while."""
_REACH_S = 5.0


class Remote:
    """Context manager.

    Args:
        origin: Of the server.
        session: Of somebody who is in already.
        password: For those who are not.
        certificate: The server's own.

    Raises:
        ConfigError: it does not answer, or the password is wrong.
    """

    def __init__(
        self, origin: str, *, session: str = "", password: str = "", certificate: Path | None = None
    ) -> None:
        self._origin = origin.rstrip("/")
        self._password = password
        self._ssl = _trusting(certificate)
        try:
            self._http = httpx2.Client(
                base_url=self._origin,
                verify=self._ssl,
                timeout=httpx2.Timeout(_ANSWER_S, connect=_REACH_S),
                trust_env=False,
            )
        except (httpx2.HTTPError, httpx2.InvalidURL) as error:
            raise _unreachable(self._origin, error) from None
        if session:
            self._http.cookies.set(_COOKIE, session)

    def __enter__(self) -> Self:
        """Enter with the password, if there is one."""
        if self._password:
            self._ask("POST", "/api/session", {"password": self._password})
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let go."""
        self._http.close()

    # --- what may be asked ----------------------------------------------------------------------------------

    def obey(self, name: str, **values: object) -> str:
        """Have a command done; what came of it.

        Raises:
            GameError: it was refused.
        """
        command = {"name": name, "id": secrets.token_hex(8), **values}
        reply = self._ask("POST", "/api/commands", command)
        if not reply["ok"]:
            raise GameError(reply["error"], hint=reply["hint"])
        result = reply["result"]
        return ", ".join(f"{key}: {value}" for key, value in result.items()) if result else "Done."

    def move(self, text: str) -> str:
        """A move in any notation.

        Raises:
            GameError: no game runs, or it is not the person's turn.
            NotationError: this is no move here.
        """
        game = self._topics()["game"]
        if game is None:
            raise GameError("No game is running.", hint="Begin one: kempelen remote new")
        move = parse_move(text, chess.Board(game["fen"]))
        return self.obey("move", uci=move.uci(), ply=len(game["moves"]))

    def link(self, role: str) -> str:
        """A link for a browser."""
        return str(self._ask("POST", "/api/links", {"role": role})["url"])

    def status(self) -> str:
        """What is going on, in a few lines."""
        return "\n".join(_told(self._topics()))

    def follow(self, count: int) -> Iterator[str]:
        """What happens from now on, a sentence each; ends after ``count`` when it is not 0."""
        url = f"{self._origin.replace('http', 'ws', 1)}/api/ws"
        cookies = "; ".join(f"{name}={value}" for name, value in self._http.cookies.items())
        context = self._ssl if url.startswith("wss") else None
        try:
            with connect(url, additional_headers={"Cookie": cookies}, ssl=context, proxy=None) as socket:
                socket.send(json.dumps({"type": "follow", "topics": ["station"]}))
                socket.recv()
                said = 0
                for message in socket:
                    for line in json.loads(message).get("said", ()):
                        yield line["text"]
                        said += 1
                        if said == count:
                            return
        except (OSError, WebSocketException) as error:
            raise _unreachable(self._origin, error) from None

    # --- how it is asked ------------------------------------------------------------------------------------

    def _topics(self) -> Mapping[str, Any]:
        topics: Mapping[str, Any] = self._ask("GET", "/api/state")["topics"]
        return topics

    def _ask(self, method: str, path: str, body: object = None) -> Any:
        try:
            answer = self._http.request(method, path, json=body)
        except (httpx2.HTTPError, httpx2.InvalidURL) as error:
            raise _unreachable(self._origin, error) from None
        try:
            said = answer.json()
        except ValueError:
            said = {}
        if answer.is_error:
            raise _refused(answer.status_code, said)
        return said


def _trusting(certificate: Path | None) -> ssl.SSLContext:
    """Raises: ConfigError: it cannot be read."""
    context = ssl.create_default_context()
    if certificate is not None:
        try:
            context.load_verify_locations(certificate)
        except OSError as error:
            raise ConfigError(
                f"The certificate {certificate} cannot be read: {error.strerror or error}.",
                hint="Copy tls/certificate.pem from the server's data directory.",
            ) from None
    return context


def _unreachable(origin: str, error: Exception) -> KempelenError:
    return ConfigError(f"The server at {origin} does not answer: {error}.", hint="Start it: kempelen serve")


def _refused(status: int, said: Any) -> KempelenError:
    told = said if isinstance(said, dict) else {}
    message = str(told.get("error") or f"The server answers with status {status}.")
    return ConfigError(message, hint=str(told.get("hint", "")))


def text_of(file: Path) -> str:
    """A PGN file.

    Raises:
        ConfigError: it cannot be read.
    """
    try:
        data = file.read_bytes()
    except OSError as error:
        raise ConfigError(f"{file} cannot be read: {error.strerror}.", hint="Name a PGN file.") from None
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")  # old files are, and it never fails


def _told(topics: Mapping[str, Any]) -> Iterator[str]:
    station, robot, game = topics["station"], topics["robot"], topics["game"]
    if station is not None:
        yield f"Station: {', '.join(filter(None, (station['phase'], station['busy'])))}"
        yield f"Robot: {robot['phase'] if robot else 'unknown'} at {station['port']}"
        for fault in station["faults"]:
            yield f"Fault: {fault['title']}. {fault['text']}"
    if game is None:
        yield "No game."
    else:
        yield from _told_of_game(game)
    for prompt in topics["prompts"] or ():
        yield f"Please: {prompt['text']}"


def _told_of_game(game: Mapping[str, Any]) -> Iterator[str]:
    yield f"Game {game['number']} ({game['mode']}): {game['white']['name']} against {game['black']['name']}"
    moves = [move["san"] for move in game["moves"]]
    if moves:
        yield f"Moves: {' '.join(moves)}"
    if game["result"]:
        yield f"Over: {game['result']}, {game['reason']}"
    elif game["paused"]:
        yield "Paused."
    else:
        yield f"{game['turn'].capitalize()} is to move{', a person' if game['person_to_move'] else ''}."
