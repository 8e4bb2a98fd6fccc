"""Links, joints and shapes of a robot, out of its URDF, as plain data for a page."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Any


def urdf_shapes(urdf: str) -> dict[str, Any] | None:
    """``joints`` in the order of the tree, and ``links`` with what can be seen of them.

    Metres and radians. A shape is a `box` with its edges, a `cylinder` along z with radius and
    length, or a `sphere` with its radius; others are left out. ``None`` for what is no URDF.
    """
    try:
        robot = ET.fromstring(urdf)
    except ET.ParseError:
        return None
    joints = [_joint(element) for element in robot.iter('joint')]
    children = {joint['child'] for joint in joints}
    known = {link.get('name', '') for link in robot.iter('link')} - children
    ordered: list[dict[str, Any]] = []
    while True:
        ready = [joint for joint in joints if joint['parent'] in known and joint not in ordered]
        if not ready:
            break
        ordered += ready
        known |= {joint['child'] for joint in ready}
    links = {link.get('name', ''): _shapes(link) for link in robot.iter('link')}
    return {'joints': ordered, 'links': {name: shapes for name, shapes in links.items() if shapes}}


def _joint(element: ET.Element) -> dict[str, Any]:
    xyz, rpy = _origin(element)
    axis = element.find('axis')
    limit = element.find('limit')
    return {
        'name': element.get('name', ''),
        'kind': element.get('type', 'fixed'),
        'parent': _named(element, 'parent'),
        'child': _named(element, 'child'),
        'xyz': xyz,
        'rpy': rpy,
        'axis': _numbers(axis.get('xyz') if axis is not None else None, [1.0, 0.0, 0.0]),
        'limits': None
        if limit is None
        else [float(limit.get('lower', '0')), float(limit.get('upper', '0'))],
    }


def _shapes(link: ET.Element) -> list[dict[str, Any]]:
    shapes = []
    for visual in link.iter('visual'):
        shape = _geometry(visual.find('geometry'))
        if shape is None:
            continue
        xyz, rpy = _origin(visual)
        colour = visual.find('material/color')
        rgba = _numbers(colour.get('rgba') if colour is not None else None, [0.7, 0.7, 0.7, 1.0])
        shapes.append({**shape, 'xyz': xyz, 'rpy': rpy, 'colour': rgba[:3]})
    return shapes


def _geometry(geometry: ET.Element | None) -> dict[str, Any] | None:
    if geometry is None:
        return None
    box, cylinder, sphere = (geometry.find(kind) for kind in ('box', 'cylinder', 'sphere'))
    if box is not None:
        return {'box': _numbers(box.get('size'), [0.1, 0.1, 0.1])}
    if cylinder is not None:
        ends = (cylinder.get('radius', '0.1'), cylinder.get('length', '0.1'))
        return {'cylinder': [float(end) for end in ends]}
    if sphere is not None:
        return {'sphere': float(sphere.get('radius', '0.1'))}
    return None


def _origin(element: ET.Element) -> tuple[list[float], list[float]]:
    origin = element.find('origin')
    given = (None, None) if origin is None else (origin.get('xyz'), origin.get('rpy'))
    return _numbers(given[0], [0.0, 0.0, 0.0]), _numbers(given[1], [0.0, 0.0, 0.0])


def _named(element: ET.Element, kind: str) -> str:
    end = element.find(kind)
    return '' if end is None else end.get('link', '')


def _numbers(text: str | None, default: list[float]) -> list[float]:
    return default if text is None else [float(word) for word in text.split()]
