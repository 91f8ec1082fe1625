"""What a twin's reed board is like."""

from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from kempelen.core.reed import PROTOCOL_VERSION, Wiring

Share = Annotated[float, Field(gt=0, le=1)]


class ReedSpec(BaseModel):
    """A reed board under the twin's squares.

    Attributes:
        wiring: "diodes" (matrix, a diode in series with each switch), "plain" (matrix without) or "direct"
            (multiplexers).
        closing: A magnet nearer than this closes a switch, as a share of the square's side.
        opening: One farther than this lets it open again.
        bounce_ms: Contacts bounce for at most so long, ms.
        identity: Of the board, 8 hexadecimal digits.
        version: Of the protocol that it speaks; another one than the program's for trying that out.
        link: Where a stable symbolic link to its pseudo-terminal is kept; empty for none.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    wiring: Wiring = Wiring.DIODES
    closing: Share = 0.3
    opening: Share = 0.36
    bounce_ms: Annotated[float, Field(ge=0, le=15)] = 3.0
    identity: Annotated[str, Field(pattern=r"^[0-9A-F]{8}$")] = "7F3A09C1"
    version: Annotated[int, Field(ge=1, le=999)] = PROTOCOL_VERSION
    link: str = ""

    @model_validator(mode="after")
    def _hysteresis(self) -> Self:
        if self.opening < self.closing:
            raise ValueError(
                f"opening {self.opening} is nearer than closing {self.closing}; a switch opens farther away"
            )
        return self
