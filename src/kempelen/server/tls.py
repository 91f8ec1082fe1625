"""The server's own certificate: for other machines, and for VR headsets, which want an encrypted page.

No authority has signed it, so that a browser asks once whether to trust it; its fingerprint, which is printed
at the start, tells it from a stranger's.
"""

import datetime as dt
import socket
from collections.abc import Iterable
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, ip_address
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization

from kempelen.app.certificates import SERVER, sign

_LASTS = dt.timedelta(days=397)  # longer ones are refused by Safari
_RENEW = dt.timedelta(days=30)


@dataclass(frozen=True)
class Certificate:
    """Where it is.

    Attributes:
        fingerprint: SHA-256, as browsers show it.
    """

    certificate: Path
    key: Path
    fingerprint: str


def certificate(directory: Path, names: Iterable[str]) -> Certificate:
    """The one that is kept in ``directory``, or a new one where that is too old or lacks a name.

    Args:
        directory: For certificate and key; the key can be read by its owner alone.
        names: Host names and addresses that it is for.

    Raises:
        ConfigError: it cannot be written.
    """
    wanted = frozenset(names)
    kept = Certificate(directory / "certificate.pem", directory / "key.pem", "")
    found = _still_good(kept, wanted)
    if found is None:
        found = _make(kept, wanted)
    print_ = found.fingerprint(hashes.SHA256()).hex(":").upper()
    return Certificate(kept.certificate, kept.key, print_)


def _still_good(kept: Certificate, wanted: frozenset[str]) -> x509.Certificate | None:
    try:
        found = x509.load_pem_x509_certificate(kept.certificate.read_bytes())
        key = serialization.load_pem_private_key(kept.key.read_bytes(), None)
        names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (OSError, ValueError, TypeError, x509.ExtensionNotFound):
        return None
    known = {str(name.value) for name in names}
    fresh = found.not_valid_after_utc - dt.datetime.now(dt.UTC) > _RENEW
    return found if fresh and wanted <= known and key.public_key() == found.public_key() else None


def _make(kept: Certificate, names: frozenset[str]) -> x509.Certificate:
    made = sign("Kempelen", _LASTS, hosts=names, uses=[SERVER])
    made.keep(kept.certificate, kept.key)
    return made.certificate


def host_names() -> frozenset[str]:
    """By which this machine may be known."""
    own = socket.gethostname().lower().rstrip(".")
    short = own.partition(".")[0]
    return frozenset(name for name in ("localhost", own, short, f"{short}.local") if _is_name(name))


def _is_name(name: str) -> bool:
    return name.isascii() and all(part and part.replace("-", "").isalnum() for part in name.split("."))


def addresses() -> list[str]:
    """Of this machine, those that others can use; nothing is sent to find them."""
    found = []
    for family, outside in ((socket.AF_INET, "192.0.2.1"), (socket.AF_INET6, "2001:db8::1")):
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.connect((outside, 9))
                address: IPv4Address | IPv6Address = ip_address(probe.getsockname()[0])
        except OSError:  # no such network here
            continue
        if not address.is_loopback and not address.is_unspecified:
            found.append(str(address))
    return found


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach it."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False
