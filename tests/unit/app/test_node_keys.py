"""Keys of nodes: made, read again, and refused before the network is joined with bad ones."""

import datetime as dt
import shutil
import stat
from pathlib import Path

import pytest

from kempelen.app.certificates import sign
from kempelen.app.config import load_config
from kempelen.app.network import network_of
from kempelen.app.node_keys import all_keys, make_keys, read_keys, require_good
from kempelen.core.errors import ConfigError, LinkError
from kempelen.nodes.rules import ROLES, access_control


def test_a_machine_gets_a_folder_that_says_what_it_may_do(tmp_path: Path) -> None:
    held = make_keys(tmp_path, "robot", "pi-3")
    assert (held.role, held.machine, held.trouble, held.soon) == ("robot", "pi-3", "", False)
    assert sorted(path.name for path in held.folder.iterdir()) == ["ca.pem", "node.key", "node.pem"]
    assert stat.S_IMODE((held.folder / "node.key").stat().st_mode) == 0o600
    assert stat.S_IMODE((tmp_path / "authority" / "ca.key").stat().st_mode) == 0o600


def test_all_machines_of_a_hall_have_one_authority(tmp_path: Path) -> None:
    for role in ROLES:
        make_keys(tmp_path, role, role)
    assert [held.machine for held in all_keys(tmp_path)] == sorted(ROLES)
    assert len({(tmp_path / role / "ca.pem").read_bytes() for role in ROLES}) == 1
    assert {require_good(tmp_path / role).role for role in ROLES} == set(ROLES)


def test_new_keys_of_the_same_machine_replace_the_old_ones(tmp_path: Path) -> None:
    first = make_keys(tmp_path, "view", "hall")
    assert make_keys(tmp_path, "view", "hall").fingerprint != first.fingerprint
    assert len(list(all_keys(tmp_path))) == 1


@pytest.mark.parametrize(
    ("role", "name", "message"),
    [
        ("king", "pi", "no role 'king'"),
        ("robot", "../pi", "no name for keys"),
        ("robot", "authority", "no name for keys"),
        ("robot", "", "no name for keys"),
    ],
)
def test_what_cannot_be_made_is_refused(tmp_path: Path, role: str, name: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        make_keys(tmp_path, role, name)
    assert not list(tmp_path.iterdir())


def test_an_expired_certificate_is_named_with_its_end(tmp_path: Path) -> None:
    held = make_keys(tmp_path, "robot", "pi")
    authority = sign("Kempelen authority", dt.timedelta(days=9), authority=True)
    authority.keep(held.folder / "ca.pem", tmp_path / "ca.key")
    old = sign("robot", dt.timedelta(hours=-2), machine="pi", by=authority)
    old.keep(held.folder / "node.pem", held.folder / "node.key")
    ended = f"{old.certificate.not_valid_after_utc:%Y-%m-%d %H:%M}"
    with pytest.raises(LinkError, match=f"it ended on {ended} UTC") as raised:
        network_of(load_config(None, {"network.keys": str(held.folder)}))
    assert "kempelen node keys pi --role robot" in raised.value.hint


def test_keys_that_end_soon_are_marked(tmp_path: Path) -> None:
    assert [make_keys(tmp_path, "robot", "pi", days=days).soon for days in (2, 60)] == [True, False]


def test_a_clock_that_is_days_behind_is_told(tmp_path: Path) -> None:
    held = make_keys(tmp_path, "robot", "pi")
    behind = dt.datetime.now(dt.UTC) - dt.timedelta(days=3)
    assert "this machine's clock says" in read_keys(held.folder, behind).trouble


def test_keys_of_another_authority_are_refused(tmp_path: Path) -> None:
    ours, theirs = make_keys(tmp_path / "a", "robot", "pi"), make_keys(tmp_path / "b", "robot", "pi")
    shutil.copy(theirs.folder / "ca.pem", ours.folder / "ca.pem")
    with pytest.raises(LinkError, match="not signed by the authority in ca.pem"):
        require_good(ours.folder)


def test_a_key_that_belongs_to_another_certificate_is_refused(tmp_path: Path) -> None:
    one, other = make_keys(tmp_path, "robot", "one"), make_keys(tmp_path, "robot", "other")
    shutil.copy(other.folder / "node.key", one.folder / "node.key")
    with pytest.raises(LinkError, match="node.key does not belong to it"):
        require_good(one.folder)


@pytest.mark.parametrize("name", ["ca.pem", "node.pem", "node.key"])
@pytest.mark.parametrize("content", [None, "", "nonsense"], ids=["missing", "empty", "damaged"])
def test_a_missing_or_damaged_file_is_named(tmp_path: Path, name: str, content: str | None) -> None:
    held = make_keys(tmp_path, "robot", "pi")
    (held.folder / name).unlink()
    if content is not None:
        (held.folder / name).write_text(content)
    with pytest.raises(ConfigError, match=name):
        require_good(held.folder)


def test_an_authority_without_its_key_signs_nothing_and_is_kept(tmp_path: Path) -> None:
    make_keys(tmp_path, "robot", "pi")
    (tmp_path / "authority" / "ca.key").unlink()
    kept = (tmp_path / "authority" / "ca.pem").read_bytes()
    with pytest.raises(ConfigError, match="ca.key cannot be read"):
        make_keys(tmp_path, "robot", "other")
    assert (tmp_path / "authority" / "ca.pem").read_bytes() == kept


def test_a_certificate_without_a_role_of_ours_is_refused(tmp_path: Path) -> None:
    authority = sign("Kempelen authority", dt.timedelta(days=9), authority=True)
    folder = tmp_path / "x"
    sign("mallory", dt.timedelta(days=9), by=authority).keep(folder / "node.pem", folder / "node.key")
    authority.keep(folder / "ca.pem", tmp_path / "ca.key")
    with pytest.raises(LinkError, match="no role of Kempelen's, but 'mallory'"):
        require_good(folder)


def test_a_view_is_given_nothing_but_status_and_who_is_there() -> None:
    rules = {rule["id"]: rule for rule in access_control()["rules"]}
    assert sorted(rule for rule in rules if rule.startswith("view")) == [
        "view asks", "view is given", "view looks", "view sees",
    ]  # fmt: skip
    assert rules["view asks"]["key_exprs"] == rules["view is given"]["key_exprs"] == ["kempelen/*/*/status"]
    assert "put" not in rules["view asks"]["messages"]
