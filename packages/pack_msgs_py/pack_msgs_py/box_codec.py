"""Boxes, placed boxes and poses as JSON, for everything in the cell that outlives a process.

The executor's journal, the conveyor's ledger and the list of true boxes write boxes in this form
alone. An object has the fields of the dataclass under their own names; what is optional there may
be missing, so that files from before a field was added stay readable. What is not known is refused:
dropping it would lose something about a box.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, asdict, fields, replace
from typing import Any, cast

from pack_msgs_py.checks import InvalidValue, check_finite, check_orientation, check_vec3
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Box, Int3, PlacedBox, Vec3, check_box

JsonObject = dict[str, Any]


def box_to_data(box: Box) -> JsonObject:
    """``box`` as an object of lists, numbers and texts."""
    return asdict(box)


def box_from_data(data: object) -> Box:
    """Inverse of :func:`box_to_data`.

    Raises
    ------
    InvalidValue
        The object is no box: which field, and why.
    """
    values = _object('box', data, Box)
    try:
        for name in ('size_mm', 'com_offset_mm', 'size_stddev_mm'):
            if name in values:
                values[name] = _vec3(f'box {name}', values[name])
        if 'yaw_stddev_rad' in values:
            values['yaw_stddev_rad'] = check_finite('box yaw_stddev_rad', values['yaw_stddev_rad'])
        values['extra'] = tuple((str(key), str(text)) for key, text in values.get('extra', ()))
        return check_box(Box(**values))
    except InvalidValue:
        raise
    except (ValueError, TypeError) as error:
        msg = f'box record cannot be used: {error}'
        raise InvalidValue(msg) from error


def pose_to_data(pose: Pose) -> JsonObject:
    """``pose`` as an object: position in metres, quaternion (x, y, z, w)."""
    return asdict(pose)


def pose_from_data(data: object) -> Pose:
    """Inverse of :func:`pose_to_data`; a list of the two, as journals of 0.1 have it, will do too.

    Raises
    ------
    InvalidValue
        It is no pose: which part, and why.
    """
    if isinstance(data, Sequence) and len(data) == 2:
        data = dict(zip(('position', 'quaternion'), data, strict=True))
    values = _object('pose', data, Pose)
    try:
        position = _vec3('pose position', values.get('position', (0.0, 0.0, 0.0)))
        x, y, z, w = (
            check_finite('pose quaternion', part)
            for part in values.get('quaternion', Pose().quaternion)
        )
    except InvalidValue:
        raise
    except (ValueError, TypeError) as error:
        msg = f'pose record cannot be used: {error}'
        raise InvalidValue(msg) from error
    return Pose(position, (x, y, z, w))


def box_to_json(box: Box) -> str:
    """``box`` as one line."""
    return json.dumps(box_to_data(box))


def box_from_json(text: str) -> Box:
    """Inverse of :func:`box_to_json`; raises as :func:`box_from_data`."""
    return box_from_data(_loaded('box', text))


def pose_to_json(pose: Pose) -> str:
    """``pose`` as one line."""
    return json.dumps(pose_to_data(pose))


def pose_from_json(text: str) -> Pose:
    """Inverse of :func:`pose_to_json`; raises as :func:`pose_from_data`."""
    return pose_from_data(_loaded('pose', text))


def placed_to_json(placed: PlacedBox) -> str:
    """Everything that is needed to rebuild ``placed`` as it was planned, on one line.

    What was measured is kept apart, as a pose.
    """
    return json.dumps(asdict(replace(placed, measured_mm=None)))


def placed_from_json(text: str) -> PlacedBox:
    """Inverse of :func:`placed_to_json`.

    Raises
    ------
    InvalidValue
        The text is no placed box: which field, and why.
    """
    values = _object('placed box', _loaded('placed box', text), PlacedBox)
    return PlacedBox(
        box=box_from_data(values['box']),
        corner_mm=_int3('placed box corner_mm', values['corner_mm']),
        size_mm=_int3('placed box size_mm', values['size_mm']),
        orientation=check_orientation(str(values.get('orientation', 'xyz'))),
    )


def _loaded(what: str, text: str) -> object:
    try:
        return json.loads(text)
    except ValueError as error:
        msg = f'{what} record is not JSON: {text[:60]!r}'
        raise InvalidValue(msg) from error


def _object(what: str, data: object, kind: type[Any]) -> JsonObject:
    """``data`` when it is an object with the fields of dataclass ``kind``, and no others."""
    if not isinstance(data, Mapping):
        msg = f'{what} record is {str(data)[:60]!r}; it must be an object'
        raise InvalidValue(msg)
    known = fields(kind)
    unknown = set(data) - {field.name for field in known}
    if unknown:
        msg = f'{what} record has {", ".join(sorted(map(str, unknown)))}, which is not known here'
        raise InvalidValue(msg)
    missing = [f.name for f in known if f.default is MISSING and f.default_factory is MISSING]
    missing = [name for name in missing if name not in data]
    if missing:
        msg = f'{what} record lacks {", ".join(missing)}: {str(dict(data))[:60]}'
        raise InvalidValue(msg)
    return dict(data)


def _vec3(name: str, value: object) -> Vec3:
    if not isinstance(value, Sequence) or len(value) != 3:
        msg = f'{name} is {value!r}; it must be three numbers'
        raise InvalidValue(msg)
    return check_vec3(name, cast(Sequence[float], value))


def _int3(name: str, value: object) -> Int3:
    whole = isinstance(value, Sequence) and all(type(number) is int for number in value)
    if not whole or len(cast(Sequence[int], value)) != 3:
        msg = f'{name} is {value!r}; it must be three whole numbers'
        raise InvalidValue(msg)
    x, y, z = cast(Sequence[int], value)
    return (x, y, z)
