"""A recorded run as pictures: the cell at moments of robot time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm_executor.arms.physics.render import Camera
from arm_executor.arms.physics.stage import Stage
from arm_executor.model import colours
from arm_executor.model.layout import Block, ConveyorLayout
from pack_cell.replay.moments import Moments, matrix_of, pose_of
from pack_cell.replay.timeline import Timeline

#: Bars of the frame of a bin and thickness of its floor, metres.
_BAR, _FLOOR = 0.016, 0.02
#: Room that the belt has beyond the last box, metres.
_BEYOND = 0.35

Parts = dict[str, list[tuple[Block, colours.Colour]]]


class Filming:
    """Draws moments of ``run``; close it when done.

    The walls of bins are drawn as bars, so that their content is to be seen.
    """

    def __init__(self, run: Timeline) -> None:
        self._stage = Stage(run.urdf if run.joints else '', _still(run))
        self._moments = Moments(run, self._pad_at)

    def picture(self, now_s: float, width: int, height: int, camera: Camera) -> NDArray[np.uint8]:
        """The cell at ``now_s`` of robot time, (height, width, 3)."""
        self._stage.put_joints(self._moments.joints(now_s))
        self._stage.put_boxes(
            {seen.box_id: (seen.size, pose_of(seen.pose)) for seen in self._moments.boxes(now_s)}
        )
        parts: Parts = {
            of_run['id']: list(self._frame(of_run)) for of_run in self._moments.standing(now_s)
        }
        self._stage.put_parts(parts)
        return self._stage.picture(width, height, camera)

    def close(self) -> None:
        """Give everything back."""
        self._stage.close()

    def _pad_at(self, positions: Mapping[str, float]) -> NDArray[np.float64]:
        self._stage.put_joints(positions)
        pose = self._stage.link_pose('tcp')
        return np.eye(4) if pose is None else matrix_of(pose)

    def _frame(self, of_run: Mapping[str, Any]) -> Iterator[tuple[Block, colours.Colour]]:
        """Floor of a bin and, where it has walls, the bars that they would have."""
        length, breadth, height = (edge / 1000 for edge in of_run['size'])
        frame = self._moments.station(of_run['station'])

        def block(low: tuple[float, ...], high: tuple[float, ...]) -> Block:
            ends = [(frame @ np.array([*end, 1.0]))[:3] for end in (low, high)]
            corner, opposite = np.minimum(*ends).tolist(), np.maximum(*ends).tolist()
            return Block('bar', tuple(corner), tuple(opposite))

        yield block((0, 0, -_FLOOR), (length, breadth, 0)), colours.PALLET
        if of_run['walls'] == 'pallet':
            return
        for x in (-_BAR, length):
            for y in (-_BAR, breadth):
                yield block((x, y, 0), (x + _BAR, y + _BAR, height)), colours.WALL
        closed = of_run['walls'] == 'box'
        for z in (height - _BAR,):
            for y in (-_BAR, breadth) if closed else (-_BAR,):
                yield block((0, y, z), (length, y + _BAR, z + _BAR)), colours.WALL
            for x in (-_BAR, length):
                yield block((x, 0, z), (x + _BAR, breadth, z + _BAR)), colours.WALL


def _still(run: Timeline) -> list[tuple[Block, colours.Colour]]:
    """Floor, belt and rail, as far as the recording tells where they are."""
    blocks = [(Block('floor', (-20, -20, -0.1), (20, 20, 0.0)), colours.FLOOR)]
    if 'belt' in run.frames:
        belt = ConveyorLayout()
        _, front_y, top_z = run.frames['belt'].position
        far = [row[2] / 1000 + _BEYOND for _, rows in run.belt for row in rows]
        end_y = max([front_y + belt.length, *far])
        half = belt.width / 2
        blocks.append((Block('belt', (-half, front_y, 0.0), (half, end_y, top_z)), colours.BELT))
    for joint in () if run.robot is None else run.robot.joints:
        if joint.kind == 'prismatic' and joint.limits is not None:
            low, high = joint.limits
            rail = Block('rail', (low - 0.25, -0.12, 0.0), (high + 0.25, 0.12, 0.1))
            blocks.append((rail, colours.STEEL))
    return blocks
