import inspect

import numpy as np
import pytest

from kempelen.core import errors
from kempelen.core.errors import KempelenError, RobotError
from kempelen.core.senses import Observation, Sight

TREE = [error for _, error in inspect.getmembers(errors, inspect.isclass) if issubclass(error, KempelenError)]


def test_every_error_is_in_the_one_tree_and_drawn_there() -> None:
    assert len(TREE) > 10
    for error in TREE:
        assert issubclass(error, KempelenError)
        assert error.__name__ in (errors.__doc__ or "")
        assert error.__doc__


def test_no_error_ends_the_program_as_if_all_were_well() -> None:
    assert all(error.exit_code > 0 for error in TREE)
    assert len({error.exit_code for error in TREE if RobotError not in error.__mro__}) > 5


def test_an_error_says_what_happened_and_what_to_do() -> None:
    error = RobotError("The x axis is 3 mm beyond 700 mm.", hint="Home the robot.")
    assert (error.message, error.hint) == ("The x axis is 3 mm beyond 700 mm.", "Home the robot.")
    assert str(error) == "The x axis is 3 mm beyond 700 mm. Home the robot."
    assert str(RobotError("No hint.")) == "No hint."


def test_an_observation_has_a_probability_for_each_square() -> None:
    assert Observation(np.zeros((64, 3)), 0.0).valid
    with pytest.raises(ValueError, match=r"shape \(8, 8\), wanted \(64, 3\)"):
        Observation(np.zeros((8, 8)), 0.0)


def test_likelihoods_become_probabilities_and_a_blind_report_knows_nothing() -> None:
    seen = np.log(np.tile([0.2, 0.6, 0.2], (64, 1))) - 1000.0
    assert Observation(seen, 0.0).occupancy[0] == pytest.approx([0.2, 0.6, 0.2])
    blind = Observation.blind(1.0, Sight.HAND, "A hand is over the board.")
    assert blind.hand
    assert not blind.valid
    assert blind.occupancy == pytest.approx(np.full((64, 3), 1 / 3))
