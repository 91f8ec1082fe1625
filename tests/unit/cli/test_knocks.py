"""Whoever is refused by a node with keys is told of, once a minute."""

import os
import subprocess
import sys

import pytest

from kempelen.cli.knocks import Knocks, reason_in

LINE = "WARN acc-0 zenoh_link_tls::unicast: {}. Hint: increase the system open file limit."


@pytest.mark.parametrize(
    ("said", "reason"),
    [
        ("invalid peer certificate: UnknownIssuer", "of another authority"),
        ("received fatal alert: UnknownCA", "does not trust this machine's authority"),
        ("invalid peer certificate: Expired", "has ended"),
        ("invalid peer certificate: NotValidYet", "compare the clocks"),
        ("peer sent no certificates", "has no certificate"),
        ("received corrupt message of type InvalidContentType", "does not encrypt"),
    ],
)
def test_reasons_are_told_in_words(said: str, reason: str) -> None:
    assert reason in reason_in(LINE.format(said))


def test_other_lines_are_no_knocks() -> None:
    assert reason_in("WARN zenoh_link_tls::utils: Skipping name verification of TLS server") == ""
    assert reason_in("WARN zenoh::net: UnknownIssuer") == ""


def test_the_same_reason_is_told_once_a_minute() -> None:
    told, times = list[str](), iter((0.0, 1.0, 59.0, 61.0, 61.0))
    knocks = Knocks(told.append, lambda: next(times))
    for _ in range(4):
        knocks.hear(LINE.format("UnknownCA"))
    knocks.hear(LINE.format("Expired"))
    assert [text.split(": ")[1][:12] for text in told] == ["it does not ", "it does not ", "a certificat"]


SCRIPT = """
import os
from kempelen.cli.knocks import told_of_knocks
print("before")
with told_of_knocks(lambda text: print("told", text, flush=True), keys=True):
    print("within")
    os.write(1, b"WARN zenoh_link_tls: UnknownCA\\n")
print("after")
"""


def test_the_own_output_goes_where_it_did() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True, env=dict(os.environ)
    )
    assert done.stderr == ""
    assert sorted(done.stdout.splitlines()) == [
        "after", "before", "told Somebody was refused: it does not trust this machine's authority.", "within",
    ]  # fmt: skip
