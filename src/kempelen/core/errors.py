"""The one tree of errors.

::

    KempelenError
    ├── ConfigError          the configuration file or a command-line option
    ├── CalibrationError     corners that cannot be a board, a calibration file that does not fit
    ├── FitError             board, trays, pieces and work space do not fit together
    ├── GameError            a command that the game's present state does not allow
    ├── NotationError        a move, a position or a PGN file that cannot be read or played
    ├── EngineError          the program that thinks is missing, broken or silent
    ├── JournalError         the durable record is locked, damaged or of another version
    ├── MotionError          a path that cannot be planned or would touch something
    │   └── ReachError       a pose that an arm cannot take, and by how much it misses it
    ├── RobotError           the machine
    │   ├── LinkError        the wire: absent, no permission, lost, another device answering
    │   ├── AlarmError       the controller raised an alarm and has locked itself
    │   ├── NotHomedError    a motion was asked for before homing
    │   ├── BusyError        a group of motions is at work, another one was offered
    │   └── StoppedError     an e-stop or a cancel ended the motion
    ├── SensorError          the senses
    │   ├── CameraError      a camera or a recording: absent, forbidden, unplugged, damaged, of a wrong format
    │   └── BoardNotFoundError  no whole board in the picture, with the reason
    ├── SettingsError        the controller's settings do not fit the table
    ├── TwinError            the simulated world could not be started or reached
    └── OperatorNeededError  only a person can go on from here

Each message says what happened, where, the number with its unit, the allowed range and what to do next.
"""


class KempelenError(Exception):
    """Anything that Kempelen can explain.

    Args:
        message: What happened and where, with the number and the allowed range.
        hint: What to do next, one sentence; shown on its own line.
    """

    exit_code = 1

    def __init__(self, message: str, *, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message} {self.hint}".rstrip()


class ConfigError(KempelenError):
    """The configuration file or an option is wrong."""

    exit_code = 2


class CalibrationError(KempelenError):
    """Touched corners or a calibration file do not describe a board."""

    exit_code = 2


class FitError(KempelenError):
    """Board, trays, pieces and work space do not fit together."""

    exit_code = 2


class GameError(KempelenError):
    """A command that the game's present state does not allow; nothing was changed."""

    exit_code = 2


class NotationError(KempelenError):
    """A move, a position or a PGN file cannot be read or played."""

    exit_code = 2


class EngineError(KempelenError):
    """The program that thinks is missing, broken or silent."""

    exit_code = 3


class JournalError(KempelenError):
    """The durable record is locked, damaged or of another version."""

    exit_code = 4


class MotionError(KempelenError):
    """A path cannot be planned or would touch something."""

    exit_code = 5


class ReachError(MotionError):
    """A pose is out of an arm's reach or beyond its joints' ranges; the message says by how much."""


class RobotError(KempelenError):
    """The machine refused, failed or cannot be reached."""

    exit_code = 6


class LinkError(RobotError):
    """The wire is absent, forbidden, lost or leads to another device."""


class AlarmError(RobotError):
    """The controller raised an alarm and has locked itself."""


class NotHomedError(RobotError):
    """A motion was asked for before homing."""


class BusyError(RobotError):
    """A group of motions is at work; another one was offered."""


class StoppedError(RobotError):
    """An e-stop or a cancel ended the motion."""


class SensorError(KempelenError):
    """The senses cannot do what was asked."""

    exit_code = 9


class CameraError(SensorError):
    """A camera or a recording is absent, forbidden, unplugged, damaged or of a wrong format."""


class BoardNotFoundError(SensorError):
    """No whole board is in the picture; the message says why and what would help."""


class SettingsError(RobotError):
    """The controller's settings do not fit the table."""


class TwinError(KempelenError):
    """The simulated world could not be started or reached."""

    exit_code = 7


class OperatorNeededError(KempelenError):
    """Only a person can go on from here; the game waits."""

    exit_code = 8
