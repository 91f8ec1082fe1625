"""Certificates that are made here: for the page, and for nodes."""

import datetime as dt
from collections.abc import Iterable
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from kempelen.app.files import replace_file
from kempelen.core.errors import ConfigError

_CLOCKS = dt.timedelta(days=1)
"""By which other clocks may be behind."""
SERVER, CLIENT = ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH


@dataclass(frozen=True)
class Signed:
    """A certificate and its key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    def keep(self, certificate: Path, key: Path) -> None:
        """Write both; the key can be read by its owner alone.

        Raises:
            ConfigError: they cannot be written.
        """
        secret = self.key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )
        try:
            replace_file(key, secret.decode(), private=True)
            replace_file(certificate, self.certificate.public_bytes(serialization.Encoding.PEM).decode())
        except OSError as error:
            raise ConfigError(
                f"The certificate cannot be kept in {key.parent}: {error.strerror}.",
                hint="Name another data directory with --data-dir.",
            ) from None


def sign(
    name: str,
    lasts: dt.timedelta,
    *,
    machine: str = "",
    hosts: Iterable[str] = (),
    uses: Iterable[x509.ObjectIdentifier] = (),
    by: Signed | None = None,
    authority: bool = False,
) -> Signed:
    """A new one.

    Args:
        name: Its common name.
        lasts: From now on.
        machine: Whose it is, for people; empty for nobody's in particular.
        hosts: Host names and addresses that it is for.
        uses: What it may be shown for.
        by: The authority that signs it; None for itself.
        authority: Whether it may sign others.
    """
    key = ec.generate_private_key(ec.SECP256R1())
    names = [x509.NameAttribute(NameOID.COMMON_NAME, name)]
    if machine:
        names.append(x509.NameAttribute(NameOID.ORGANIZATIONAL_UNIT_NAME, machine))
    who, now = x509.Name(names), dt.datetime.now(dt.UTC)
    builder = (
        x509.CertificateBuilder()
        .subject_name(who)
        .issuer_name(by.certificate.subject if by else who)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _CLOCKS)
        .not_valid_after(now + lasts)
        .add_extension(
            x509.BasicConstraints(ca=authority, path_length=0 if authority else None), critical=True
        )
    )
    if known := sorted(hosts):
        alternatives = x509.SubjectAlternativeName([_named(host) for host in known])
        builder = builder.add_extension(alternatives, critical=False)
    if wanted := list(uses):
        builder = builder.add_extension(x509.ExtendedKeyUsage(wanted), critical=False)
    return Signed(builder.sign(by.key if by else key, hashes.SHA256()), key)


def _named(name: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(name))
    except ValueError:
        return x509.DNSName(name)
