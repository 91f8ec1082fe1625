"""The twin's time scale as people write it."""

from kempelen.core.errors import ConfigError

FASTEST = 1000.0


def parse_speed(text: str) -> float:
    """``"1"``, ``"20"`` or ``"max"`` (0, as fast as it can).

    Raises:
        ConfigError: neither.
    """
    if text.strip().lower() == "max":
        return 0.0
    try:
        speed = float(text)
    except ValueError:
        speed = -1.0
    if not 0 < speed <= FASTEST:
        raise ConfigError(f"Speed '{text}' is no time scale.", hint=f"Give 1 to {FASTEST:.0f}, or max.")
    return speed
