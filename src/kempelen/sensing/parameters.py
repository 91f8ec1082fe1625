"""Numbers that a reader works with: each visible, estimated by the reader, and open to be overridden live."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kempelen.core.errors import ConfigError


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number.

    Attributes:
        name: ``reader.what_it_is``.
        estimate: What the reader itself takes, in ``unit``.
        unit: ``mm``, ``mm2``, ``s``, ``squares`` or nothing for a ratio.
        low: Smallest value that makes sense.
        high: Largest.
        about: What it does, one phrase.
        source: Where the estimate comes from: ``prior``, or what it was learned from.
        override: The operator's value; None while the estimate rules.
    """

    name: str
    estimate: float
    unit: str
    low: float
    high: float
    about: str
    source: str = "prior"
    override: float | None = None

    @property
    def value(self) -> float:
        """What is worked with."""
        return self.estimate if self.override is None else self.override

    def to_json(self) -> dict[str, Any]:
        """All of it as plain data."""
        return {
            "name": self.name,
            "value": self.value,
            "estimate": self.estimate,
            "unit": self.unit,
            "low": self.low,
            "high": self.high,
            "about": self.about,
            "source": self.source,
            "overridden": self.override is not None,
        }


class Parameters:
    """A reader's numbers under their names.

    Args:
        known: As they are before anything was seen.
    """

    def __init__(self, *known: Parameter) -> None:
        self._known = {parameter.name: parameter for parameter in known}

    def __getitem__(self, name: str) -> float:
        return self._known[name].value

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self._known.values())

    def estimate(self, name: str, value: float, source: str) -> None:
        """Take what a reader found, kept within the parameter's range; an override goes on ruling."""
        known = self._known[name]
        if np.isfinite(value):
            kept = float(np.clip(value, known.low, known.high))
            self._known[name] = replace(known, estimate=kept, source=source)

    def override(self, name: str, value: float | None) -> None:
        """Set a number by hand; None gives it back to the reader.

        Raises:
            ConfigError: no such parameter, or a value outside its range.
        """
        known = self._known.get(name)
        if known is None:
            raise ConfigError(
                f"There is no parameter '{name}'.", hint=f"There are: {', '.join(sorted(self._known))}."
            )
        if value is not None and not known.low <= value <= known.high:
            raise ConfigError(
                f"{name} = {value:g} {known.unit} is outside {known.low:g} to {known.high:g}.",
                hint=f"Now it is {known.value:g}: {known.about}.",
            )
        self._known[name] = replace(known, override=value)

    def override_all(self, values: Mapping[str, float]) -> None:
        """Set those that are named, as `override` does."""
        for name, value in values.items():
            self.override(name, value)

    def to_json(self) -> list[dict[str, Any]]:
        """All of them as plain data, in the order of their definition."""
        return [parameter.to_json() for parameter in self]
