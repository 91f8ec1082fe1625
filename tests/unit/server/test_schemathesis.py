"""Requests that nobody thinks of, made up from the description: none is a server error."""

import json
from pathlib import Path
from typing import Any

import hypothesis
import pytest
import schemathesis
from tests.unit.server.server_bench import app_in, client_of

_EXAMPLES = 8
_SLOW = {"/api/about/doctor", "/api/ports/scan"}
"""They look at the machine, for seconds."""
_KEPT = Path(__file__).parents[3] / "web" / "openapi.json"
_SENT = {"method", "url", "json", "params", "headers", "content"}


def _operations() -> list[tuple[str, str]]:
    paths = json.loads(_KEPT.read_text(encoding="utf-8"))["paths"]
    return [(path, method) for path, found in paths.items() for method in found if path not in _SLOW]


@pytest.fixture(scope="module")
def schema() -> Any:
    return schemathesis.openapi.from_path(_KEPT)


@pytest.mark.parametrize(("path", "method"), _operations())
def test_no_request_is_a_server_error(tmp_path: Path, schema: Any, path: str, method: str) -> None:
    with client_of(app_in(tmp_path), "operator") as client:

        @hypothesis.settings(
            max_examples=_EXAMPLES,
            database=None,
            phases=[hypothesis.Phase.generate],
            suppress_health_check=list(hypothesis.HealthCheck),
        )
        @hypothesis.given(case=schema[path][method.upper()].as_strategy())
        def ask(case: Any) -> None:
            request = case.as_transport_kwargs(base_url=str(client.base_url))
            answer = client.request(**{name: value for name, value in request.items() if name in _SENT})
            assert answer.status_code < 500, (request, answer.text)

        ask()
