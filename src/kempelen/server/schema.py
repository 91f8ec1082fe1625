"""`python -m kempelen.server.schema` prints the OpenAPI description, which is kept in ``web/openapi.json``.

From it the page's types are generated (``npm run types`` in ``web/``).
"""

import json
import sys

from kempelen.app.config import Config
from kempelen.app.station import Station
from kempelen.server.app import create_app


def text() -> str:
    """As it is kept."""
    openapi = create_app(Station(Config())).openapi()
    return json.dumps(openapi, indent=1, ensure_ascii=False, sort_keys=True) + "\n"


if __name__ == "__main__":
    sys.stdout.write(text())
