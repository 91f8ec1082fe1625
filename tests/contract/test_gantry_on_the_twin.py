"""The contract of every robot once more, on the twin's own process with its physics."""

from collections.abc import Iterator

import pytest

from kempelen.testing.contracts.robot import RobotContract
from kempelen.testing.twin_rig import TwinRig


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TwinRig]:
    rig = TwinRig(tmp_path_factory.mktemp("twin"), speed=20.0)
    yield rig
    rig.close()


@pytest.mark.physics
class TestGantryOnTheTwin(RobotContract):
    @pytest.fixture
    def rig(self, twin: TwinRig) -> TwinRig:
        twin.switch_on()
        return twin
