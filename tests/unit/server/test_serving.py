"""How a server is started: port, certificate, one for a data directory."""

import datetime as dt
import socket
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from cryptography import x509

from kempelen.app.config import load_config
from kempelen.core.errors import ConfigError
from kempelen.server.doorplate import Doorplate, read
from kempelen.server.run import PORT, ServeOptions, _listening, serve
from kempelen.server.tls import addresses, certificate, host_names, is_loopback


@contextmanager
def occupied() -> Iterator[int]:
    with socket.socket() as plug:
        plug.bind(("127.0.0.1", 0))
        plug.listen()
        yield plug.getsockname()[1]


def test_a_port_that_was_asked_for_and_is_taken() -> None:
    with (
        occupied() as port,
        pytest.raises(ConfigError, match=f"Port {port} .* is in use") as told,
        _listening(ServeOptions(port=port)),
    ):
        pass
    assert "--port 0" in told.value.hint


def test_the_next_port_where_none_was_asked_for() -> None:
    with _listening(ServeOptions()) as first:
        first.listen()
        with _listening(ServeOptions()) as second:
            assert PORT <= first.getsockname()[1] < second.getsockname()[1] < PORT + 20


@pytest.mark.parametrize("host", ["203.0.113.77", "nowhere.invalid"])
def test_an_address_of_another_machine(host: str) -> None:
    with pytest.raises(ConfigError, match=host) as told, _listening(ServeOptions(host=host, port=0)):
        pass
    assert "--host 127.0.0.1" in told.value.hint


@pytest.mark.parametrize(
    "passwords", [{"operator": "short"}, {"operator": "the same one", "player": "the same one"}]
)
async def test_passwords_that_are_none(tmp_path: Path, passwords: dict[str, str]) -> None:
    config = load_config(None, {"data.dir": str(tmp_path)})
    options = ServeOptions(passwords=passwords)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="password"):
        await serve(config, options, lambda _: None)


def test_one_server_for_a_data_directory(tmp_path: Path) -> None:
    with Doorplate(tmp_path) as plate:
        plate.put("http://127.0.0.1:1", "secret", "")
        assert read(tmp_path).session == "secret"
        assert stat.S_IMODE((tmp_path / "server.json").stat().st_mode) == 0o600
        with pytest.raises(ConfigError, match="running already"), Doorplate(tmp_path):
            pass
        assert read(tmp_path).origin == "http://127.0.0.1:1"
    with pytest.raises(ConfigError, match="No server is running"):
        read(tmp_path)


def test_what_a_killed_server_left_is_not_believed(tmp_path: Path) -> None:
    (tmp_path / "server.json").write_text(
        '{"origin": "http://127.0.0.1:1", "session": "x", "certificate": ""}'
    )
    with Doorplate(tmp_path), pytest.raises(ConfigError, match="No server is running"):
        read(tmp_path)


def test_a_certificate_is_made_once_and_again_for_another_name(tmp_path: Path) -> None:
    names = {"localhost", "127.0.0.1", "::1", "table.lan"}
    made = certificate(tmp_path, names)
    found = x509.load_pem_x509_certificate(made.certificate.read_bytes())
    held = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert {str(name.value) for name in held} == names
    assert found.not_valid_after_utc - dt.datetime.now(dt.UTC) < dt.timedelta(days=398)
    assert stat.S_IMODE(made.key.stat().st_mode) == 0o600
    assert certificate(tmp_path, names).fingerprint == made.fingerprint
    other = certificate(tmp_path, {*names, "192.168.7.7"})
    assert other.fingerprint != made.fingerprint
    made.key.write_text("damaged")
    assert certificate(tmp_path, names).fingerprint != other.fingerprint


def test_what_this_machine_is_called() -> None:
    assert "localhost" in host_names()
    assert all(not is_loopback(address) for address in addresses())
    assert all(map(is_loopback, ("127.0.0.1", "::1", "localhost")))
    assert not any(map(is_loopback, ("0.0.0.0", "192.168.7.7", "table.lan")))  # noqa: S104 - asked, not bound
