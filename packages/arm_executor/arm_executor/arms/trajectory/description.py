"""The robot as its driver describes it, held against the model that motions are planned with.

A driver that was given the factory calibration of its robot (`kinematics_params_file`) has it in
the URDF on `robot_description`; the model has the lengths of the data sheet. Joint for joint the
two may differ by decimetres, since two axes are parallel, and mean the same flange: so flanges are
compared.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from arm_executor.model.arm_interface import MotionError
from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import JOINT_NAMES, RobotModel
from arm_executor.model.robot_shapes import UrdfJoint, read_urdf
from arm_executor.model.urdf import cell_urdf
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.frames import composed
from pack_msgs_py.geometry.pose import Pose, conjugate, quaternion_product

#: A description that is so near to the model needs no warning, m.
WORTH_TELLING_M = 0.0005
_BASE, _TIP = 'base_link', 'tool0'
#: Postures with the mast down, all around and near and far: pan, lift, elbow, last wrist; rad.
_PANS, _LIFTS, _ELBOWS = (-2.4, -1.2, 0.0, 1.2, 2.4), (-2.0, -1.5, -1.0), (1.0, 1.6, 2.2)
_LAST_WRISTS = (-1.5, 1.5)


@dataclass(frozen=True)
class ModelError:
    """How far the flange is from where the model has it, at worst of many postures; m and rad."""

    shift_m: float
    turn_rad: float

    def __str__(self) -> str:
        return f'{1000 * self.shift_m:.1f} mm and {math.degrees(self.turn_rad):.2f} degrees'


def model_error(urdf: str, robot: RobotModel, prefix: str = '') -> ModelError:
    """How far ``robot`` is from what ``urdf`` describes, whose names begin with ``prefix``.

    Raises
    ------
    ValueError
        The text is no URDF, or describes no arm of Universal Robots.
    """
    theirs = _chain(urdf, prefix)
    ours = _chain(cell_urdf(robot, Layout(), described=True), '')
    worst_m = worst_rad = 0.0
    for pan, lift, elbow, last in itertools.product(_PANS, _LIFTS, _ELBOWS, _LAST_WRISTS):
        q = (pan, lift, elbow, -math.pi / 2 - lift - elbow, -math.pi / 2, last)
        a, b = _flange(ours, q), _flange(theirs, q)
        worst_m = max(worst_m, math.dist(a.position, b.position))
        turn = quaternion_product(conjugate(a.quaternion), b.quaternion)
        worst_rad = max(worst_rad, 2 * math.asin(min(1.0, math.hypot(*turn[:3]))))
    return ModelError(worst_m, worst_rad)


def judged(urdf: str, robot: RobotModel, prefix: str, allowed_m: float) -> tuple[str, bool]:
    """A sentence on how well ``robot`` is the one that is described, and whether all is well.

    Raises
    ------
    MotionError
        It is another one: its flange is farther away than ``allowed_m``.
    """
    try:
        error = model_error(urdf, robot, prefix)
    except ValueError as problem:
        return f'the description of the robot cannot be compared: {problem}', False
    text = f'by its own description the flange is up to {error} from where the model has it'
    if error.shift_m > allowed_m:
        msg = (
            f'{text}, {1000 * allowed_m:g} mm are allowed: is the robot of the layout '
            f'({robot.name}) the one that is there?'
        )
        raise MotionError(ErrorCode.START_STATE_INVALID, msg)
    if error.shift_m > WORTH_TELLING_M:
        return f'{text}: enlarge --clearance and tolerance_mm by as much', False
    return text, True


def _flange(joints: list[tuple[UrdfJoint, int | None]], q: tuple[float, ...]) -> Pose:
    pose = Pose()
    for joint, index in joints:
        pose = composed(pose, joint.transform(0.0 if index is None else q[index]))
    return pose


def _chain(urdf: str, prefix: str) -> list[tuple[UrdfJoint, int | None]]:
    """The joints from base to flange, in order, and which of the six each is."""
    above = {joint.child: joint for joint in read_urdf(urdf).joints}
    indices = {f'{prefix}{name}': index for index, name in enumerate(JOINT_NAMES)}
    chain: list[tuple[UrdfJoint, int | None]] = []
    link = f'{prefix}{_TIP}'
    while link != f'{prefix}{_BASE}':
        joint = above.get(link)
        if joint is None:
            msg = f'there is no way from link {prefix}{_BASE} to link {prefix}{_TIP}'
            raise ValueError(msg)
        chain.append((joint, indices.pop(joint.name, None)))
        link = joint.parent
    if indices:
        msg = f'between {prefix}{_BASE} and {prefix}{_TIP} there is no joint {", ".join(indices)}'
        raise ValueError(msg)
    return chain[::-1]
