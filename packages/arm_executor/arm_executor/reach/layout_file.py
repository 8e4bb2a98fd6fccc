"""Layouts from a file: YAML with the names of :mod:`arm_executor.model.layout`.

What it leaves out keeps the default of its robot.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from arm_executor.model.layout import (
    ConveyorLayout,
    Layout,
    LayoutError,
    Rail,
    Stations,
    Tool,
    check_layout,
)
from arm_executor.model.robot_data import ROBOTS
from arm_executor.reach.reach import check_reach
from pack_msgs_py.values import BinSpec

#: The common layout is too large for these two: bins stand nearer, the arm stands and waits lower,
#: and the mast is shorter (and lighter, for an arm that lifts 5 kg in all). They are for bins like
#: SYN.
_SMALL = Layout(
    rail=Rail(base_height=1.10),
    tool=Tool(length=0.45),
    conveyor=ConveyorLayout(tallest_box=0.45),
    stations=Stations(near_y=0.32, near_y_open_front=0.62),
)
#: With less reach the base stands nearer to what it picks up.
_SHORTER = Layout(rail=Rail(base_height=1.30))
_DEFAULTS = {
    'ur10e': _SHORTER,
    'ur30': _SHORTER,
    'ur16e': _SMALL,
    'ur5e': replace(_SMALL, rail=Rail(base_height=1.20), tool=replace(_SMALL.tool, mass=1.0)),
}


def default_layout(robot: str) -> Layout:
    """The layout that goes with ``robot``; :class:`LayoutError` lists the known ones."""
    if robot not in ROBOTS:
        msg = f'layout: unknown robot {robot!r}: use one of {", ".join(ROBOTS)}'
        raise LayoutError(msg)
    return replace(_DEFAULTS.get(robot, Layout()), robot=robot)


def find_layout(path: str, robot: str = '') -> Layout:
    """The layout in file ``path``, with ``robot`` instead of its own; either may be empty.

    Raises
    ------
    LayoutError
        The file cannot be read, a key or the robot is not known, or a value is not a number.
    """
    if path:
        return load_layout(Path(path), robot)
    return default_layout(robot or Layout.robot)


def layout_for(path: str, robot: str, bins: Mapping[str, BinSpec], *, must_reach: bool) -> Layout:
    """The layout of :func:`find_layout`, checked for ``bins`` (kind by station).

    ``must_reach`` is whether the robot has to reach them.

    Raises
    ------
    LayoutError
        It cannot be read, built or served by the robot.
    """
    layout = check_layout(find_layout(path, robot), bins)
    if must_reach:
        check_reach(layout, bins)
    return layout


def load_layout(path: Path, robot: str = '') -> Layout:
    """Read a layout from YAML; see :func:`find_layout`."""
    import yaml

    try:
        content = yaml.safe_load(path.read_text(encoding='utf-8')) or {}
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise LayoutError(f'layout {path}: {error}') from error
    if not isinstance(content, Mapping):
        raise LayoutError(f'layout {path}: expected a mapping, got {content!r}')
    name = robot or content.get('robot', Layout.robot)
    if not isinstance(name, str):
        raise LayoutError(f'layout {path}: robot is {name!r}; it must be a name')
    layout: Layout = _filled(default_layout(name), {**content, 'robot': name}, str(path))
    return layout


def _filled(default: Any, content: Any, where: str) -> Any:  # noqa: ANN401 - a dataclass of any part
    """``default`` with the values of ``content``."""
    if not isinstance(content, Mapping):
        raise LayoutError(f'layout {where}: expected a mapping, got {content!r}')
    known = {part.name: getattr(default, part.name) for part in fields(default)}
    values: dict[str, Any] = {}
    for key, value in content.items():
        if key not in known:
            msg = f'layout {where}: unknown key {key!r}; known are {", ".join(known)}'
            raise LayoutError(msg)
        if is_dataclass(known[key]):
            values[key] = _filled(known[key], value, f'{where}: {key}')
        elif isinstance(known[key], str):
            values[key] = value
        elif isinstance(value, bool) or not isinstance(value, (int, float)):
            raise LayoutError(f'layout {where}: {key} is {value!r}; it must be a number')
        else:
            values[key] = float(value)
    return replace(default, **values)
