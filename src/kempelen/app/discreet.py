"""Words that others may read: no directories of this machine, no secrets."""

import re

_PATH = re.compile(r"(?<![\w/:.])/(?!dev/)(?:[^\s/'\"]+/)+([^\s/'\"]*)")
_SECRET = re.compile(r"(?i)\b(token|password|session)=[^\s&'\"]+")


def without_paths(text: str) -> str:
    """Of paths only the last name; devices are what they are."""
    return _PATH.sub(r"\1", text)


def without_secrets(text: str) -> str:
    """Tokens and passwords of addresses left out, and paths as `without_paths` has them."""
    return without_paths(_SECRET.sub(r"\1=…", text))
