"""The planning world without physics: bars with round ends against upright boxes.

Answers as :class:`arm_executor.motion.collision.PlanningWorld` does, some ten times as fast; what
leans counts as the upright box around it. It is what predictions are made with, never what a motion
is checked with.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.layout import Block, Layout
from arm_executor.model.robot_data import RobotModel
from arm_executor.model.tree import LINKS, cell_joints
from arm_executor.model.urdf import PAD_THICKNESS, robot_capsules
from arm_executor.motion.obstacle_world import (
    ARM_MARGIN,
    BOX_MARGIN,
    BOX_SKIN,
    PAD_MARGIN,
    WIDE_FROM,
    WIDE_MARGIN,
)
from arm_executor.motion.path import JointPath
from arm_executor.motion.swing import Obstacles
from arm_executor.motion.touching import (
    BAR_HELD,
    BAR_OBSTACLE,
    BARS,
    HELD_OBSTACLE,
    NOTHING,
    first_touch,
)
from pack_msgs_py.geometry.pose import Pose, extent
from pack_msgs_py.values import Vec3

Array = NDArray[np.float64]

#: Link numbers of :mod:`arm_executor.motion.touching`.
_CARRIAGE, _TOOL = 7, 6
#: How much the round top of the bar that stands for the pedestal lies below its flat one.
_TOP = 0.03
#: Links so many joints apart cannot meet, or always touch.
_NEIGHBOUR_LINKS = 2


class QuickWorld:
    """Obstacles by name, the arm, and one carried box.

    Parameters
    ----------
    robot, layout : which robot it is, and where everything stands.
    """

    def __init__(self, robot: RobotModel, layout: Layout) -> None:
        self._base_height = layout.rail.base_height
        moving = [joint for joint in cell_joints(robot, layout) if joint.index]
        self._offsets = np.array([joint.xyz for joint in moving])
        self._rolls = np.array(
            [(math.cos(joint.rpy[0]), math.sin(joint.rpy[0])) for joint in moving]
        )
        tool, radius = layout.tool, layout.rail.pedestal_radius
        bars = [(LINKS.index(c.link), c.start, c.end, c.radius) for c in robot_capsules(robot)]
        arm = len(bars)
        mast, pad = tool.diameter / 2, tool.length - PAD_THICKNESS / 2
        top = max(radius, self._base_height - _TOP)
        bars += [
            (_TOOL, (0.0, 0.0, mast), (0.0, 0.0, tool.length - PAD_THICKNESS - mast), mast),
            (_TOOL, (0.0, 0.0, pad), (0.0, 0.0, pad), tool.pad_edge / 2),
            (_CARRIAGE, (0.0, 0.0, radius), (0.0, 0.0, top), radius),
        ]
        self._links = np.array([link for link, *_ in bars])
        self._ends = np.array([(start, end) for _, start, end, _ in bars])
        radii = np.array([bar[3] for bar in bars])
        self._reaches = np.stack([radii + ARM_MARGIN, radii + ARM_MARGIN, radii], axis=1)
        self._reaches[arm:, :2] = -1.0
        self._reaches[arm, 0], self._reaches[-1, 1] = mast, radius + ARM_MARGIN
        order = [link if link < _CARRIAGE else -1 for link in self._links]
        order[arm : arm + 2] = [_CARRIAGE, _CARRIAGE]
        self._pairs = np.array([
            (k, other)
            for k in range(len(bars))
            for other in range(k)
            if abs(order[k] - order[other]) > _NEIGHBOUR_LINKS
        ])  # fmt: skip
        self._names_of_bars = [*(LINKS[link] for link in self._links[:arm]), 'tool', 'tool']
        self._names_of_bars.append('carriage')
        half = tool.pad_edge / 2 + PAD_MARGIN
        self._pad = (_TOOL, pad, np.array([half, half, PAD_THICKNESS / 2]))
        self._spans: dict[str, tuple[Vec3, Vec3]] = {}
        self._table: tuple[list[str], Array, Array] | None = None
        self._held = ''
        self._halves = np.zeros((2, 3))
        self.held_size: Vec3 = (0.0, 0.0, 0.0)

    def set_block(self, block: Block) -> None:
        """Add a fixed obstacle under its own name."""
        self._set(block.name, (block.low, block.high))

    def set_box(self, name: str, size: Vec3, pose: Pose) -> None:
        """Add an obstacle called ``name``, or move it."""
        self._set(name, extent(pose, size))

    def _set(self, name: str, span: tuple[Vec3, Vec3]) -> None:
        if self._spans.get(name) != span:
            self._spans[name] = span
            self._table = None

    def remove(self, name: str) -> None:
        """Take an obstacle away; one that is not there is fine."""
        if self._spans.pop(name, None) is not None:
            self._table = None

    def names(self) -> Iterable[str]:
        """Names of the obstacles."""
        return tuple(self._spans)

    def obstacles(self, without: Collection[str] = ()) -> Obstacles:
        """Extents of all obstacles but those called one of ``without``."""
        names, low, high = self._arrays()
        kept = [name not in without for name in names]
        return Obstacles(low[kept], high[kept])

    def _arrays(self) -> tuple[list[str], Array, Array]:
        if self._table is None:
            table = np.array(list(self._spans.values()), dtype=float).reshape(-1, 2, 3)
            low, high = (np.ascontiguousarray(table[:, end]) for end in (0, 1))
            self._table = (list(self._spans), low, high)
        return self._table

    def hold(self, size: Vec3, name: str) -> None:
        """Hang a box of ``size`` under the pad for the coming checks."""
        x, y, z = size
        close = (x + 2 * BOX_MARGIN, y + 2 * BOX_MARGIN, max(z - 2 * BOX_SKIN, z / 4))
        self._halves = np.array([close, (x, y, z)]) / 2
        self._halves[1] += WIDE_MARGIN
        self._held, self.held_size = name, size

    def drop(self) -> None:
        """Take the carried box away."""
        self._held = ''

    def first_hit(self, path: JointPath, box_turn: float | None = None) -> str | None:
        """See :meth:`arm_executor.motion.collision.PlanningWorld.first_hit`."""
        count = len(path.q)
        which = np.full(count, -1)
        turns, centres = np.zeros((count, 3, 3)), np.zeros((count, 3))
        if self._held and box_turn is not None:
            away = np.minimum(
                np.hypot(*(path.tcp - path.tcp[0])[:, :2].T),
                np.hypot(*(path.tcp - path.tcp[-1])[:, :2].T),
            )
            which[:] = away > WIDE_FROM
            yaw = path.yaw + box_turn
            turns[:, 0, 0] = turns[:, 1, 1] = np.cos(yaw)
            turns[:, 1, 0] = np.sin(yaw)
            turns[:, 0, 1] = -turns[:, 1, 0]
            turns[:, 2, 2] = 1.0
            centres = path.tcp - (0.0, 0.0, self.held_size[2] / 2)
        return self._first(path.q, which, centres, turns)

    def first_hit_tilted(self, q: Array, tool: Array) -> str | None:
        """See :meth:`arm_executor.motion.collision.PlanningWorld.first_hit_tilted`."""
        away = np.linalg.norm(tool[:, :3, 3] - tool[0, :3, 3], axis=1)
        beside = np.hypot(*(tool[:, :2, 3] - tool[-1, :2, 3]).T)
        moved = away >= WIDE_FROM
        which = (beside > WIDE_FROM).astype(np.int64)
        centres = tool[:, :3, 3] + tool[:, :3, 2] * self.held_size[2] / 2
        turns = np.ascontiguousarray(tool[:, :3, :3])
        return self._first(q[moved], which[moved], centres[moved], turns[moved])

    def _first(
        self, q: Array, which: NDArray[np.int64], centres: Array, turns: Array
    ) -> str | None:
        names, low, high = self._arrays()
        what, first, second = first_touch(
            np.ascontiguousarray(q), self._offsets, self._rolls, self._base_height, self._links,
            self._ends, self._reaches, self._pairs, *self._pad, low, high, which, centres, turns,
            self._halves,
        )  # fmt: skip
        if what == NOTHING:
            return None
        bars = self._names_of_bars
        return {
            BAR_OBSTACLE: lambda: f'{bars[first]} and {names[second]}',
            BAR_HELD: lambda: f'{bars[first]} and {self._held}',
            BARS: lambda: f'{bars[first]} and {bars[second]}',
            HELD_OBSTACLE: lambda: f'{self._held} and {names[second]}',
        }.get(what, lambda: f'tool and {names[second]}')()
