import json

import pytest

from kempelen.core.errors import ConfigError
from kempelen.sensing.parameters import Parameter, Parameters


def parameters() -> Parameters:
    return Parameters(Parameter("a.b", 2.0, "mm", 0, 10, "how much"), Parameter("c", 1.0, "", 0, 1, "share"))


def test_an_override_rules_until_it_is_given_back() -> None:
    known = parameters()
    known.estimate("a.b", 3.0, "12 squares")
    known.override("a.b", 7.0)
    known.estimate("a.b", 4.0, "13 squares")
    assert known["a.b"] == 7.0
    known.override("a.b", None)
    assert known["a.b"] == 4.0


def test_estimates_stay_in_range_and_finite() -> None:
    known = parameters()
    known.estimate("a.b", 99.0, "nonsense")
    assert known["a.b"] == 10.0
    known.estimate("a.b", float("nan"), "nothing seen")
    assert known["a.b"] == 10.0


def test_json_tells_everything() -> None:
    known = parameters()
    known.override_all({"c": 0.5})
    rows = json.loads(json.dumps(known.to_json()))
    assert [row["name"] for row in rows] == ["a.b", "c"]
    assert rows[1]["overridden"]
    assert rows[1]["value"] == 0.5
    assert rows[1]["estimate"] == 1.0
    assert rows[0]["source"] == "prior"
    assert rows[0]["unit"] == "mm"


@pytest.mark.parametrize(("name", "value", "said"), [("nope", 1.0, "a.b, c"), ("c", 3.0, "outside 0 to 1")])
def test_wrong_overrides_are_refused(name: str, value: float, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        parameters().override(name, value)
