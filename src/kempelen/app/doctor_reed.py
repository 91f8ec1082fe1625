"""Is the reed board there that the games are to be felt by?"""

from kempelen.app.config import Config
from kempelen.app.doctor_rows import Check, failed, ok
from kempelen.app.reed import greet, reed_port
from kempelen.core.errors import KempelenError

_NAME = "reed board"
_WIRED = {"diodes": "a diode at each switch", "plain": "no diodes", "direct": "each switch read by itself"}


async def examine_reed(config: Config) -> Check:
    """The configured board answers, and speaks this protocol."""
    if config.on_twin and not config.sensor.port:
        return ok(_NAME, "the twin: it brings its own")
    try:
        port = await reed_port(config, None)
        hello = await greet(port)
    except KempelenError as error:
        return failed(_NAME, error)
    return ok(_NAME, f"{hello.identity} at {port}, {_WIRED[hello.wiring]}, firmware {hello.firmware}")
