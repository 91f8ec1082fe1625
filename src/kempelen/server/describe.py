"""The WebSocket's messages in the OpenAPI description, which knows of HTTP alone."""

from typing import Any

from pydantic.json_schema import models_json_schema

from kempelen.server.messages import Ask, Delta, Follow, Refused, Replied, Snapshot

_DOWN = (Snapshot, Delta, Replied, Refused)
_UP = (Follow, Ask)
_REF = "#/components/schemas/{model}"


def describe(openapi: dict[str, Any]) -> dict[str, Any]:
    """Add the messages of ``/api/ws``, as the components ``Down`` and ``Up`` and all that they hold."""
    models = [*((model, "serialization") for model in _DOWN), *((model, "validation") for model in _UP)]
    _, schema = models_json_schema(models, ref_template=_REF)  # type: ignore[arg-type]  # of literals
    components = openapi.setdefault("components", {}).setdefault("schemas", {})
    for name, found in schema["$defs"].items():
        components.setdefault(name, found)
    components["Down"] = _either("What the server sends over /api/ws.", _DOWN)
    components["Up"] = _either("What clients send over /api/ws.", _UP)
    openapi["components"]["schemas"] = dict(sorted(components.items()))
    return openapi


def _either(text: str, models: tuple[type, ...]) -> dict[str, Any]:
    refs = {model.__name__: _REF.format(model=model.__name__) for model in models}
    mapping = {model.model_fields["type"].annotation.__args__[0]: refs[model.__name__] for model in models}  # type: ignore[attr-defined]
    return {
        "description": text,
        "oneOf": [{"$ref": ref} for ref in refs.values()],
        "discriminator": {"propertyName": "type", "mapping": mapping},
    }
