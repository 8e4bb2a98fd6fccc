"""Which places of a bin the arm's joints can take the pad to, whatever may be in the way.

A layout is judged on a grid of placements of one box in an empty bin: every 10 cm in x and y, on
the floor, at half height and flush with the rim. Only inverse kinematics, so that a node can afford
it at its start; :mod:`arm_executor.reach.reach_motion` goes on with collisions and time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.kinematics import BRANCHES, HOME_POSTURE, CellKinematics
from arm_executor.model.layout import Layout, LayoutError, bin_frame, lifting_limit, pick_pose
from arm_executor.model.robot_data import ROBOTS, find_robot
from arm_executor.motion.task import hover_point
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import BinSpec, Box, Vec3

Array = NDArray[np.float64]

#: Size of the box that a layout is judged with, a common carton, and the most that it weighs.
PROBE_MM, _PROBE_KG = (300.0, 200.0, 200.0), 5.0
#: A bin of which the arm reaches less than this share is none that it can pack.
LEAST_REACH = 0.5
#: Where the arm may stand on its rail, relative to the target; metres.
RAIL_OFFSETS = (0.0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1.0, -1.0, 1.25, -1.25)
#: Elbow above the shoulder, in either posture of shoulder and wrist.
ELBOW_UP = tuple(i for i, (shoulder, _, elbow) in enumerate(BRANCHES) if shoulder == elbow)
_GRID_M, _GAP_M = 0.10, 0.004


def probe_box(layout: Layout) -> Box:
    """The box that ``layout`` is judged with; its robot can lift it."""
    return Box('probe', PROBE_MM, min(_PROBE_KG, lifting_limit(layout)))


def probe_places(spec: BinSpec) -> Array:
    """Centres (n, 3) of the probe box in a bin of kind ``spec``, bin frame, metres."""
    size = [edge / 1000 for edge in PROBE_MM]
    bin_size = [edge / 1000 for edge in spec.size_mm]
    for axis, edge, room in zip('xyz', size, bin_size, strict=True):
        if edge + 2 * _GAP_M > room:
            msg = (
                f'bin {spec.name} is {room:g} m along {axis}, too small for the '
                f'{edge:g} m of the box that layouts are judged with'
            )
            raise LayoutError(msg)
    level = [_spread(edge, room) for edge, room in zip(size[:2], bin_size[:2], strict=True)]
    low, high = size[2] / 2, bin_size[2] - size[2] / 2
    heights = np.array([low, (low + high) / 2, high])
    return np.stack(np.meshgrid(*level, heights, indexing='ij'), axis=-1).reshape(-1, 3)


def _spread(edge: float, room: float) -> Array:
    first, last = edge / 2 + _GAP_M, room - edge / 2 - _GAP_M
    return np.linspace(first, last, math.ceil((last - first) / _GRID_M) + 1)


def pad_points(layout: Layout, station: str, spec: BinSpec, centres: Array) -> Array:
    """Where the pad is (n, 3), frame `cell`, with the probe box at ``centres`` (n, 3)."""
    frame = bin_frame(layout, station, spec)
    points = np.array([frame.to_cell(Pose(_vec(centre))).position for centre in centres])
    points[:, 2] += PROBE_MM[2] / 2000
    return points


def configurations(kinematics: CellKinematics, points: Array) -> Array:
    """Configurations (n, 11, 8, 7) for the pad at ``points`` (n, 3); NaN where there is none.

    Axes: point, place on the rail, branch, joint.
    """
    rail = kinematics.layout.rail
    by_offset = [
        kinematics.tool_down(
            np.clip(points[:, 0] + offset, rail.x_min, rail.x_max),
            points,
            np.zeros(len(points)),
            ELBOW_UP,
        )
        for offset in RAIL_OFFSETS
    ]
    return np.stack(by_offset, axis=1)


def reached(layout: Layout, station: str, spec: BinSpec) -> float:
    """Share of the places of a bin that the joints can take the pad to, 0 to 1."""
    kinematics = CellKinematics(find_robot(layout.robot), layout)
    points = pad_points(layout, station, spec, probe_places(spec))
    return float(_possible(configurations(kinematics, points)).mean())


def check_reach(layout: Layout, bins: Mapping[str, BinSpec], least: float = LEAST_REACH) -> None:
    """:class:`LayoutError` when the arm cannot serve the pick point or a bin of ``bins``.

    ``bins`` are kinds by station; ``least`` is the share of a bin that must be in reach.
    """
    kinematics = CellKinematics(find_robot(layout.robot), layout)
    x, y, z = pick_pose(layout, PROBE_MM).position
    for name, point, branches in (
        ('the waiting point above the belt', hover_point(layout), (BRANCHES.index(HOME_POSTURE),)),
        ('a box at the pick point', (x, y, z + PROBE_MM[2] / 2000), ELBOW_UP),
    ):
        q = kinematics.tool_down([layout.rail.nearest(0.0)], [point], [0.0], branches)[0]
        if np.isnan(q).any(axis=1).all():
            msg = (
                f'layout: {layout.robot} (reach {kinematics.robot.reach:g} m) on a base '
                f'{layout.rail.base_height:g} m high cannot reach {name}, '
                f'({point[0]:g}, {point[1]:g}, {point[2]:g}) m; {_advice(layout)}'
            )
            raise LayoutError(msg)
    for station, spec in bins.items():
        share = reached(layout, station, spec)
        if share < least:
            msg = (
                f'layout: {layout.robot} (reach {kinematics.robot.reach:g} m) reaches {share:.0%} '
                f'of bin {station} ({spec.name}), at least {least:.0%} are needed; '
                f'{_advice(layout)}, or a smaller bin'
            )
            raise LayoutError(msg)


def _advice(layout: Layout) -> str:
    change = 'change rail.base_height, stations.near_y or tool.length'
    farthest = max(ROBOTS.values(), key=lambda robot: robot.reach)
    if find_robot(layout.robot).reach >= farthest.reach:
        return f'no arm that is known reaches farther: {change}'
    return f'take a longer arm than {layout.robot} ({farthest.name} reaches farthest), or {change}'


def _possible(q: Array) -> NDArray[np.bool_]:
    """Which points (n,) have a configuration among ``q`` (n, 11, 8, 7)."""
    exists = ~np.isnan(q).any(axis=3)
    return np.asarray(exists.reshape(len(q), -1).any(axis=1))


def _vec(row: Array) -> Vec3:
    x, y, z = (float(value) for value in row)
    return (x, y, z)
