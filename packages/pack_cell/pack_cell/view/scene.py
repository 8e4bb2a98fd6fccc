"""The cell as boxes to draw, in few batches. Frame `cell`, metres, quaternions x y z w."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.colours import BELT, PALLET, STEEL, WALL, Colour, carton
from arm_executor.model.layout import (
    BinFrame,
    Layout,
    bin_blocks,
    bin_frame,
    rail_block,
)
from pack_cell.view.cell_view import CellView
from pack_msgs_py.geometry.pose import NO_TURN, Pose, Quaternion, metres, rotation_matrix
from pack_msgs_py.orientation import oriented_size
from pack_msgs_py.values import Bin, PlacedBox, Vec3

Array = NDArray[np.float64]
#: The box that came last, and the one that comes next.
LAST: Colour = (0.10, 0.55, 0.95, 1.0)
NEXT: Colour = (0.98, 0.62, 0.10, 1.0)
#: Thickness of a strand of the belt, metres.
_STRAND = 0.05
#: Corners of the unit cube, and which of them its edges join.
_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_EDGES = np.array([[a, b] for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count('1') == 1])


@dataclass(frozen=True)
class Batch:
    """Boxes that are drawn at once.

    Attributes
    ----------
    centres, sizes : (n, 3).
    turns : (n, 4), quaternions x y z w.
    colours : (n, 3), 0 to 1.
    """

    centres: Array
    sizes: Array
    turns: Array
    colours: Array

    def __len__(self) -> int:
        return len(self.centres)

    def is_same(self, other: Batch) -> bool:
        """Whether nothing differs that can be seen."""
        return all(
            np.array_equal(getattr(self, part.name), getattr(other, part.name))
            for part in fields(self)
        )

    def edges(self) -> Array:
        """Both ends of the twelve edges of each box, (12 n, 2, 3)."""
        if not len(self):
            return np.empty((0, 2, 3))
        turns = np.array([rotation_matrix(_quaternion(turn)) for turn in self.turns])
        corners = np.einsum('nij,nkj->nki', turns, _CORNERS * self.sizes[:, None, :])
        corners += self.centres[:, None, :]
        ends: Array = corners[:, _EDGES].reshape(-1, 2, 3)
        return ends


@dataclass(frozen=True)
class SceneLabel:
    """A word at a point of the scene."""

    key: str
    text: str
    position: Vec3


@dataclass(frozen=True)
class DrawnCell:
    """Everything but the arm.

    ``placed`` are the boxes in bins, ``waiting`` those on the belt, ``ghosts`` where the next ones
    go, ``walls`` what can be seen through, ``solid`` floors, belt and rail.
    """

    placed: Batch
    waiting: Batch
    ghosts: Batch
    walls: Batch
    solid: Batch
    labels: tuple[SceneLabel, ...]


_Cube = tuple[Vec3, Vec3, Quaternion, Colour]


def drawn_cell(view: CellView, layout: Layout) -> DrawnCell:
    """The cell as ``view`` knows it, standing as ``layout`` says."""
    frames = {found.id: bin_frame(layout, found.station, found.spec) for found in view.bins}
    held = '' if view.held is None else view.held.box.id
    planned = {decision.box.id for decision in view.planned}
    waiting, labels = list[_Cube](), list[SceneLabel]()
    for number, scanned in enumerate(() if view.scan is None else view.scan.boxes, start=1):
        if scanned.box.id == held:
            continue
        size, pose = metres(scanned.box.size_mm), scanned.pose
        colour = NEXT if scanned.box.id in planned else carton(scanned.box.id)
        waiting.append((pose.position, size, pose.quaternion, colour))
        laps = f' · {scanned.laps} {"lap" if scanned.laps == 1 else "laps"}' if scanned.laps else ''
        x, y, z = pose.position
        labels.append(SceneLabel(f'belt/{number}', f'{number}{laps}', (x, y, z + max(size) / 2)))
    for standing in view.bins:
        labels.append(_bin_label(standing, frames[standing.id]))
    return DrawnCell(
        placed=_batch(
            _placed(placed, frames[standing.id], last=placed.box.id == view.last_placed)
            for standing in view.bins
            for placed in standing.boxes
        ),
        waiting=_batch(waiting),
        ghosts=_batch(
            _ghost(decision.target, decision.box.size_mm, frames[decision.bin_id])
            for decision in view.planned
            if decision.bin_id in frames and not _is_in(view.bins, decision.box.id)
        ),
        walls=_batch(_walls(view.bins, layout)),
        solid=_batch(_solid(view, layout)),
        labels=tuple(labels),
    )


def bin_middle(standing: Bin, layout: Layout) -> Vec3:
    """Middle of a bin, to look at."""
    half = metres(standing.spec.size_mm)
    frame = bin_frame(layout, standing.station, standing.spec)
    return frame.to_cell(Pose((half[0] / 2, half[1] / 2, half[2] / 2))).position


def _is_in(bins: Sequence[Bin], box_id: str) -> bool:
    return any(placed.box.id == box_id for standing in bins for placed in standing.boxes)


def _bin_label(standing: Bin, frame: BinFrame) -> SceneLabel:
    length, breadth, height = metres(standing.spec.size_mm)
    over = frame.to_cell(Pose((length / 2, breadth / 2, height + 0.12))).position
    goes_to = f' · {standing.destination}' if standing.destination else ''
    text = f'{standing.id}{goes_to} · {100 * standing.fill_rate:.0f} %'
    return SceneLabel(f'bin/{standing.station}', text, over)


def _placed(placed: PlacedBox, frame: BinFrame, *, last: bool) -> _Cube:
    """A box where it was measured, or else planned to lie, along the axes of its bin."""
    size = oriented_size(placed.box.size_mm, placed.orientation)
    (x, y, z), (dx, dy, _) = placed.corner_mm, placed.size_mm
    centre = placed.measured_mm or (x + dx / 2, y + dy / 2, z + size[2] / 2)
    pose = frame.to_cell(Pose(metres(centre)))
    return pose.position, metres(size), pose.quaternion, LAST if last else carton(placed.box.id)


def _ghost(target: Pose, size_mm: Vec3, frame: BinFrame) -> _Cube:
    pose = frame.to_cell(target)
    return pose.position, metres(size_mm), pose.quaternion, NEXT


def _walls(bins: Sequence[Bin], layout: Layout) -> Iterable[_Cube]:
    for standing in bins:
        for block in bin_blocks(layout, standing.station, standing.spec):
            if not block.name.endswith('floor'):
                yield block.centre, block.size, NO_TURN, WALL


def _solid(view: CellView, layout: Layout) -> Iterable[_Cube]:
    rail = rail_block(layout)
    yield rail.centre, rail.size, NO_TURN, STEEL
    yield from _belt(view, layout)
    for standing in view.bins:
        for block in bin_blocks(layout, standing.station, standing.spec):
            if block.name.endswith('floor'):
                yield block.centre, block.size, NO_TURN, PALLET


def _belt(view: CellView, layout: Layout) -> Iterable[_Cube]:
    """The strands of the belt as far as boxes ride on them, and its legs."""
    belt = layout.conveyor
    end = max(belt.front_y + belt.length, view.belt_end_m)
    middle, length = (belt.front_y + end) / 2, end - belt.front_y
    strands = [belt.top_z]
    if view.belt_low_m < belt.top_z - 0.2:
        strands.append(view.belt_low_m)
    for top in strands:
        size = (belt.width, length, _STRAND)
        yield (0.0, middle, top - _STRAND / 2), size, NO_TURN, BELT
    height = belt.top_z - _STRAND
    for x in (-belt.width / 2, belt.width / 2):
        for y in (belt.front_y + 0.1, end - 0.1):
            yield (x, y, height / 2), (0.05, 0.05, height), NO_TURN, STEEL


def _batch(cubes: Iterable[_Cube]) -> Batch:
    rows = list(cubes)
    return Batch(
        centres=np.array([row[0] for row in rows], dtype=float).reshape(-1, 3),
        sizes=np.array([row[1] for row in rows], dtype=float).reshape(-1, 3),
        turns=np.array([row[2] for row in rows], dtype=float).reshape(-1, 4),
        colours=np.array([row[3][:3] for row in rows], dtype=float).reshape(-1, 3),
    )


def _quaternion(row: Array) -> Quaternion:
    x, y, z, w = row.tolist()
    return (x, y, z, w)
