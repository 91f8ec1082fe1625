"""The report of a game: what was played, how well the pieces stand, how long it took."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from kempelen.app.audit import Placement
from kempelen.app.files import replace_file
from kempelen.core.errors import ConfigError


@dataclass(frozen=True, slots=True)
class GameReport:
    """What ``--report FILE`` writes.

    Attributes:
        result: ``1-0``, ``0-1``, ``1/2-1/2``; ``*`` when the game goes on another time.
        reason: Of the end; ``interrupted`` when the game goes on another time.
        interventions: Times that a person had to help the robot, in the whole game.
        placement: Of the transfers of this run of the program, from the twin's ground truth; None on real
            hardware.
        collisions: Moves in which a piece that was not carried moved over 1 mm (twin only).
        robot_time_s: Time in which the robot worked at moves; simulated on the twin.
        robot_time_over_bound: Robot time of the carries alone, from the closed grip to the release and
            without the gripper's own wait, over the sum of their provable lower bounds; 0 when none was
            measured.
        standing_max_mm: At the end, the worst distance from its place's centre of any piece that the game has
            moved, whichever run of the program moved it; None on real hardware.
        disagreements: Places that did not hold what the journal says, after a move or at the end (twin only).
        error: What interrupted the game, if it was a fault.
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
    error: str | None = None

    def write(self, path: Path) -> None:
        """As JSON; what there is not is left out: `placement` on real hardware, `error` of a sound game.

        Raises:
            ConfigError: the file cannot be written.
        """
        body = {name: value for name, value in asdict(self).items() if value is not None}
        try:
            replace_file(path, json.dumps(body, indent=2) + "\n")
        except OSError as error:
            raise ConfigError(
                f"The report {path} cannot be written: {error.strerror or error}.",
                hint="The game itself is in the journal: kempelen games",
            ) from None
