"""The bins that stand in the cell, as bodies in physics and as obstacles for planning."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from arm_executor.arms.physics.world import PhysicsWorld
from arm_executor.model.arm_interface import MotionError, MotionUnderWay
from arm_executor.model.layout import BinFrame, Layout, bin_blocks, bin_frame, check_layout
from arm_executor.motion.obstacle_world import ObstacleWorld
from arm_executor.motion.task import Site, StandingBox
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose, corner_distance, extent, folded, metres, turn_between
from pack_msgs_py.values import Bin, BinSpec, Vec3

#: Longest robot time that boxes get to come to rest, seconds.
SETTLE_TIMEOUT_S = 3.0
#: A box closer than this to where it is said to be is left alone, metres and radians.
_SAME_PLACE, _SAME_TURN = 0.002, 0.01


@dataclass
class StandingBin:
    """A station that holds a bin."""

    station: str
    bin_id: str
    spec: BinSpec
    frame: BinFrame
    box_ids: list[str] = field(default_factory=list)

    def contains(self, pose: Pose, size: Vec3) -> bool:
        """Whether a box with its centre at ``pose``, bin frame, stands over the bin's floor."""
        x, y, z = pose.position
        length, breadth, _ = (edge / 1000 for edge in self.spec.size_mm)
        return 0 < x < length and 0 < y < breadth and z > min(size) / 4


class StandingBins:
    """Keeps the two worlds in step with the bins; only what changed is touched.

    ``plannings`` are the worlds for planning and for prediction. ``lock`` is held by whoever
    changes them, or plans in them: one thread moves the arm, another plans ahead.
    """

    def __init__(self, layout: Layout, world: PhysicsWorld, *plannings: ObstacleWorld) -> None:
        self._layout = layout
        self._world = world
        self._plannings = plannings
        self._by_station: dict[str, StandingBin] = {}
        self.lock = threading.RLock()

    def __iter__(self) -> Iterator[StandingBin]:
        return iter(self._by_station.values())

    def find(self, station: str) -> StandingBin | None:
        """The bin at ``station``, if one is there."""
        return self._by_station.get(station)

    def set_bins(self, bins: Sequence[Bin], poses: Mapping[str, Pose]) -> dict[str, Pose]:
        """See :meth:`arm_executor.model.arm_interface.Arm.set_bins`.

        Raises
        ------
        LayoutError
            A station is not known, or a bin of this size does not fit there.
        ValueError
            A box has no pose.
        """
        wanted = {content.station: content for content in bins}
        check_layout(self._layout, {station: new.spec for station, new in wanted.items()})
        box_ids = [placed.box.id for content in bins for placed in content.boxes]
        missing = [box_id for box_id in box_ids if box_id not in poses]
        if missing:
            msg = f'boxes {", ".join(missing)} have no pose; give one for every box in a bin'
            raise ValueError(msg)
        with self.lock:
            return self._set_bins(wanted, poses)

    def _set_bins(self, wanted: Mapping[str, Bin], poses: Mapping[str, Pose]) -> dict[str, Pose]:
        for standing_bin in list(self):
            new = wanted.get(standing_bin.station)
            if new is None or (new.id, new.spec) != (standing_bin.bin_id, standing_bin.spec):
                self._remove(standing_bin)
        changed = False
        for station, new in wanted.items():
            if station not in self._by_station:
                self._add(station, new)
            changed |= self._fill(self._by_station[station], new, poses)
        if changed:
            everywhere = [box_id for standing_bin in self for box_id in standing_bin.box_ids]
            self._world.settle(everywhere, SETTLE_TIMEOUT_S)
            for standing_bin in self:
                self.show_planner(standing_bin)
        return {
            box_id: standing_bin.frame.from_cell(self._world.pose(box_id))
            for standing_bin in self
            for box_id in standing_bin.box_ids
        }

    def forget(self, box_id: str) -> None:
        """Take a box out of both worlds, wherever it is."""
        with self.lock:
            for standing_bin in self:
                if box_id in standing_bin.box_ids:
                    standing_bin.box_ids.remove(box_id)
            self._world.remove_box(box_id)
            for planning in self._plannings:
                planning.remove(_obstacle(box_id))

    def show_planner(self, standing_bin: StandingBin) -> None:
        """Tell planning where the boxes of ``standing_bin`` are now."""
        with self.lock:
            for box_id in standing_bin.box_ids:
                size = self._world.boxes[box_id].size
                for planning in self._plannings:
                    planning.set_box(_obstacle(box_id), size, self._world.pose(box_id))

    def site(self, standing_bin: StandingBin) -> Site:
        """``standing_bin`` as the planner sees it."""
        world = self._world
        boxes = [
            _standing_box(box_id, world.pose(box_id), world.boxes[box_id].size)
            for box_id in standing_bin.box_ids
        ]
        return Site(standing_bin.station, standing_bin.spec, standing_bin.frame, boxes)

    @contextmanager
    def expecting(self, standing_bin: StandingBin, first: MotionUnderWay) -> Iterator[Site]:
        """``standing_bin`` as it will be, and an obstacle where the box of ``first`` will rest.

        Raises
        ------
        MotionError
            ``INVALID_GOAL`` when the bin of ``first`` has gone.
        """
        request = first.plan.request
        other = self.find(request.station)
        if other is None:
            msg = f'the bin at station {request.station!r} has gone since that motion was planned'
            raise MotionError(ErrorCode.INVALID_GOAL, msg)
        box_id, size = request.box.id, metres(request.box.size_mm)
        pose = other.frame.to_cell(first.rest)
        site = self.site(standing_bin)
        if other is standing_bin:
            boxes = [box for box in site.boxes if box.box_id != box_id]
            site = replace(site, boxes=[*boxes, _standing_box(box_id, pose, size)])
        name = f'expected box {box_id}'
        for planning in self._plannings:
            planning.set_box(name, size, pose)
        try:
            yield site
        finally:
            for planning in self._plannings:
                planning.remove(name)

    def _add(self, station: str, new: Bin) -> None:
        blocks = bin_blocks(self._layout, station, new.spec)
        self._world.add_part(_part(station), blocks)
        for planning in self._plannings:
            for block in blocks:
                planning.set_block(block)
        frame = bin_frame(self._layout, station, new.spec)
        self._by_station[station] = StandingBin(station, new.id, new.spec, frame)

    def _remove(self, standing_bin: StandingBin) -> None:
        for box_id in list(standing_bin.box_ids):
            self.forget(box_id)
        self._world.remove_part(_part(standing_bin.station))
        for block in bin_blocks(self._layout, standing_bin.station, standing_bin.spec):
            for planning in self._plannings:
                planning.remove(block.name)
        del self._by_station[standing_bin.station]

    def _fill(self, standing_bin: StandingBin, new: Bin, poses: Mapping[str, Pose]) -> bool:
        """Make ``standing_bin`` hold exactly the boxes of ``new``; whether anything changed."""
        wanted = {placed.box.id: placed.box for placed in new.boxes}
        gone = [box_id for box_id in standing_bin.box_ids if box_id not in wanted]
        for box_id in gone:
            self.forget(box_id)
        changed = bool(gone)
        for box_id, box in wanted.items():
            pose = standing_bin.frame.to_cell(poses[box_id])
            if box_id not in standing_bin.box_ids:
                self.forget(box_id)
                self._world.add_box(box, pose)
                standing_bin.box_ids.append(box_id)
            elif self._is_at(box_id, pose):
                continue
            else:
                self._world.move_box(box_id, pose)
            changed = True
        return changed

    def _is_at(self, box_id: str, pose: Pose) -> bool:
        now = self._world.pose(box_id)
        pose = folded(pose, now)
        away = corner_distance(now, pose, self._world.boxes[box_id].size)
        return away < _SAME_PLACE and turn_between(now, pose) < _SAME_TURN


def _standing_box(box_id: str, pose: Pose, size: Vec3) -> StandingBox:
    return StandingBox(box_id, *extent(pose, size))


def _part(station: str) -> str:
    return f'bin {station}'


def _obstacle(box_id: str) -> str:
    return f'placed box {box_id}'
