"""The description of everything that goes over the network."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from kempelen.server.commands import AnyCommand
from kempelen.server.messages import Ask, Delta, Follow, Refused, Replied, Snapshot
from kempelen.server.schema import text
from kempelen.server.topics import Topics

KEPT = Path(__file__).parents[3] / "web" / "openapi.json"


@pytest.fixture(scope="module")
def described() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(text())
    return found


def test_the_page_is_built_from_this_description(described: dict[str, Any]) -> None:
    kept = json.loads(KEPT.read_text(encoding="utf-8"))
    assert kept == described, "write it again: python -m kempelen.server.schema > web/openapi.json"


def test_messages_and_commands_are_in_it(described: dict[str, Any]) -> None:
    schemas = described["components"]["schemas"]
    models: list[type[BaseModel]] = [Ask, Delta, Follow, Refused, Replied, Snapshot, Topics]
    commands = AnyCommand.__origin__.__args__  # type: ignore[attr-defined]
    assert {model.__name__ for model in (*models, *commands)} <= schemas.keys()
    assert {entry["$ref"].rpartition("/")[2] for entry in schemas["Down"]["oneOf"]} == {
        "Snapshot", "Delta", "Replied", "Refused",
    }  # fmt: skip
    assert set(schemas["Up"]["discriminator"]["mapping"]) == {"follow", "command"}


def test_everything_that_is_referred_to_is_there(described: dict[str, Any]) -> None:
    referred = set(re.findall(r'#/components/schemas/([^"]+)"', json.dumps(described)))
    assert referred <= described["components"]["schemas"].keys()


def test_every_operation_says_what_it_is(described: dict[str, Any]) -> None:
    for path, operations in described["paths"].items():
        assert path.startswith("/api/")
        for operation in operations.values():
            assert operation["description"], path
