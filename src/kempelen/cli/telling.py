"""Observations and parameters in words."""

import chess

from kempelen.core.errors import ConfigError
from kempelen.core.senses import Observation


def assignment(text: str) -> tuple[str, float | None]:
    """``name=value``; None for ``name=``, which gives the parameter back to the reader.

    Raises:
        ConfigError: it is neither.
    """
    name, equals, value = text.partition("=")
    try:
        if not equals:
            raise ValueError  # noqa: TRY301 - both are the same mistake
        return name.strip(), float(value) if value.strip() else None
    except ValueError:
        raise ConfigError(
            f"'{text}' sets no parameter.", hint="Write NAME=NUMBER, such as hand.above=140."
        ) from None


def told(seen: Observation) -> str:
    """An observation in one line."""
    if not seen.valid:
        return f"Not to be seen ({seen.sight.value}). {seen.message}"
    shares = seen.occupancy
    counts = [int((shares.argmax(axis=1) == column).sum()) for column in range(3)]
    least = int(shares.max(axis=1).argmin())
    return (
        f"In sight: {counts[1]} white, {counts[2]} black, {counts[0]} empty. Least certain: "
        f"{chess.square_name(least)} with {100 * float(shares[least].max()):.1f} %."
    )
