"""Published data of the supported robots.

Published: kinematics, joint speeds and torques (Universal Robots, 'DH parameters for calculations
of kinematics and dynamics' and 'Max. joint torques'), payload and reach (data sheets), lateral
offsets (their ROS 2 description). Masses and inertias have a file of their own, `inertias`.
Estimated: the radii of the links, from drawings, to the centimetre. Metres, radians, N m, kg.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from arm_executor.model.inertias import INERTIAS, SixLinks

Six = tuple[float, float, float, float, float, float]

JOINT_NAMES = (
    'shoulder_pan_joint',
    'shoulder_lift_joint',
    'elbow_joint',
    'wrist_1_joint',
    'wrist_2_joint',
    'wrist_3_joint',
)


@dataclass(frozen=True)
class RobotModel:
    """One robot arm.

    Attributes
    ----------
    d1, a2, a3, d4, d5, d6 : Denavit-Hartenberg lengths; the twists are those of every UR.
    max_speed, max_torque : per joint, rad/s and N m.
    name : of the product, in lower case.
    payload, payload_tool_down : at any orientation, and with the tool kept vertical, kg.
    reach : of the flange from the base, data sheet, metres.
    radii : of shoulder, upper arm, forearm and the three wrists, for the collision shapes.
    shoulder_offset, elbow_offset : how far upper arm and forearm stand beside their joint plane.
    """

    name: str
    d1: float
    a2: float
    a3: float
    d4: float
    d5: float
    d6: float
    max_speed: Six
    max_torque: Six
    payload: float
    payload_tool_down: float
    reach: float
    radii: Six
    shoulder_offset: float
    elbow_offset: float

    @property
    def links(self) -> SixLinks:
        """Mass, centre of mass and inertia of the six moving links."""
        return INERTIAS[self.name]


def _speeds(big: float, elbow: float, wrist: float) -> Six:
    degrees = (big, big, elbow, wrist, wrist, wrist)
    a, b, c, d, e, f = (math.radians(speed) for speed in degrees)
    return (a, b, c, d, e, f)


_E10 = {
    'd1': 0.1807,
    'd4': 0.17415,
    'd5': 0.11985,
    'd6': 0.11655,
    'max_speed': _speeds(120, 180, 180),
    'max_torque': (330.0, 330.0, 150.0, 54.0, 54.0, 54.0),
    'radii': (0.095, 0.08, 0.076, 0.06, 0.05, 0.048),
    'shoulder_offset': 0.1762,
    'elbow_offset': 0.0393,
}
_BIG = {
    'd1': 0.2363,
    'd4': 0.201,
    'd5': 0.1593,
    'd6': 0.1543,
    'max_speed': _speeds(120, 150, 210),
    'max_torque': (738.0, 738.0, 433.0, 107.0, 107.0, 107.0),
    'radii': (0.123, 0.095, 0.09, 0.075, 0.052, 0.05),
    'shoulder_offset': 0.260,
    'elbow_offset': 0.043,
}

ROBOTS: dict[str, RobotModel] = {
    robot.name: robot
    for robot in (
        RobotModel(
            name='ur5e',
            d1=0.1625,
            a2=-0.425,
            a3=-0.3922,
            d4=0.1333,
            d5=0.0997,
            d6=0.0996,
            max_speed=_speeds(180, 180, 180),
            max_torque=(150.0, 150.0, 150.0, 28.0, 28.0, 28.0),
            payload=5.0,
            payload_tool_down=5.0,
            reach=0.85,
            radii=(0.075, 0.07, 0.06, 0.055, 0.045, 0.045),
            shoulder_offset=0.138,
            elbow_offset=0.007,
        ),
        RobotModel(
            name='ur10e',
            a2=-0.6127,
            a3=-0.57155,
            payload=12.5,
            payload_tool_down=12.5,
            reach=1.30,
            **_E10,  # type: ignore[arg-type]
        ),
        RobotModel(
            name='ur16e',
            a2=-0.4784,
            a3=-0.36,
            payload=16.0,
            payload_tool_down=16.0,
            reach=0.90,
            **_E10,  # type: ignore[arg-type]
        ),
        RobotModel(
            name='ur20',
            a2=-0.862,
            a3=-0.7287,
            payload=20.0,
            payload_tool_down=25.0,
            reach=1.75,
            **_BIG,  # type: ignore[arg-type]
        ),
        RobotModel(
            name='ur30',
            a2=-0.637,
            a3=-0.5037,
            payload=30.0,
            payload_tool_down=35.0,
            reach=1.30,
            **_BIG,  # type: ignore[arg-type]
        ),
    )
}


def find_robot(name: str) -> RobotModel:
    """The robot called ``name``; ``ValueError`` lists the known ones."""
    try:
        return ROBOTS[name]
    except KeyError:
        msg = f'unknown robot {name!r}: use one of {", ".join(ROBOTS)}'
        raise ValueError(msg) from None
