"""What the core has to say to the outside, in the order in which it must be heard."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from arm_executor.bins.book import BookState
from pack_msgs_py.alarms import Alarm
from pack_msgs_py.cell_values import BoxEvent, Report
from pack_msgs_py.codes import ErrorCode, Mode, Phase
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin
from pack_msgs_py.wording import how_many

#: What a request is told apart by; only the one who asked understands it.
Ticket: TypeAlias = Any


@dataclass(frozen=True)
class Happened:
    """Something happened to a box."""

    event: BoxEvent


@dataclass(frozen=True)
class BinsChanged:
    """The bins are now as in ``state``."""

    state: BookState


@dataclass(frozen=True)
class BinClosed:
    """A bin was taken away with this content; poses by box id, bin frame."""

    bin: Bin
    poses: Mapping[str, Pose]


def closed_with(old: Bin) -> str:
    """What is said of a bin that was closed."""
    return f'bin {old.id} closed with {how_many(len(old.boxes), "box")}'


def contents(bins: Iterable[Bin]) -> str:
    """Which bins, and how many boxes are in each."""
    return ', '.join(f'{bin_.id} ({how_many(len(bin_.boxes), "box")})' for bin_ in bins)


@dataclass(frozen=True)
class Progress:
    """How far the goal is; ``left_s`` is the robot time left until its deadline."""

    goal_id: bytes
    phase: Phase
    fraction: float
    left_s: float


@dataclass(frozen=True)
class Finished:
    """A goal has ended."""

    report: Report


@dataclass(frozen=True)
class Checked:
    """Answer for one candidate placement; ``motion_s`` is 0 when there is no motion.

    ``predicted`` : refused by a prediction alone.
    """

    code: ErrorCode
    message: str = ''
    motion_s: float = 0.0
    predicted: bool = False


@dataclass(frozen=True)
class Replied:
    """Answer to the request that was made with ``ticket``."""

    ticket: Ticket
    answer: Any


@dataclass(frozen=True)
class AlarmsChanged:
    """All alarms and warnings that stand now."""

    alarms: tuple[Alarm, ...]


@dataclass(frozen=True)
class Said:
    """For the log."""

    level: Literal['info', 'warning', 'error']
    text: str


@dataclass(frozen=True)
class Failed:
    """The executor could not start; ``text`` says why."""

    text: str


@dataclass(frozen=True)
class Status:
    """What the heartbeat says.

    Attributes
    ----------
    mode, message : of the executor, and why it is in it, empty when all is well.
    active_box : id of the box being handled, empty for none.
    remaining_s : predicted robot time until its goal ends.
    last_fault : how the last goal that failed did so.
    tracking_error : farthest that a joint has strayed, as a share of what is allowed.
    paused : by whom the arm is paused, or will be once its box is in its bin; empty when not.
    """

    mode: Mode
    active_box: str
    remaining_s: float
    message: str
    last_fault: str = ''
    tracking_error: float = 0.0
    paused: str = ''


Output = (
    Happened
    | BinsChanged
    | BinClosed
    | Progress
    | Finished
    | Replied
    | AlarmsChanged
    | Said
    | Failed
)
