"""What is wrong in a configuration, in sentences: key, line, allowed range, nearest known key."""

import difflib
import re
from collections.abc import Iterator, Mapping
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

Location = tuple[str | int, ...]

_HEADER = re.compile(r"\s*(\[\[?)\s*([^\]#]+?)\s*\]")
_KEY = re.compile(r"""\s*((?:[\w-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[\w-]+|"[^"]*"|'[^']*'))*)\s*=""")
_SIGNS = {Gt: ("above", "gt"), Ge: ("from", "ge"), Lt: ("below", "lt"), Le: ("to", "le")}


def explain(
    error: ValidationError, model: type[BaseModel], text: str, where: str, overrides: Mapping[str, object]
) -> str:
    """All errors, a line each.

    Args:
        error: What pydantic found.
        model: The root model.
        text: The file.
        where: The file's name; empty when there is none.
        overrides: The dotted keys that did not come from the file.
    """
    lines = key_lines(text)
    seen: dict[str, str] = {}
    for detail in error.errors(include_url=False):
        location = _real(detail["loc"], model)
        seen.setdefault(_dotted(location), _sentence(detail, location, model))
    told = [f"{_source(key, lines, where, overrides)}{sentence}" for key, sentence in seen.items()]
    return "\n".join(told)


def key_lines(text: str) -> dict[str, int]:
    """Where each key of a TOML file stands: dotted key (array elements by index) to line from 1."""
    found: dict[str, int] = {}
    arrays: dict[str, int] = {}
    section = ""
    for number, line in enumerate(text.splitlines(), 1):
        if header := _HEADER.match(line):
            section = _plain(header[2])
            if header[1] == "[[":
                arrays[section] = arrays.get(section, -1) + 1
                section = f"{section}.{arrays[section]}"
            found.setdefault(section, number)
        elif key := _KEY.match(line):
            name = _plain(key[1])
            found.setdefault(f"{section}.{name}" if section else name, number)
    return found


def _plain(key: str) -> str:
    return ".".join(part.strip().strip("\"'") for part in key.split("."))


def _source(key: str, lines: Mapping[str, int], where: str, overrides: Mapping[str, object]) -> str:
    if key in overrides or not where:
        return ""
    if number := _line(key, lines):
        return f"{where}:{number}: "
    return f"{where}: "


def _line(key: str, lines: Mapping[str, int]) -> int | None:
    """The line of a key; else the first one within it, else that of the section it should stand in."""
    within = [number for other, number in lines.items() if other == key or other.startswith(f"{key}.")]
    if within or not key:
        return min(within, default=None)
    return _line(key.rpartition(".")[0], lines)


def _sentence(detail: ErrorDetails, location: Location, model: type[BaseModel]) -> str:
    key, value = _dotted(location), detail["input"]
    if detail["type"] == "extra_forbidden":
        return f"unknown key '{key}'.{_nearest(location, model)}"
    if detail["type"] == "missing":
        return f"'{key}' is missing."
    field = _field(location, model)
    allowed = _allowed(field.annotation, field.metadata) if field else ""
    shown = f" is {value!r}" if isinstance(value, (bool, int, float, str)) else ""
    said = detail["msg"].removeprefix("Value error, ")
    return f"'{key}'{shown}: {f'allowed: {allowed}' if allowed else said}."


def _nearest(location: Location, model: type[BaseModel]) -> str:
    parent = _model(location[:-1], model)
    known = list(parent.model_fields) if parent else []
    near = difflib.get_close_matches(str(location[-1]), known, n=2, cutoff=0.6)
    if near:
        return f" Did you mean {' or '.join(repr(name) for name in near)}?"
    return f" Known here: {', '.join(known)}." if known else ""


def _dotted(location: Location) -> str:
    return ".".join(map(str, location))


def _real(location: Location, model: type[BaseModel]) -> Location:
    """The location without the names of a union's branches, which pydantic puts at its end."""
    kept: Location = ()
    for part in location:
        at_section = _model(kept, model) is not None
        field = None if at_section else _field(kept, model)
        origin = get_origin(field.annotation) if field and not isinstance(part, int) else None
        if origin in {Union, UnionType}:
            break
        kept = (*kept, part)
        if origin is dict:
            break
    return kept


def _model(location: Location, root: type[BaseModel]) -> type[BaseModel] | None:
    """The section at a location, if it is one."""
    if not location:
        return root
    field = _field(location, root)
    return next(_models(field.annotation), None) if field else None


def _field(location: Location, root: type[BaseModel]) -> FieldInfo | None:
    """The field at a location; elements of arrays count as the array's."""
    model: type[BaseModel] | None = root
    field = None
    for part in location:
        if isinstance(part, int):
            continue
        if model is None:
            return field
        field = model.model_fields.get(part)
        if field is None:
            return None
        model = next(_models(field.annotation), None)
    return field


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """The sections that a type names, be it directly or in an array or a union."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _models(inner)


def _allowed(annotation: Any, metadata: list[Any]) -> str:
    """What a scalar may be, in words; empty when that says nothing."""
    if get_origin(annotation) in {Union, UnionType}:
        return " or ".join(filter(None, (_allowed(branch, metadata) for branch in get_args(annotation))))
    if get_origin(annotation) is dict:
        return "a number, a text, true or false"
    if get_origin(annotation) is Literal:
        return ", ".join(repr(choice) for choice in get_args(annotation))
    if hasattr(annotation, "__metadata__"):
        inner, *own = get_args(annotation)
        bounds = [
            item for entry in own for item in (entry.metadata if isinstance(entry, FieldInfo) else [entry])
        ]
        return _allowed(inner, bounds)
    if annotation not in {int, float}:
        return ""
    words = [
        f"{word} {getattr(bound, name):.10g}"
        for kind, (word, name) in _SIGNS.items()
        for bound in metadata
        if isinstance(bound, kind)
    ]
    return " ".join(["a whole number" if annotation is int else "a number", *words])
