"""What nodes say to each other: versioned, typed, JSON.

Times in messages are of the *node's* clock, which the other side learns with every answer. A message that
says until when it may be obeyed therefore means the same on machines whose own clocks differ.
"""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from kempelen.core import errors
from kempelen.core.errors import KempelenError, LinkError
from kempelen.core.protocols import Action, Follow, FollowJoints, RobotState, SetGripper
from kempelen.core.table import WorkSpace

PROTOCOL = 1
"""Of this program; part of every key, so that others are seen but never misunderstood."""
ROOT = "kempelen"

Number = Annotated[float, Field(allow_inf_nan=False)]
Numbers = tuple[Number, ...]


def key_of(table: str, *words: str, protocol: int | str = PROTOCOL) -> str:
    """``kempelen/1/TABLE/robot/do``."""
    return "/".join((ROOT, str(protocol), table, *words))


class Message(BaseModel):
    """Frozen, and unknown fields are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def pack(self) -> bytes:
        """As it travels."""
        return self.model_dump_json().encode()

    @classmethod
    def unpack(cls, content: bytes) -> Self:
        """Read one.

        Raises:
            LinkError: the content is damaged or something else.
        """
        try:
            return cls.model_validate_json(content)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            where = ".".join(map(str, first["loc"])) or "the whole"
            raise LinkError(
                f"A message of {len(content)} bytes is no {cls.__name__}: {where}: {first['msg']}.",
                hint="Check that both programs are of the same version: kempelen --version",
            ) from None


class Trouble(Message):
    """An error that crosses the network and is raised on the other side as what it was."""

    kind: str
    message: str
    hint: str = ""

    @classmethod
    def of(cls, error: KempelenError) -> Self:
        """Of an error here."""
        return cls(kind=type(error).__name__, message=str(error.message), hint=str(error.hint))

    def error(self) -> KempelenError:
        """The error itself; one of a kind that is unknown here is a `LinkError`."""
        kind = getattr(errors, self.kind, LinkError)
        known = isinstance(kind, type) and issubclass(kind, KempelenError)
        made: KempelenError = (kind if known else LinkError)(self.message, hint=self.hint)
        return made


class FollowMessage(Message):
    """`kempelen.core.protocols.Follow`, or `FollowJoints` where there are times."""

    do: Literal["follow"] = "follow"
    vertices: tuple[Numbers, ...]
    times: Numbers = ()
    seconds: Number


class GripperMessage(Message):
    """`kempelen.core.protocols.SetGripper`."""

    do: Literal["gripper"] = "gripper"
    closed: bool
    seconds: Number


ActionMessage = Annotated[FollowMessage | GripperMessage, Field(discriminator="do")]


def action_message(action: Action) -> ActionMessage:
    """As it travels."""
    if isinstance(action, SetGripper):
        return GripperMessage(closed=action.closed, seconds=action.seconds)
    times = tuple(action.times.tolist()) if isinstance(action, FollowJoints) else ()
    vertices = tuple(map(tuple, action.vertices.tolist()))
    return FollowMessage(vertices=vertices, times=times, seconds=action.seconds)


def action_of(message: ActionMessage) -> Action:
    """What it means."""
    if isinstance(message, GripperMessage):
        return SetGripper(message.closed, message.seconds)
    vertices = np.array(message.vertices, dtype=np.float64)
    if message.times:
        return FollowJoints(vertices, np.array(message.times), message.seconds)
    return Follow(vertices, message.seconds)


Deed = Literal["home", "run", "retract", "hold", "resume", "cancel", "stop", "recover", "jog", "jog_stop"]


class Take(Message):
    """An arbiter wants the robot.

    Attributes:
        client: Of this program's own making, unlike any other's.
        who: For people: user and machine.
    """

    client: Annotated[str, Field(min_length=8, max_length=64)]
    who: Annotated[str, Field(max_length=120)]


class Taken(Message):
    """It has it, or why not.

    Attributes:
        lease: To be shown with every command; empty when refused.
        clock: Of the node, s.
    """

    lease: str = ""
    clock: float
    name: str = ""
    space: WorkSpace | None = None
    state: RobotState | None = None
    trouble: Trouble | None = None


class Beat(Message):
    """The arbiter is there.

    Attributes:
        leaves: For the last time: the robot is free for others.
    """

    lease: str
    leaves: bool = False


class News(Message):
    """What the robot does, at each change and with each beat.

    Attributes:
        count: Rises; an older one that comes later is passed over.
        lease: Who has the robot.
        finished: Command that has just ended; 0 for none.
    """

    count: int
    clock: float
    state: RobotState
    lease: str = ""
    finished: int = 0


class Call(Message):
    """One command.

    Attributes:
        number: Rises from 1 with each command of a lease. The same number is the same command: it is carried
            out once, however often it arrives.
        valid_until: Of the node's clock, s: later it is not begun any more.
    """

    lease: str
    number: Annotated[int, Field(ge=1)]
    valid_until: Number
    deed: Deed
    group: tuple[ActionMessage, ...] = ()
    direction: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)
    speed: Number = 0.0


class Outcome(Message):
    """What has become of a command.

    Attributes:
        status: "refused" means that nothing was done, and nothing will be.
        late: It was refused because it came too late; with a new time it may be sent again.
    """

    number: int
    status: Literal["running", "done", "failed", "refused"]
    clock: float
    state: RobotState
    trouble: Trouble | None = None
    late: bool = False
