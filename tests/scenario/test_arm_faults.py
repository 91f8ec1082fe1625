"""What can be wrong with an arm in a game: told, the arm at rest, the game kept."""

from pathlib import Path

import pytest

from kempelen.app.cast import GameRequest
from kempelen.core.errors import AlarmError
from kempelen.core.protocols import RobotPhase
from kempelen.game.modes import Mode
from kempelen.game.pgn import parse_game
from kempelen.testing.live import Stage

pytestmark = pytest.mark.physics

OPTIONS = {"robot__kind": "arm", "robot__options": {"bridge": "latch"}, "sensor__kind": "none"}


async def test_a_switch_that_never_closes_ends_the_game_which_is_kept(tmp_path: Path) -> None:
    score = parse_game("1. e4 *")
    async with Stage(tmp_path, GameRequest(Mode.REPLAY, score=score), **OPTIONS) as stage:
        await stage.control.ask("fault", name="dead-switch", axis="Y")
        with pytest.raises(AlarmError, match="While homing the shoulder") as caught:
            await stage.report()
        assert "switch" in caught.value.hint
        assert stage.live.session.robot.state.phase is not RobotPhase.MOVING
        before = await stage.control.ask("truth")
        assert (await stage.control.ask("truth"))["joints"] == before["joints"]
        await stage.control.ask("fault", name="dead-switch", axis="Y", on=False)
    async with Stage(tmp_path, 1, **OPTIONS) as again:
        report = await again.report()
    assert (report.plies, report.disagreements) == (1, [])
