"""Who may say what: zenoh's access control, from the role in each other program's certificate.

Every program has the same rules and minds them itself, for what comes in from another one and for what goes
out to it. Whatever is not named here is denied, also to a valid certificate.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kempelen.nodes.messages import ROOT

_ANY = f"{ROOT}/*/*"
"""Any protocol, any table: that one of another version is there may be seen."""


@dataclass(frozen=True)
class Role:
    """What programs of a kind do.

    Attributes:
        about: For people.
        serves: Keys at which they answer, and which they tell and stand for.
        uses: Keys which they ask and listen to.
        sees: Keys whose coming and going they may watch.
    """

    about: str
    serves: tuple[str, ...] = ()
    uses: tuple[str, ...] = ()
    sees: tuple[str, ...] = ()


_DEVICES = tuple(f"{_ANY}/{word}/**" for word in ("robot", "door", "board", "camera", "engine"))
ROLES: Mapping[str, Role] = {
    "robot": Role(  # a twin has board and camera in it
        "offers a robot, or a whole table",
        serves=tuple(f"{_ANY}/{word}/**" for word in ("robot", "door", "board", "camera")),
    ),
    "board": Role("offers a reed board", serves=(f"{_ANY}/board/**",)),
    "camera": Role("offers what a camera sees", serves=(f"{_ANY}/camera/**",)),
    "engine": Role("offers an engine", serves=(f"{_ANY}/engine/**",)),
    "arbiter": Role(
        "leads a table: the games, the page",
        serves=(f"{_ANY}/status", f"{_ANY}/arbiter"),
        uses=_DEVICES,
        sees=(f"{ROOT}/**",),
    ),
    "view": Role("looks on", uses=(f"{_ANY}/status",), sees=(f"{_ANY}/arbiter",)),
}
_GIVING = ["put", "reply", "declare_queryable", "liveliness_token"]
_TAKING = ["query", "declare_subscriber"]
_LOOKING = ["liveliness_query", "declare_liveliness_subscriber"]


def access_control() -> dict[str, Any]:
    """In zenoh's own terms."""
    rules = [rule for name, role in ROLES.items() for rule in _rules(name, role)]
    subjects = [{"id": name, "cert_common_names": [name]} for name in ROLES]
    policies = [
        {"subjects": [name], "rules": [rule["id"] for rule in rules if rule["id"].startswith(f"{name} ")]}
        for name in ROLES
    ]
    return {
        "enabled": True, "default_permission": "deny",
        "rules": rules, "subjects": subjects, "policies": policies,
    }  # fmt: skip


def _rules(name: str, role: Role) -> list[dict[str, Any]]:
    """From the other one's role: what may come in from it, and what may go out to it."""
    wanted = (
        ("gives", "ingress", _GIVING, role.serves),
        ("is asked", "egress", _TAKING + _LOOKING, role.serves),
        ("asks", "ingress", _TAKING, role.uses),
        ("is given", "egress", _GIVING, role.uses),
        ("looks", "ingress", _LOOKING, role.sees),
        ("sees", "egress", ["liveliness_token"], role.sees),
    )
    return [
        {
            "id": f"{name} {what}", "permission": "allow", "flows": [flow],
            "messages": messages, "key_exprs": list(keys),
        }
        for what, flow, messages, keys in wanted
        if keys
    ]  # fmt: skip
