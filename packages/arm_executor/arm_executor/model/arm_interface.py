"""What the executor asks of an arm, whichever way the arm does it.

An arm fulfils the protocol :class:`Arm` and is told of by an
:class:`arm_executor.arms.kind.ArmKind`; docs/integration.md, "Your own arm", has a whole one.
Two are here: :class:`arm_executor.arms.physics.arm.PhysicsArm` moves a robot model in PyBullet,
:class:`arm_executor.arms.timed.TimedArm` only spends the predicted time, for soaks and studies.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Protocol, runtime_checkable

from pack_msgs_py.codes import ErrorCode, Phase
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin, Box


class MotionError(Exception):
    """The arm cannot, or could not, do what was asked.

    ``code`` is what the goal ends with, ``str(error)`` a sentence with the numbers.
    """

    def __init__(self, code: ErrorCode, message: str) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True)
class PlaceRequest:
    """Pick ``box`` at ``pick`` and bring what is taken there to rest at ``target``.

    Attributes
    ----------
    pick : where the box is grasped, frame `cell`: its centre, moved along y by half of what it may
        be larger than it was scanned; that point is what comes to rest at ``target``.
    station : where the target bin stands, 'A', 'B' or 'C'.
    target : the same point of the box at rest, bin frame of the station.
    belt : other boxes that wait on the belt meanwhile, and their centres, frame `cell`; the path
        keeps clear of them.
    """

    box: Box
    pick: Pose
    station: str
    target: Pose
    belt: tuple[tuple[Box, Pose], ...] = ()


@dataclass(frozen=True)
class MotionPlan:
    """A checked motion that is ready to run.

    ``predicted_s`` is robot time from start to the arm waiting above the pick point again, grip
    and release included; ``after_pick_s`` what of it comes after the grasp, in which the belt can
    already bring the next box. ``planning_s`` is what planning cost in wall-clock seconds.
    ``detail`` belongs to the arm that made the plan.
    """

    request: PlaceRequest
    predicted_s: float
    planning_s: float
    detail: Any = field(default=None, repr=False)
    after_pick_s: float = 0.0


@dataclass(frozen=True)
class MotionUnderWay:
    """A motion that is still to be finished when the next one is planned.

    Attributes
    ----------
    plan : says where it will leave the arm; one that this arm made.
    rest : where the centre of its box will rest, bin frame of its station.
    """

    plan: MotionPlan
    rest: Pose


@dataclass(frozen=True)
class MotionResult:
    """How a motion ended. Seconds are robot time, poses in the bin frame.

    Attributes
    ----------
    code, message : ``NONE`` and empty when everything went as asked.
    motion_s : time in motion, grip, release and settling of the arm included.
    measured : pose of the box's centre after it settled; ``None`` when it is not in the bin.
    others : measured pose of every other box of the bin after it settled, by box id.
    others_moved_m : farthest that any other box of the bin moved.
    split_s : robot time by phase.
    on_belt : the box was picked, and stands on the belt again where it was.
    """

    code: ErrorCode
    message: str = ''
    motion_s: float = 0.0
    measured: Pose | None = None
    others: Mapping[str, Pose] = field(default_factory=dict)
    others_moved_m: float = 0.0
    split_s: Mapping[Phase, float] = field(default_factory=dict)
    on_belt: bool = False


@dataclass(frozen=True)
class MotionHooks:
    """What an arm calls while it moves, from the thread that runs :meth:`Arm.execute`.

    ``phase(phase, fraction)`` reports progress, at least once a second of wall-clock time: an arm
    that is silent for longer than the parameter ``watchdog_s`` is stopped. ``picked``,
    ``releasing`` and ``released`` are called in this order, at most once each: right after the
    grasp holds, right before the pad lets go, right after. The motion goes on only when they
    return, so that the journal is written before the next thing happens; what they raise is not to
    be caught.
    """

    phase: Callable[[Phase, float], None]
    picked: Callable[[], None]
    releasing: Callable[[], None]
    released: Callable[[], None]


class Arm(Protocol):
    """An arm in its cell.

    It is made, used and closed on one thread. Only :meth:`plan` is also called from a second
    thread, while :meth:`execute` runs; :meth:`tracking_error` and :meth:`joint_positions` from any.

    The order of calls: :meth:`set_bins` first, and again whenever bins come or go; then, for each
    box, :meth:`plan`, :meth:`execute` and, when the motion ended early, :meth:`holds`,
    :meth:`return_to_belt` and :meth:`withdraw`. Whatever one of them raises except what is named
    here stops the executor with mode ``FAULT``.
    """

    def set_bins(self, bins: Sequence[Bin], poses: Mapping[str, Pose]) -> dict[str, Pose]:
        """Make the world hold exactly ``bins`` (by their stations), and let it settle.

        An arm whose world is real looks instead, and says where the boxes are. Boxes and bins that
        are already there as given are left alone.

        Parameters
        ----------
        bins : at most one per station, with the boxes in them as they were scanned.
        poses : of the centre of each of these boxes, by its id, bin frame.

        Returns
        -------
        dict
            The settled poses of the same boxes, bin frame.
        """

    def plan(self, request: PlaceRequest, after: MotionUnderWay | None = None) -> MotionPlan:
        """Plan the whole motion, from where the arm is. Nothing moves.

        With ``after`` it starts where that motion ends, with its box in its bin. The same plan may
        be asked for many times and run once, or never.

        Raises
        ------
        MotionError
            There is no such motion; its code and text are what the goal ends with.
        """

    def execute(self, plan: MotionPlan, hooks: MotionHooks, stop: threading.Event) -> MotionResult:
        """Run ``plan``, made by this arm, and measure where the boxes of the bin are then.

        A plan that begins elsewhere than where the arm is ends with ``START_STATE_INVALID``.
        When ``stop`` is set the arm comes to rest at once, and the result has the code
        ``CANCELED``; once the pad lets go it is too late, and the motion is finished. A box that
        is then in the gripper, or after a fault, stays there until :meth:`return_to_belt`. Never
        raises for what the world does; the result says it.
        """

    def return_to_belt(self) -> bool:
        """Put a held box back at the pick point; ``True`` when there was one and it is there.

        Raises
        ------
        MotionError
            It is not there, and why; :meth:`holds` says whether it is still in the gripper.
        """

    def withdraw(self) -> bool:
        """After a motion that ended early, with an empty gripper: back to where the arm waits.

        ``True`` when it is there, also when it had nowhere to go back from.
        """

    def holds(self) -> str | None:
        """Id of the box in the gripper; ``None`` when it is empty."""

    def tracking_error(self) -> float:
        """Farthest that a joint has ever been from its path, as a share of what is allowed.

        Safe from any thread; 0 for an arm that does not know.
        """

    def joint_positions(self) -> tuple[tuple[str, ...], tuple[float, ...]]:
        """Joint names and positions, metres and radians; both empty for an arm that shows none.

        Safe from any thread.
        """

    def close(self) -> None:
        """Give everything back; nothing is called afterwards."""


@runtime_checkable
class ClockedArm(Protocol):
    """What an :class:`Arm` may have besides, when its seconds are not those on the wall."""

    def robot_time(self) -> float:
        """Robot seconds for which it had moved when :meth:`Arm.joint_positions` was true.

        Safe from any thread.
        """


class FoundAt(Enum):
    """Where a box is that the arm was moving when its executor died."""

    ON_BELT = 'on the belt'
    IN_BIN = 'in its bin'


@runtime_checkable
class FindingArm(Protocol):
    """What an :class:`Arm` may have besides: after a restart it can tell where its last box is.

    With an arm that has not, such a box is `UNKNOWN`: its bin is blocked until a person has looked.
    """

    def find_box(self, box: Box, station: str, target: Pose, *, released: bool) -> FoundAt | None:
        """Where a box is that was picked, or whose release had begun; ``None`` for not to be told.

        Called before :meth:`Arm.set_bins`. A box that is in the gripper is to be brought back to
        the belt first. ``target`` is where it was to rest, bin frame of ``station``.
        """


@runtime_checkable
class PredictingArm(Protocol):
    """What an :class:`Arm` may have besides: it can tell quickly what planning would find.

    Then many candidates can be asked about at a time, and only the promising ones are planned.
    """

    def predict(self, request: PlaceRequest, after: MotionUnderWay | None = None) -> float:
        """What :attr:`MotionPlan.predicted_s` would be, to some percent; else as :meth:`Arm.plan`.

        Raises
        ------
        MotionError
            There is most probably no such motion.
        """


@runtime_checkable
class WatchedArm(Protocol):
    """What an :class:`Arm` may have besides: a robot that can stop by itself."""

    def trouble(self) -> str:
        """Why the robot cannot move now, empty when it can; asked often, from any thread.

        The executor then goes into mode ``PROTECTIVE_STOP``, and ``~/reset`` is refused until it is
        over.
        """
