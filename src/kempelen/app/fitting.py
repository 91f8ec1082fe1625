"""What of a configured table does not fit: sizes, gaps, and the reach of the robot that is configured."""

from kempelen.app.arm_reach import reach_findings, tilted_places
from kempelen.app.arm_setup import arm_setup
from kempelen.app.config import Config
from kempelen.core.fit import Finding, check_fit, refuse
from kempelen.core.places import Place
from kempelen.core.table import Table


def misfits(config: Config, table: Table) -> list[Finding]:
    """Everything that does not fit, nothing if all does.

    Args:
        config: Names the robot and the gaps to be kept.
        table: To be checked.

    Raises:
        ConfigError: the robot's options are wrong.
    """
    clearance = config.planner.clearances.vertical
    setup = arm_setup(config)
    reach = [] if setup is None else reach_findings(setup.arm, table, clearance)
    return [*check_fit(table, clearance), *reach]


def tilts(config: Config, table: Table) -> dict[Place, float]:
    """The places over which the gripper has to be tilted, and how far, rad; none for a gantry.

    Raises:
        ConfigError: the robot's options are wrong.
    """
    setup = arm_setup(config)
    return {} if setup is None else tilted_places(setup.arm, table)


def require_table(config: Config, table: Table) -> None:
    """Refuse a table on which something does not fit.

    Raises:
        FitError: with all that does not.
        ConfigError: the robot's options are wrong.
    """
    refuse(misfits(config, table))
