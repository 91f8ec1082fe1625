"""How games are run."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class ArbiterOptions:
    """How games are run.

    Attributes:
        hands: Who carries a person's moves.
        park: Whether the hand goes clear of the camera after each move, not only at the end.
        table_digest: Identifies table and calibration in the journal.
        robot: Kind of robot, for the journal: another kind has another table.
        program: Name put into the journal when a game is resumed.
    """

    hands: Literal["robot", "person"] = "robot"
    park: bool = True
    table_digest: str = ""
    robot: str = ""
    program: str = "kempelen"
