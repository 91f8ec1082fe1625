"""What of the table may be entered in a form: trays, pieces, the side of a square; and what came of it."""

import json
from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field

from kempelen.app.calibration_file import load_calibration
from kempelen.app.config import Config
from kempelen.app.config_pieces import PiecesConfig, Section
from kempelen.app.files import replace_file
from kempelen.app.fitting import misfits
from kempelen.app.table_file import table_file
from kempelen.core.calibration import SQUARE_RANGE
from kempelen.core.errors import ConfigError
from kempelen.core.fit import Finding
from kempelen.core.table import Table, Tray

_HEAD = """\
# Written by Kempelen's web page: stronger than the configuration file, weaker than the command line.
# Delete it, and the configuration file counts again.
"""


class TableForm(Section):
    """The part of the table that a form edits.

    Attributes:
        square: Side of a square, mm; a calibration overrules it.
        trays: Where pieces stand beside the board.
        pieces: How large they are.
    """

    square: Annotated[float, Field(ge=SQUARE_RANGE[0], le=SQUARE_RANGE[1])]
    trays: Annotated[tuple[Tray, ...], Field(max_length=8)]
    pieces: PiecesConfig = Field(default_factory=PiecesConfig)

    @classmethod
    def of(cls, config: Config) -> "TableForm":
        """As it is configured."""
        return cls(square=config.table.square, trays=config.table.trays, pieces=config.pieces)

    def applied(self, config: Config) -> Config:
        """The configuration with it."""
        table = config.table.model_copy(update={"square": self.square, "trays": self.trays})
        return config.model_copy(update={"table": table, "pieces": self.pieces})

    def toml(self) -> str:
        """As ``table.toml`` says it."""
        return _HEAD + "\n".join(self._lines()) + "\n"

    def _lines(self) -> Iterator[str]:
        yield from ("[table]", f"square = {_value(self.square)}")
        if not self.trays:
            yield "trays = []"
        for tray in self.trays:
            yield from ("", "[[table.trays]]", *_pairs(tray.model_dump()))
        pieces = self.pieces.model_dump(exclude_none=True)
        yield from ("", "[pieces]", f"preset = {_value(pieces.pop('preset'))}")
        for kind, changes in pieces.items():
            if changes:
                yield from ("", f"[pieces.{kind}]", *_pairs(changes))


def built(config: Config) -> tuple[Table, list[Finding]]:
    """The table as configured and calibrated, and what of it does not fit.

    Raises:
        FitError: two trays have the same name.
        CalibrationError: the calibration file is damaged.
    """
    table = config.build_table(load_calibration(config.calibration_path))
    return table, misfits(config, table)


def save_form(form: TableForm, config: Config) -> Config:
    """Keep it for all times to come; the configuration with it.

    Raises:
        ConfigError: it cannot be written.
    """
    path = table_file(config.data_dir, config.robot.kind)
    try:
        replace_file(path, form.toml())
    except OSError as error:
        raise ConfigError(
            f"The table cannot be written to {path}: {error.strerror}.",
            hint="Free or allow that directory, or name another one with --data-dir.",
        ) from None
    return form.applied(config)


def _pairs(values: dict[str, Any]) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in values.items()]


def _value(value: object) -> str:
    """A TOML value; JSON's strings and arrays are TOML's too."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_value, value))}]"
    return repr(value) if isinstance(value, float) else json.dumps(value)
