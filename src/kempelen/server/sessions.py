"""Who is who: one-time tokens become sessions, sessions have a role.

Of a token or a session only the SHA-256 digest is kept, so that neither memory nor the file that lets
sessions outlive the server holds anything that would let somebody in.
"""

import hmac
import json
import logging
import secrets
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path

from kempelen.app.files import replace_file
from kempelen.server.commands import Role

TOKEN_LASTS_S = 3600.0
FIRST_TOKEN_LASTS_S = 24 * 3600.0
SESSION_LASTS_S = 7 * 24 * 3600.0
_BYTES = 32
_MOST_TOKENS = 100
_MOST_SESSIONS = 500
_RANK: dict[Role, int] = {"spectator": 0, "player": 1, "operator": 2}
_log = logging.getLogger(__name__)


def allows(role: Role, needed: Role) -> bool:
    """Whether a role includes another one."""
    return _RANK[role] >= _RANK[needed]


@dataclass(frozen=True, slots=True)
class _Pass:
    role: Role
    until: float


@dataclass(frozen=True, slots=True)
class Visitor:
    """Who a request comes from.

    Attributes:
        key: Of the session, or of the address of one without: what limits and idempotency count by.
    """

    role: Role
    key: str


def _digest(secret: str) -> str:
    return sha256(secret.encode("utf-8", "surrogatepass")).hexdigest()


class Sessions:
    """All tokens and sessions of a server.

    Args:
        file: Where sessions are kept over a restart; None for nowhere.
        passwords: What lets somebody in as this role.
        clock: s since the epoch.
    """

    def __init__(
        self,
        file: Path | None = None,
        passwords: dict[Role, str] | None = None,
        *,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self._file = file
        self._clock = clock
        self._passwords = {role: _digest(word) for role, word in (passwords or {}).items() if word}
        self._tokens: dict[str, _Pass] = {}
        self._sessions: dict[str, _Pass] = self._load()

    # --- ways in --------------------------------------------------------------------------------------------

    def token(self, role: Role, lasts: float = TOKEN_LASTS_S) -> str:
        """A new one-time token."""
        self._forget_old(self._tokens, _MOST_TOKENS)
        token = secrets.token_urlsafe(_BYTES)
        self._tokens[_digest(token)] = _Pass(role, self._clock() + lasts)
        return token

    def redeem(self, token: str) -> str | None:
        """A session for a token, which is spent; None when there is no such token, or it is too old."""
        kept = self._tokens.pop(_digest(token), None)
        return self.open(kept.role) if kept is not None and kept.until > self._clock() else None

    def enter(self, password: str) -> str | None:
        """A session for a password; None when it is none. All are compared, in constant time."""
        given = _digest(password)
        roles = [role for role, kept in self._passwords.items() if hmac.compare_digest(given, kept)]
        return self.open(max(roles, key=_RANK.__getitem__)) if roles else None

    @property
    def has_password(self) -> bool:
        """Whether there is one at all."""
        return bool(self._passwords)

    def open(self, role: Role) -> str:
        """A session for somebody who needs no token."""
        self._forget_old(self._sessions, _MOST_SESSIONS)
        session = secrets.token_urlsafe(_BYTES)
        self._sessions[_digest(session)] = _Pass(role, self._clock() + SESSION_LASTS_S)
        self._save()
        return session

    # --- sessions -------------------------------------------------------------------------------------------

    def visitor(self, session: str | None, address: str) -> Visitor:
        """Whoever has this session; a spectator without one."""
        digest = _digest(session) if session else ""
        kept = self._sessions.get(digest)
        if kept is None or kept.until <= self._clock():
            return Visitor("spectator", f"address {address}")
        return Visitor(kept.role, digest)

    def close(self, session: str) -> None:
        """End it."""
        if self._sessions.pop(_digest(session), None) is not None:
            self._save()

    def _forget_old(self, passes: dict[str, _Pass], most: int) -> None:
        now = self._clock()
        for digest in [digest for digest, kept in passes.items() if kept.until <= now]:
            del passes[digest]
        while len(passes) >= most:
            del passes[next(iter(passes))]

    # --- over a restart -------------------------------------------------------------------------------------

    def _load(self) -> dict[str, _Pass]:
        """A file that cannot be read lets nobody in: everyone uses a new link."""
        if self._file is None or not self._file.exists():
            return {}
        try:
            kept = json.loads(self._file.read_text(encoding="utf-8"))
            found = {digest: _Pass(entry["role"], float(entry["until"])) for digest, entry in kept.items()}
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            _log.warning("The sessions of the last run cannot be read (%s)", type(error).__name__)
            return {}
        now = self._clock()
        return {digest: entry for digest, entry in found.items() if entry.until > now and entry.role in _RANK}

    def _save(self) -> None:
        if self._file is None:
            return
        kept = {digest: asdict(entry) for digest, entry in self._sessions.items()}
        try:
            replace_file(self._file, json.dumps(kept), private=True)
        except OSError as error:
            _log.warning("Sessions cannot be kept over a restart (%s)", error.strerror)
