"""The robot's URDF, made of cylinders, spheres and boxes from published parameters.

One text serves physics, collision checks, dynamics and ``robot_description``. The root link is
`cell`; then the rail, the pedestal on its carriage, six joints, the mast (`tool`) and the pad's
face (`tcp`). Link frames follow Universal Robots' ROS description.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from arm_executor.layout import Layout
from arm_executor.robot.parameters import JOINT_NAMES, ArmModel
from pack_msgs_py.values import Vec3

RAIL_JOINT = 'rail_joint'
CELL_JOINT_NAMES = (RAIL_JOINT, *JOINT_NAMES)
LINKS = ('base_link', 'shoulder', 'upper_arm', 'forearm', 'wrist_1', 'wrist_2', 'wrist_3')

_GREY, _BLUE = '0.78 0.80 0.82 1', '0.25 0.52 0.80 1'
_BLACK, _STEEL = '0.1 0.1 0.1 1', '0.40 0.42 0.45 1'
_COLOURS = {
    'base_link': _GREY,
    'shoulder': _BLUE,
    'upper_arm': _GREY,
    'forearm': _GREY,
    'wrist_1': _BLUE,
    'wrist_2': _BLUE,
    'wrist_3': _GREY,
    'tool': _BLACK,
    'carriage': _STEEL,
}

_PAD_THICKNESS = 0.04


@dataclass(frozen=True)
class Capsule:
    """A rounded bar between two points of a link's frame; metres."""

    link: str
    start: Vec3
    end: Vec3
    radius: float


def arm_capsules(arm: ArmModel) -> tuple[Capsule, ...]:
    """Shapes of the arm's links, each in its own link frame."""
    shoulder, upper, forearm, wrist_1, wrist_2, wrist_3 = arm.radii
    out, elbow = arm.shoulder_offset, arm.elbow_offset
    zero = (0.0, 0.0, 0.0)
    return (
        Capsule('base_link', zero, (0.0, 0.0, arm.d1 - 0.06), shoulder),
        Capsule('shoulder', zero, (0.0, -out, 0.0), upper),
        Capsule('upper_arm', (0.0, 0.0, out), (arm.a2, 0.0, out), upper),
        Capsule('forearm', (0.0, 0.0, out - 0.02), (0.0, 0.0, elbow), forearm),
        Capsule('forearm', (0.0, 0.0, elbow), (arm.a3, 0.0, elbow), forearm),
        Capsule('wrist_1', (0.0, 0.0, elbow - arm.d4), zero, wrist_1),
        Capsule('wrist_2', (0.0, 0.0, -arm.d5), zero, wrist_2),
        Capsule('wrist_3', (0.0, 0.0, -arm.d6), (0.0, 0.0, -0.03), wrist_3),
    )


def cell_urdf(arm: ArmModel, layout: Layout) -> str:
    """URDF of ``arm`` on the rail of ``layout`` with its suction mast."""
    parts = [f'<robot name="{arm.name}_cell">', '<link name="cell"/>', _carriage(layout)]
    parts += [_link(arm, index) for index in range(len(LINKS))]
    weightless = _inertial((0, 0, 0), 1e-3, 1e-6, 1e-6)
    parts += [_tool(layout), f'<link name="tcp">{weightless}</link>']
    rail = layout.rail
    parts.append(
        f'<joint name="{RAIL_JOINT}" type="prismatic"><parent link="cell"/>'
        '<child link="carriage"/><axis xyz="1 0 0"/>'
        f'<limit lower="{rail.x_min:g}" upper="{rail.x_max:g}" effort="{rail.force:g}" '
        f'velocity="{rail.speed:g}"/></joint>'
    )
    parts.append(_fixed('pedestal', 'carriage', 'base_link', (0, 0, rail.base_height)))
    origins: tuple[tuple[Vec3, float], ...] = (
        ((0, 0, arm.d1), 0.0),
        ((0, 0, 0), math.pi / 2),
        ((arm.a2, 0, 0), 0.0),
        ((arm.a3, 0, arm.d4), 0.0),
        ((0, -arm.d5, 0), math.pi / 2),
        ((0, arm.d6, 0), -math.pi / 2),
    )
    for index, (name, (xyz, roll)) in enumerate(zip(JOINT_NAMES, origins, strict=True)):
        limit = joint_limit(index)
        parts.append(
            f'<joint name="{name}" type="revolute"><parent link="{LINKS[index]}"/>'
            f'<child link="{LINKS[index + 1]}"/><origin xyz="{_text(xyz)}" rpy="{roll:.12f} 0 0"/>'
            f'<axis xyz="0 0 1"/><limit lower="{-limit:.6f}" upper="{limit:.6f}" '
            f'effort="{arm.max_torque[index]:g}" velocity="{arm.max_speed[index]:.6f}"/></joint>'
        )
    parts.append(_fixed('flange', 'wrist_3', 'tool', (0, 0, 0)))
    parts.append(_fixed('pad_face', 'tool', 'tcp', (0, 0, layout.tool.length)))
    parts.append('</robot>')
    return '<?xml version="1.0"?>\n' + '\n'.join(parts) + '\n'


def joint_limit(index: int) -> float:
    """Largest angle of joint ``index`` (0 to 5) either way; the elbow turns half as far."""
    return math.pi if index == 2 else 2 * math.pi


def _link(arm: ArmModel, index: int) -> str:
    name = LINKS[index]
    mass = 4.0 if index == 0 else arm.masses[index - 1]
    centre: Vec3 = {
        'base_link': (0.0, 0.0, 0.05),
        'upper_arm': (arm.a2 * 0.45, 0.0, arm.shoulder_offset * 0.85),
        'forearm': (arm.a3 * 0.5, 0.0, arm.elbow_offset * 1.2),
        'wrist_1': (0.0, -0.02, 0.0),
        'wrist_2': (0.0, 0.02, 0.0),
        'wrist_3': (0.0, 0.0, -0.03),
    }.get(name, (0.0, 0.0, 0.0))
    length = {'upper_arm': -arm.a2, 'forearm': -arm.a3}.get(name, 0.15)
    across = mass * (length * length / 12 + 0.003)
    along = mass * 0.006 if name in ('upper_arm', 'forearm') else across
    shapes = ''.join(
        _capsule(capsule, tag)
        for capsule in arm_capsules(arm)
        if capsule.link == name
        for tag in ('visual', 'collision')
    )
    return f'<link name="{name}">{_inertial(centre, mass, along, across)}{shapes}</link>'


def _carriage(layout: Layout) -> str:
    rail = layout.rail
    height = rail.base_height
    geometry = f'<cylinder radius="{rail.pedestal_radius:g}" length="{height:g}"/>'
    shape = ''.join(
        _shape(tag, (0, 0, height / 2), (0, 0, 0), geometry, 'carriage')
        for tag in ('visual', 'collision')
    )
    return f'<link name="carriage">{_inertial((0, 0, 0.3), 150.0, 10.0, 10.0)}{shape}</link>'


def _tool(layout: Layout) -> str:
    tool = layout.tool
    tube = tool.length - _PAD_THICKNESS
    mast = f'<cylinder radius="{tool.diameter / 2:g}" length="{tube:g}"/>'
    pad = f'<box size="{tool.pad_edge:g} {tool.pad_edge:g} {_PAD_THICKNESS:g}"/>'
    shapes = ''.join(
        _shape(tag, (0, 0, tube / 2), (0, 0, 0), mast, 'tool')
        + _shape(tag, (0, 0, tool.length - _PAD_THICKNESS / 2), (0, 0, 0), pad, 'tool')
        for tag in ('visual', 'collision')
    )
    centre = (0.0, 0.0, tool.length * 0.6)
    inertia = tool.mass * tool.length**2 / 12
    return f'<link name="tool">{_inertial(centre, tool.mass, inertia, inertia)}{shapes}</link>'


def _capsule(capsule: Capsule, tag: str) -> str:
    start, end = capsule.start, capsule.end
    span = [b - a for a, b in zip(start, end, strict=True)]
    length = math.sqrt(sum(one * one for one in span))
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


def _inertial(centre: Vec3, mass: float, along: float, across: float) -> str:
    return (
        f'<inertial><origin xyz="{_text(centre)}"/><mass value="{mass:g}"/>'
        f'<inertia ixx="{along:.8f}" ixy="0" ixz="0" iyy="{across:.8f}" iyz="0" '
        f'izz="{across:.8f}"/></inertial>'
    )


def _fixed(name: str, parent: str, child: str, xyz: Vec3) -> str:
    return (
        f'<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{_text(xyz)}"/></joint>'
    )


def _text(values: Vec3) -> str:
    return ' '.join(f'{value:.9g}' for value in values)
