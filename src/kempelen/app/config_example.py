"""The configuration file with every key, its meaning and its default, written from the models themselves."""

import json
import re
import textwrap
from collections.abc import Iterator
from inspect import cleandoc

from pydantic import BaseModel

from kempelen.app.config import Config, RobotConfig

_WIDTH = 100
_ATTRIBUTE = re.compile(r"^    (\w+): (.*)$")


def example_toml(kind: str | None = None) -> str:
    """A file that says what the defaults say, for a kind of robot; None: the usual one."""
    config = Config() if kind is None else Config(robot=RobotConfig(kind=kind))
    head = [
        "# Kempelen's configuration: every key with its default. Keep the lines that you change.",
        "# Lengths are millimetres, angles radians unless the key says degrees, times seconds.",
    ]
    return "\n".join([*head, *_section(config, "", set())]) + "\n"


def attribute_docs(model: type[BaseModel]) -> dict[str, str]:
    """The "Attributes:" part of a model's docstring: field name to sentence, whitespace folded."""
    docs: dict[str, str] = {}
    name = ""
    _, _, attributes = cleandoc(model.__doc__ or "").partition("Attributes:\n")
    for line in attributes.splitlines():
        if match := _ATTRIBUTE.match(line):
            name = match[1]
            docs[name] = match[2]
        elif line.startswith(" " * 8) and name:
            docs[name] += " " + line.strip()
        elif line and not line.startswith(" "):
            break
    return docs


def _section(model: BaseModel, path: str, told: set[type[BaseModel]]) -> Iterator[str]:
    """Scalars first, then the sections within: TOML wants it so. Models ``told`` are not explained anew."""
    docs = {} if type(model) in told else attribute_docs(type(model))
    told.add(type(model))
    inner: list[str] = []
    for name in type(model).model_fields:
        value, key = getattr(model, name), f"{path}.{name}" if path else name
        if isinstance(value, BaseModel):
            inner += ["", *_comment(_summary(value)), f"[{key}]", *_section(value, key, told)]
        elif isinstance(value, dict):
            inner += ["", *_comment(docs.get(name, "")), f"[{key}]"]
        elif isinstance(value, tuple) and value and isinstance(value[0], BaseModel):
            for element in value:
                inner += ["", *_comment(_summary(element)), f"[[{key}]]", *_section(element, key, told)]
        else:
            yield from _comment(docs.get(name, ""))
            yield f"# {name} =" if value is None else f"{name} = {_value(value)}"
    yield from inner


def _summary(model: BaseModel) -> str:
    return cleandoc(type(model).__doc__ or "").partition("\n\n")[0]


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text.replace("`", ""), _WIDTH, initial_indent="# ", subsequent_indent="# ")


def _value(value: object) -> str:
    """A TOML value; JSON's strings, booleans and arrays are TOML's too."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_value, value))}]"
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False)
