"""Why another program cannot be reached at an endpoint: zenoh tries again and again, and does not say."""

import asyncio
import contextlib
import ssl
from collections.abc import Iterable
from pathlib import Path

_SECONDS = 2.0
_REASONS = (
    ("unable to get local issuer", "its certificate is of another authority than {ca}"),
    ("self-signed certificate", "its certificate is of another authority than {ca}"),
    ("signature failure", "its certificate is of another authority than {ca}"),
    ("certificate has expired", "its certificate has ended"),
    ("not yet valid", "its certificate is not valid yet: compare the clocks of both machines"),
    ("unknown ca", "it does not accept this machine's certificate: it is of another authority"),
    ("alert decrypt error", "it does not accept this machine's certificate: it is of another authority"),
    ("certificate expired", "it does not accept this machine's certificate: it has ended"),
    ("certificate required", "it wants a certificate"),
)
_HINT_PLAIN = "it wants to know who asks: name this machine's keys with --keys"


async def why_not(endpoints: Iterable[str], keys: Path | None) -> str:
    """What is wrong with the first endpoint at which something is; empty when nothing is, or nobody is there.

    Args:
        endpoints: As zenoh takes them; others than TCP and TLS are passed over.
        keys: This program's; None for none.
    """
    for endpoint in endpoints:
        kind, _, rest = endpoint.partition("/")
        host, _, port = rest.partition("?")[0].partition("#")[0].rpartition(":")
        if kind in {"tcp", "tls"} and port.isdigit() and (reason := await _asked(host, int(port), keys)):
            return f"{endpoint}: {reason}"
    return ""


async def _asked(host: str, port: int, keys: Path | None) -> str:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    if keys is None:
        context.verify_mode = ssl.CERT_NONE
    else:
        context.load_verify_locations(keys / "ca.pem")
        context.load_cert_chain(keys / "node.pem", keys / "node.key")
    try:
        async with asyncio.timeout(_SECONDS):
            await _shaken(host.strip("[]"), port, context)
    except ssl.SSLError as error:
        said = str(error).lower().replace("_", " ")
        known = next((reason for words, reason in _REASONS if words in said), "")
        if keys is None:
            return _HINT_PLAIN if "alert" in said else ""
        return known.format(ca=keys / "ca.pem") or f"it does not encrypt, or differently: {error.reason}"
    except (OSError, TimeoutError):
        return ""  # nobody is there yet
    return _HINT_PLAIN if keys is None else ""


async def _shaken(host: str, port: int, context: ssl.SSLContext) -> None:
    """What is wrong with the own certificate is told after the handshake, with the first answer (TLS 1.3)."""
    reader, writer = await asyncio.open_connection(host, port, ssl=context)
    try:
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_SECONDS / 4):
                await reader.read(1)
    finally:
        writer.close()
        with contextlib.suppress(OSError, TimeoutError):
            await writer.wait_closed()
