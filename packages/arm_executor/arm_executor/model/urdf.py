"""The robot's URDF, made of cylinders, spheres and boxes from published parameters.

One text serves physics, collision checks and dynamics; ``robot_description`` has the frames of
Universal Robots besides. Inertias of carriage,
base and mast are estimated from their shapes; those of the arm are in
:mod:`arm_executor.model.inertias`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from arm_executor.model.inertias import LinkInertia
from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import RobotModel
from arm_executor.model.tree import BARE_FRAMES, LINKS, Joint, cell_joints, described_joints
from pack_msgs_py.values import Vec3

_GREY, _BLUE = '0.78 0.80 0.82 1', '0.25 0.52 0.80 1'
_BLACK, _STEEL = '0.1 0.1 0.1 1', '0.40 0.42 0.45 1'
_COLOURS = {
    'base_link_inertia': _GREY,
    'shoulder_link': _BLUE,
    'upper_arm_link': _GREY,
    'forearm_link': _GREY,
    'wrist_1_link': _BLUE,
    'wrist_2_link': _BLUE,
    'wrist_3_link': _GREY,
    'tool': _BLACK,
    'carriage': _STEEL,
}

#: Of the pad at the end of the mast, metres.
PAD_THICKNESS = 0.04
#: Estimated, kg.
_CARRIAGE_MASS = 150.0
_WEIGHTLESS = LinkInertia(1e-3, (0.0, 0.0, 0.0), (1e-6, 0.0, 0.0, 1e-6, 0.0, 1e-6))


@dataclass(frozen=True)
class Capsule:
    """A rounded bar between two points of a link's frame; metres."""

    link: str
    start: Vec3
    end: Vec3
    radius: float


def robot_capsules(robot: RobotModel) -> tuple[Capsule, ...]:
    """Shapes of the links, each in its own link frame."""
    shoulder, upper, forearm, wrist_1, wrist_2, wrist_3 = robot.radii
    out, elbow = robot.shoulder_offset, robot.elbow_offset
    zero = (0.0, 0.0, 0.0)
    return (
        Capsule('base_link_inertia', zero, (0.0, 0.0, robot.d1 - 0.06), shoulder),
        Capsule('shoulder_link', zero, (0.0, -out, 0.0), upper),
        Capsule('upper_arm_link', (0.0, 0.0, out), (robot.a2, 0.0, out), upper),
        Capsule('forearm_link', (0.0, 0.0, out - 0.02), (0.0, 0.0, elbow), forearm),
        Capsule('forearm_link', (0.0, 0.0, elbow), (robot.a3, 0.0, elbow), forearm),
        Capsule('wrist_1_link', (0.0, 0.0, elbow - robot.d4), zero, wrist_1),
        Capsule('wrist_2_link', (0.0, 0.0, -robot.d5), zero, wrist_2),
        Capsule('wrist_3_link', (0.0, 0.0, -robot.d6), (0.0, 0.0, -0.03), wrist_3),
    )


def cell_urdf(robot: RobotModel, layout: Layout, *, described: bool = False) -> str:
    """URDF of ``robot`` on the rail of ``layout`` with its suction mast.

    ``described`` : with the frames that have no shape, for ``robot_description``.
    """
    joints = described_joints(robot, layout) if described else cell_joints(robot, layout)
    parts = [f'<robot name="{robot.name}_cell">', '<link name="cell"/>', _carriage(layout)]
    parts += [_link(robot, index) for index in range(len(LINKS))]
    parts += [_tool(layout), f'<link name="tcp">{_inertial(_WEIGHTLESS)}</link>']
    parts += [f'<link name="{name}"/>' for name in BARE_FRAMES if described]
    parts += [_joint(joint, robot, layout) for joint in joints]
    parts.append('</robot>')
    return '<?xml version="1.0"?>\n' + '\n'.join(parts) + '\n'


def _joint(joint: Joint, robot: RobotModel, layout: Layout) -> str:
    ends = f'<parent link="{joint.parent}"/><child link="{joint.child}"/>'
    origin = f'<origin xyz="{_text(joint.xyz)}" rpy="{_turn(joint.rpy)}"/>'
    if joint.index is None:
        return f'<joint name="{joint.name}" type="fixed">{ends}{origin}</joint>'
    if joint.index == 0:
        rail, kind, axis = layout.rail, 'prismatic', '1 0 0'
        low, high, effort, speed = rail.x_min, rail.x_max, rail.force, rail.speed
    else:
        index, kind, axis = joint.index - 1, 'revolute', '0 0 1'
        high = joint_limit(index)
        low, effort, speed = -high, robot.max_torque[index], robot.max_speed[index]
    return (
        f'<joint name="{joint.name}" type="{kind}">{ends}{origin}<axis xyz="{axis}"/>'
        f'<limit lower="{low:.9g}" upper="{high:.9g}" effort="{effort:g}" '
        f'velocity="{speed:.9g}"/></joint>'
    )


def _turn(rpy: Vec3) -> str:
    return ' '.join(f'{angle:.12f}' if angle else '0' for angle in rpy)


def joint_limit(index: int) -> float:
    """Largest angle of joint ``index`` (0 to 5) either way; the elbow turns half as far."""
    return math.pi if index == 2 else 2 * math.pi


def _link(robot: RobotModel, index: int) -> str:
    name = LINKS[index]
    inertia = robot.links[index - 1] if index else _cylinder(4.0, 0.05, robot.radii[0], 0.1)
    shapes = ''.join(
        _capsule(capsule, tag)
        for capsule in robot_capsules(robot)
        if capsule.link == name
        for tag in ('visual', 'collision')
    )
    return f'<link name="{name}">{_inertial(inertia)}{shapes}</link>'


def _carriage(layout: Layout) -> str:
    rail = layout.rail
    height, radius = rail.base_height, rail.pedestal_radius
    geometry = f'<cylinder radius="{radius:g}" length="{height:g}"/>'
    shape = ''.join(
        _shape(tag, (0, 0, height / 2), (0, 0, 0), geometry, 'carriage')
        for tag in ('visual', 'collision')
    )
    inertia = _cylinder(_CARRIAGE_MASS, height / 2, radius, height)
    return f'<link name="carriage">{_inertial(inertia)}{shape}</link>'


def _tool(layout: Layout) -> str:
    tool = layout.tool
    tube = tool.length - PAD_THICKNESS
    mast = f'<cylinder radius="{tool.diameter / 2:g}" length="{tube:g}"/>'
    pad = f'<box size="{tool.pad_edge:g} {tool.pad_edge:g} {PAD_THICKNESS:g}"/>'
    shapes = ''.join(
        _shape(tag, (0, 0, tube / 2), (0, 0, 0), mast, 'tool')
        + _shape(tag, (0, 0, tool.length - PAD_THICKNESS / 2), (0, 0, 0), pad, 'tool')
        for tag in ('visual', 'collision')
    )
    # Below its middle, since the pad is at its end.
    inertia = _cylinder(tool.mass, tool.length * 0.6, tool.diameter / 2, tool.length)
    return f'<link name="tool">{_inertial(inertia)}{shapes}</link>'


def _cylinder(mass: float, height: float, radius: float, length: float) -> LinkInertia:
    """A cylinder along z with its centre at ``height``."""
    across = mass * (3 * radius * radius + length * length) / 12
    along = mass * radius * radius / 2
    return LinkInertia(mass, (0.0, 0.0, height), (across, 0.0, 0.0, across, 0.0, along))


def _capsule(capsule: Capsule, tag: str) -> str:
    start, end = capsule.start, capsule.end
    span = [b - a for a, b in zip(start, end, strict=True)]
    length = math.sqrt(sum(part * part for part in span))
    middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2, (start[2] + end[2]) / 2)
    turn = (0.0, math.atan2(math.hypot(span[0], span[1]), span[2]), math.atan2(span[1], span[0]))
    bar = f'<cylinder radius="{capsule.radius:g}" length="{length:.6f}"/>'
    ball = f'<sphere radius="{capsule.radius:g}"/>'
    return _shape(tag, middle, turn, bar, capsule.link) + ''.join(
        _shape(tag, point, (0, 0, 0), ball, capsule.link) for point in (start, end)
    )


def _shape(tag: str, xyz: Vec3, rpy: Vec3, geometry: str, link: str) -> str:
    colour = _COLOURS[link]
    material = f'<material name="{link}_colour"><color rgba="{colour}"/></material>'
    return (
        f'<{tag}><origin xyz="{_text(xyz)}" rpy="{_text(rpy)}"/>'
        f'<geometry>{geometry}</geometry>{material if tag == "visual" else ""}</{tag}>'
    )


def _inertial(inertia: LinkInertia) -> str:
    names = ('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz')
    tensor = ' '.join(
        f'{name}="{value:.8g}"' for name, value in zip(names, inertia.tensor, strict=True)
    )
    return (
        f'<inertial><origin xyz="{_text(inertia.centre)}" rpy="{inertia.roll:.12f} 0 0"/>'
        f'<mass value="{inertia.mass:g}"/><inertia {tensor}/></inertial>'
    )


def _text(values: Vec3) -> str:
    return ' '.join(f'{value:.9g}' for value in values)
