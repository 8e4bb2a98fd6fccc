"""The robot's URDF as shapes on a chain of joints, for whoever draws it.

What is drawn is the ``robot_description`` of the arm, the same text that serves physics. Metres,
radians, quaternions x y z w.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.geometry.pose import Pose, Quaternion, quaternion_product, rotation_matrix
from pack_msgs_py.values import Vec3

Array = NDArray[np.float64]
#: Of what has no material.
_GREY = (0.7, 0.7, 0.7)


@dataclass(frozen=True)
class LinkShape:
    """One visual shape in the frame of its link.

    ``kind`` is ``box`` (sizes along x, y, z), ``cylinder`` (radius, length along z) or ``sphere``
    (radius).
    """

    link: str
    kind: str
    sizes: tuple[float, ...]
    pose: Pose
    colour: Vec3


@dataclass(frozen=True)
class UrdfJoint:
    """How ``child`` hangs on ``parent``; ``kind`` as URDF names it.

    ``limits`` are its ends, metres or radians; ``None`` where there are none.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Pose
    axis: Vec3
    limits: tuple[float, float] | None = None

    def transform(self, position: float) -> Pose:
        """Pose of ``child`` in ``parent`` with the joint at ``position``, metres or radians."""
        if self.kind == 'prismatic':
            turn = np.array(rotation_matrix(self.origin.quaternion))
            shift = turn @ (position * np.array(self.axis))
            x, y, z = (np.array(self.origin.position) + shift).tolist()
            return Pose((x, y, z), self.origin.quaternion)
        if self.kind == 'fixed':
            return self.origin
        x, y, z = self.axis
        sine, cosine = math.sin(position / 2), math.cos(position / 2)
        turned = quaternion_product(self.origin.quaternion, (x * sine, y * sine, z * sine, cosine))
        return Pose(self.origin.position, turned)


@dataclass(frozen=True)
class RobotShapes:
    """Joints from the root outwards, and what hangs on the links."""

    joints: tuple[UrdfJoint, ...]
    shapes: tuple[LinkShape, ...]

    def path(self, link: str) -> str:
        """Names of the links from below the root to ``link``, with a slash before each."""
        parents = {joint.child: joint.parent for joint in self.joints}
        names: list[str] = []
        while link in parents:
            names.insert(0, link)
            link = parents[link]
        return ''.join(f'/{name}' for name in names)

    def turn_of(self, link: str, positions: Mapping[str, float]) -> Array:
        """Rotation (3, 3) of ``link`` in the root's frame, joints by name; missing ones at 0."""
        by_child = {joint.child: joint for joint in self.joints}
        turn = np.eye(3)
        while link in by_child:
            joint = by_child[link]
            pose = joint.transform(positions.get(joint.name, 0.0))
            turn = np.array(rotation_matrix(pose.quaternion)) @ turn
            link = joint.parent
        return turn


def read_urdf(text: str) -> RobotShapes:
    """Shapes and joints of a URDF; shapes from mesh files are left out.

    Raises
    ------
    ValueError
        The text is no URDF: not XML, a number is missing or wrong, or joints go in a circle.
    """
    try:
        root = ElementTree.fromstring(text)
        joints = tuple(_joints(root))
        shapes = tuple(_shapes(root))
    except (ElementTree.ParseError, KeyError, TypeError, ValueError) as error:
        msg = f'robot_description is no URDF that can be drawn: {error}'
        raise ValueError(msg) from error
    return RobotShapes(_outwards(joints), shapes)


def _joints(root: ElementTree.Element) -> Iterator[UrdfJoint]:
    for element in root.iter('joint'):
        parent, child = element.find('parent'), element.find('child')
        if parent is None or child is None:
            continue
        axis, limit = element.find('axis'), element.find('limit')
        yield UrdfJoint(
            element.attrib['name'],
            element.attrib['type'],
            parent.attrib['link'],
            child.attrib['link'],
            _origin(element),
            _numbers('1 0 0' if axis is None else axis.attrib['xyz']),
            None if limit is None else (_end(limit, 'lower'), _end(limit, 'upper')),
        )


def _end(limit: ElementTree.Element, name: str) -> float:
    return float(limit.attrib.get(name, '0'))


def _shapes(root: ElementTree.Element) -> Iterator[LinkShape]:
    named = {
        material.attrib.get('name', ''): colour
        for material in root.iter('material')
        if (colour := material.find('color')) is not None
    }
    for link in root.iter('link'):
        for visual in link.iter('visual'):
            geometry = visual.find('geometry')
            form = None if geometry is None else next(iter(geometry), None)
            if form is None or form.tag not in ('box', 'cylinder', 'sphere'):
                continue
            sizes: tuple[float, ...]
            if form.tag == 'box':
                sizes = _numbers(form.attrib['size'])
            elif form.tag == 'cylinder':
                sizes = (float(form.attrib['radius']), float(form.attrib['length']))
            else:
                sizes = (float(form.attrib['radius']),)
            material = visual.find('material')
            colour = None if material is None else material.find('color')
            if colour is None and material is not None:
                colour = named.get(material.attrib.get('name', ''))
            rgb = _GREY if colour is None else _numbers(colour.attrib['rgba'])
            yield LinkShape(link.attrib['name'], form.tag, sizes, _origin(visual), rgb)


def _origin(element: ElementTree.Element) -> Pose:
    origin = element.find('origin')
    if origin is None:
        return Pose()
    roll, pitch, yaw = _numbers(origin.attrib.get('rpy', '0 0 0'))
    turn: Quaternion = (0.0, 0.0, 0.0, 1.0)
    for axis, angle in ((0, roll), (1, pitch), (2, yaw)):
        part = [0.0, 0.0, 0.0]
        part[axis] = math.sin(angle / 2)
        turn = quaternion_product((part[0], part[1], part[2], math.cos(angle / 2)), turn)
    return Pose(_numbers(origin.attrib.get('xyz', '0 0 0')), turn)


def _numbers(text: str) -> Vec3:
    x, y, z = [float(word) for word in text.split()][:3]
    return (x, y, z)


def _outwards(joints: tuple[UrdfJoint, ...]) -> tuple[UrdfJoint, ...]:
    """The joints in such an order that a link comes before what hangs on it."""
    left, ordered = list(joints), list[UrdfJoint]()
    hanging = {joint.child for joint in joints}
    while left:
        ready = [joint for joint in left if joint.parent not in hanging]
        if not ready:
            msg = f'robot_description: joints go in a circle at {left[0].name!r}'
            raise ValueError(msg)
        ordered += ready
        left = [joint for joint in left if joint not in ready]
        hanging -= {joint.child for joint in ready}
    return tuple(ordered)
