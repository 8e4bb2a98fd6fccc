"""Bins as an arm was told of them, for one that has no world to look at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from arm_executor.model.arm_interface import MotionUnderWay
from arm_executor.model.layout import Layout, bin_blocks, bin_frame
from arm_executor.motion.obstacle_world import ObstacleWorld
from arm_executor.motion.task import Site, StandingBox
from pack_msgs_py.geometry.pose import Pose, extent, metres
from pack_msgs_py.values import Bin, BinSpec, Box, Vec3


@dataclass(frozen=True)
class BinContent:
    """A bin of kind ``spec``, and the size (m) and pose (bin frame) of each box in it by its id."""

    spec: BinSpec
    boxes: Mapping[str, tuple[Vec3, Pose]] = field(default_factory=dict)


class KnownBins:
    """The bins by station, and where the boxes in them are.

    Attributes
    ----------
    poses : of the boxes by station and id, bin frame; may be changed.
    """

    def __init__(self) -> None:
        self._specs: dict[str, BinSpec] = {}
        self._sizes: dict[str, Vec3] = {}
        self.poses: dict[str, dict[str, Pose]] = {}

    def set_bins(self, bins: Sequence[Bin], poses: Mapping[str, Pose]) -> dict[str, Pose]:
        """Every box is where ``poses`` says; see `arm_executor.model.arm_interface.Arm`."""
        self._specs = {bin_.station: bin_.spec for bin_ in bins}
        self._sizes = {
            placed.box.id: metres(placed.box.size_mm) for bin_ in bins for placed in bin_.boxes
        }
        self.poses = {
            bin_.station: {placed.box.id: poses[placed.box.id] for placed in bin_.boxes}
            for bin_ in bins
        }
        return {box_id: pose for content in self.poses.values() for box_id, pose in content.items()}

    def spec(self, station: str) -> BinSpec | None:
        """Kind of the bin at ``station``, if one is there."""
        return self._specs.get(station)

    def place(self, station: str, box: Box, pose: Pose) -> None:
        """``box`` is in the bin at ``station`` now."""
        self._sizes[box.id] = metres(box.size_mm)
        self.poses[station][box.id] = pose

    def standing(self, after: MotionUnderWay | None = None) -> dict[str, BinContent]:
        """What stands at each station, when ``after`` has ended."""
        boxes = {
            station: {box_id: (self._sizes[box_id], pose) for box_id, pose in content.items()}
            for station, content in self.poses.items()
        }
        if after is not None:
            first = after.plan.request
            boxes[first.station][first.box.id] = (metres(first.box.size_mm), after.rest)
        return {station: BinContent(self._specs[station], boxes[station]) for station in boxes}


class ShownBins:
    """Lets worlds of obstacles hold what stands in the bins; only what changed is touched."""

    def __init__(self, layout: Layout, *worlds: ObstacleWorld) -> None:
        self._layout = layout
        self._worlds = worlds
        self._shown: dict[str, object] = {}

    def show(self, bins: Mapping[str, BinContent]) -> None:
        """Let the worlds hold exactly ``bins``."""
        shown: dict[str, object] = {}
        for station, content in bins.items():
            for block in bin_blocks(self._layout, station, content.spec):
                shown[block.name] = block
                if self._shown.get(block.name) != block:
                    for world in self._worlds:
                        world.set_block(block)
            frame = bin_frame(self._layout, station, content.spec)
            for box_id, (size, pose) in content.boxes.items():
                name = f'placed box {box_id}'
                shown[name] = (station, size, pose)
                if self._shown.get(name) != shown[name]:
                    for world in self._worlds:
                        world.set_box(name, size, frame.to_cell(pose))
        for name in self._shown.keys() - shown.keys():
            for world in self._worlds:
                world.remove(name)
        self._shown = shown

    def site(self, station: str, content: BinContent) -> Site:
        """The bin at ``station`` as the planner sees it."""
        frame = bin_frame(self._layout, station, content.spec)
        boxes = [
            StandingBox(box_id, *extent(frame.to_cell(pose), size))
            for box_id, (size, pose) in content.boxes.items()
        ]
        return Site(station, content.spec, frame, boxes)
