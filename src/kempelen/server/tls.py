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
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from kempelen.app.files import replace_file
from kempelen.core.errors import ConfigError

_LASTS = dt.timedelta(days=397)  # longer ones are refused by Safari
_RENEW = dt.timedelta(days=30)
_CLOCKS = dt.timedelta(days=1)
"""By which other clocks may be behind."""


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
    key = ec.generate_private_key(ec.SECP256R1())
    who = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "Kempelen")])
    now = dt.datetime.now(dt.UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(who)
        .issuer_name(who)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _CLOCKS)
        .not_valid_after(now + _LASTS)
        .add_extension(x509.SubjectAlternativeName([_named(name) for name in sorted(names)]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .sign(key, hashes.SHA256())
    )
    secret = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    try:
        replace_file(kept.key, secret.decode(), private=True)
        replace_file(kept.certificate, made.public_bytes(serialization.Encoding.PEM).decode())
    except OSError as error:
        raise ConfigError(
            f"The certificate cannot be kept in {kept.key.parent}: {error.strerror}.",
            hint="Name another data directory with --data-dir.",
        ) from None
    return made


def _named(name: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(name))
    except ValueError:
        return x509.DNSName(name)


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
