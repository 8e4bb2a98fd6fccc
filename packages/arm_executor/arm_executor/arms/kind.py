"""What is known of an arm before there is one: its name, what it can do, how to make it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from arm_executor.arms.true_boxes import Truth
from arm_executor.model.arm_interface import Arm
from arm_executor.model.layout import Layout

if TYPE_CHECKING:
    from arm_executor.arms.trajectory.link import RobotLink


@dataclass(frozen=True)
class ArmSetup:
    """What an arm is made from.

    Attributes
    ----------
    layout : where everything stands, and which robot it is.
    speed : robot seconds per wall-clock second; 0 is as fast as the machine can.
    joint_jerk : limit of jerk for planned motions, rad/s3; 0 for none, ``None`` for the arm's own.
    truth : what the boxes really are, for an arm in a simulated world; nothing is known of a box
        that nobody told of, which is then as scanned.
    parameters : those of its kind, as :attr:`ArmKind.parameters` declares them.
    link : the robot and its driver, for a kind that has one.
    """

    layout: Layout
    speed: float = 1.0
    joint_jerk: float | None = None
    truth: Truth = field(default_factory=Truth)
    parameters: Any = None
    link: RobotLink | None = None


@dataclass(frozen=True)
class ArmKind:
    """One kind of arm, as the rest of the cell knows it.

    Attributes
    ----------
    name : what it is called in the parameter ``arm`` and the option ``--arm``.
    summary : what it does, in words that follow its name: 'moves a robot model in PyBullet'.
    make : builds the arm; called once, on the thread that will own it. What only this arm needs
        is imported in there, so that the others run without it.
    moves_robot : it moves the robot of the layout. Then that robot must reach every bin, or the
        cell does not start, and viewers are shown it.
    lifting_limit : heaviest box that it lifts in a layout, kg; ``None`` for an arm that lifts any.
        Planner and executor then keep to it where it is less than the profile's.
    keeps_true_boxes : after a restart its world is built again from what the boxes in the bins
        really are, so that this is kept on disk beside the journal.
    has_driver : a driver moves the robot and shows it: it is reached by ``ArmSetup.link``, and
        publishes joints, transforms and description, so that the cell does not.
    parameters : a dataclass of :func:`pack_msgs_py.parameter_fields.parameter`, which the node
        declares as well, each name behind that of the kind and a dot; ``None`` for none.
    simulated : nothing moves but in a computer, so that nobody need stand by.
    """

    name: str
    summary: str
    make: Callable[[ArmSetup], Arm]
    moves_robot: bool = False
    lifting_limit: Callable[[Layout], float] | None = None
    keeps_true_boxes: bool = False
    has_driver: bool = False
    parameters: type | None = None
    simulated: bool = False
