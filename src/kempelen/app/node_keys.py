"""Keys by which programs on several machines know each other: an authority, and a folder for each machine."""

import datetime as dt
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from kempelen.app.certificates import CLIENT, SERVER, Signed, sign
from kempelen.app.files import replace_file
from kempelen.core.errors import ConfigError, LinkError
from kempelen.nodes.rules import ROLES

DAYS = 397
_AUTHORITY_LASTS = dt.timedelta(days=3650)
_SOON = dt.timedelta(days=30)
_FOLDER = re.compile(r"[a-z0-9][a-z0-9-]{0,31}")
_AUTHORITY = "authority"
_MAKE = "Make keys on the machine that has the authority, and copy the folder here: kempelen node keys"


@dataclass(frozen=True)
class Held:
    """A folder of keys.

    Attributes:
        trouble: Why nobody will accept it; empty when it is good.
        soon: Whether it ends within 30 days.
        fingerprint: SHA-256 of the certificate.
    """

    folder: Path
    role: str
    machine: str
    until: dt.datetime
    trouble: str
    soon: bool
    fingerprint: str


def keys_folder(data_dir: Path) -> Path:
    """Where authority and machines' folders are kept."""
    return data_dir / "keys"


def make_keys(where: Path, role: str, machine: str, days: int = DAYS) -> Held:
    """New keys for one machine; the authority is made where there is none.

    Args:
        where: As of `keys_folder`.
        role: One of `kempelen.nodes.rules.ROLES`.
        machine: Name of the folder.
        days: How long they are valid, at most as long as the authority.

    Raises:
        ConfigError: no such role, no name for a folder, or they cannot be written or signed.
    """
    if role not in ROLES:
        raise ConfigError(f"There is no role '{role}'.", hint=f"Roles: {', '.join(ROLES)}.")
    if not _FOLDER.fullmatch(machine) or machine == _AUTHORITY:
        raise ConfigError(
            f"'{machine}' is no name for keys.", hint="Use 1 to 32 small letters, digits and hyphens: pi-3"
        )
    authority = _authority(where / _AUTHORITY)
    lasts = min(dt.timedelta(days=days), authority.certificate.not_valid_after_utc - dt.datetime.now(dt.UTC))
    folder = where / machine
    made = sign(role, lasts, machine=machine, hosts=[machine], uses=[SERVER, CLIENT], by=authority)
    made.keep(folder / "node.pem", folder / "node.key")
    replace_file(folder / "ca.pem", _pem(authority.certificate))
    return read_keys(folder)


def _pem(certificate: x509.Certificate) -> str:
    return certificate.public_bytes(serialization.Encoding.PEM).decode()


def _authority(folder: Path) -> Signed:
    certificate, key = folder / "ca.pem", folder / "ca.key"
    if not certificate.exists() and not key.exists():
        made = sign("Kempelen authority", _AUTHORITY_LASTS, authority=True)
        made.keep(certificate, key)
        return made
    secret = _key(key)
    kept = Signed(_certificate(certificate), secret)
    if secret.public_key() != kept.certificate.public_key():
        raise ConfigError(f"{key} does not belong to {certificate}.", hint="Restore both from a copy.")
    return kept


def _certificate(path: Path) -> x509.Certificate:
    try:
        return x509.load_pem_x509_certificate(path.read_bytes())
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}.", hint=_MAKE) from None
    except ValueError:
        raise ConfigError(f"{path} is no certificate.", hint=_MAKE) from None


def _key(path: Path) -> ec.EllipticCurvePrivateKey:
    try:
        key = serialization.load_pem_private_key(path.read_bytes(), None)
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}.", hint=_MAKE) from None
    except (ValueError, TypeError):
        key = None
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise ConfigError(f"{path} is no key of Kempelen's.", hint=_MAKE)
    return key


def read_keys(folder: Path, now: dt.datetime | None = None) -> Held:
    """What is in a folder.

    Args:
        folder: Of one machine.
        now: As this machine's clock says; None: ask it.

    Raises:
        ConfigError: a file is missing or damaged.
    """
    certificate = _certificate(folder / "node.pem")
    authority = _certificate(folder / "ca.pem")
    until, now = certificate.not_valid_after_utc, now or dt.datetime.now(dt.UTC)
    return Held(
        folder=folder,
        role=_name(certificate, NameOID.COMMON_NAME),
        machine=_name(certificate, NameOID.ORGANIZATIONAL_UNIT_NAME),
        until=until,
        trouble=_trouble(certificate, authority, _key(folder / "node.key"), now),
        soon=until - now < _SOON,
        fingerprint=certificate.fingerprint(hashes.SHA256()).hex(":").upper(),
    )


def _name(certificate: x509.Certificate, what: x509.ObjectIdentifier) -> str:
    found = certificate.subject.get_attributes_for_oid(what)
    return str(found[0].value) if found else ""


def _trouble(
    certificate: x509.Certificate,
    authority: x509.Certificate,
    key: ec.EllipticCurvePrivateKey,
    now: dt.datetime,
) -> str:
    try:
        certificate.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature):
        return "it was not signed by the authority in ca.pem"
    if key.public_key() != certificate.public_key():
        return "node.key does not belong to it"
    for what, one in (("it", certificate), ("its authority", authority)):
        if now > one.not_valid_after_utc:
            return f"{what} ended on {one.not_valid_after_utc:%Y-%m-%d %H:%M} UTC"
        if now < one.not_valid_before_utc:
            begins = f"{one.not_valid_before_utc:%Y-%m-%d %H:%M} UTC"
            return f"{what} begins on {begins}, and this machine's clock says {now:%Y-%m-%d %H:%M} UTC"
    return ""


def all_keys(where: Path) -> Iterator[Held]:
    """Every machine's, by name; raises as `read_keys`."""
    for file in sorted(where.glob("*/node.pem")):
        yield read_keys(file.parent)


def require_good(folder: Path) -> Held:
    """Before the network is joined with them.

    Raises:
        LinkError: nobody would accept them; the message says why.
        ConfigError: a file is missing or damaged.
    """
    held = read_keys(folder)
    if held.trouble:
        raise LinkError(
            f"The certificate {folder / 'node.pem'} cannot be used: {held.trouble}.",
            hint="Make a new one where the authority is, and copy the folder here: "
            f"kempelen node keys {held.machine or 'NAME'} --role {held.role or 'ROLE'}",
        )
    if held.role not in ROLES:
        raise LinkError(
            f"The certificate {folder / 'node.pem'} has no role of Kempelen's, but '{held.role}'.", hint=_MAKE
        )
    return held
