"""The report of a game: what was played, how well the pieces stand, how long it took."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from kempelen.app.audit import Placement


@dataclass(frozen=True, slots=True)
class GameReport:
    """What ``--report FILE`` writes.

    Attributes:
        interventions: Times that a person had to help the robot, in the whole game.
        placement: Of the transfers of this run of the program, from the twin's ground truth; None on real
            hardware.
        collisions: Moves in which a piece that was not carried moved over 1 mm (twin only).
        robot_time_s: Time in which the robot worked at moves; simulated on the twin.
        robot_time_over_bound: That, divided by the sum of the provable lower bounds of all legs.
        standing_max_mm: At the end, the worst distance from its place's centre of any piece that the game has
            moved, whichever run of the program moved it; None on real hardware.
        disagreements: Places where the physical table and the journal differ at the end (twin only).
    """

    result: str
    reason: str
    final_fen: str
    plies: int
    transfers: int
    interventions: int
    placement: Placement | None
    collisions: int
    robot_time_s: float
    wall_time_s: float
    robot_time_over_bound: float
    game: int
    standing_max_mm: float | None
    disagreements: list[str]

    def write(self, path: Path) -> None:
        """As JSON; `placement` is left out where there is none."""
        body = {name: value for name, value in asdict(self).items() if value is not None}
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(body, indent=2) + "\n")
