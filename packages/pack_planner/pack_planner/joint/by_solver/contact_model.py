"""The constraints for efficient packing (Ojha et al., eqs. (4) and (5)) as linear constraints.

As printed, (5) sums over all boxes of the look-ahead and so allows one contact along each axis for
all of them together; read box by box, as the text around it says, each box touches something along
x and something along y. That reading is :mod:`pack_planner.engine.contact`'s, stated here once more
with variables: one for each wall or box that a box may touch along an axis (d of the paper).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pack_msgs_py.values import Box, Int3, PlacedBox
from pack_planner.engine import BinModel
from pack_planner.joint.by_solver.formulation import Formulation


@dataclass
class BoxVariables:
    """Variables of one box: where it starts and ends, its orientation and its bin.

    x and y count in grid cells, z in millimetres.
    """

    box: Box
    low: tuple[int, int, int]
    high: tuple[int, int, int]
    turns: dict[str, int]
    bins: dict[int, int]
    sizes: dict[str, Int3]


def demand_contact(
    f: Formulation, own: BoxVariables, boxes: Sequence[BoxVariables], bins: Sequence[BinModel],
    step: int,
) -> None:  # fmt: skip
    """Ask ``own`` to touch a wall, a placed box or another of ``boxes`` along x, and along y."""
    for axis in (0, 1):
        ways: list[int] = []
        for j, inside in own.bins.items():
            source = bins[j].source
            for at_far_wall in (False, True):
                way = f.boolean()
                f.at_most([(1, way), (-1, inside)], 0)
                if at_far_wall:
                    f.at_least([(1, own.high[axis])], source.spec.size_mm[axis] // step, way)
                else:
                    f.at_most([(1, own.low[axis])], 0, way)
                ways.append(way)
            for placed in source.boxes:
                ways += _beside_placed(f, own, placed, axis, inside, step)
        for other in boxes:
            if other is not own:
                ways += _beside_other(f, own, other, axis)
        f.one_of(ways)


def _beside_placed(
    f: Formulation, own: BoxVariables, placed: PlacedBox, axis: int, inside: int, step: int
) -> list[int]:
    corner, far = placed.corner_mm, placed.far_mm
    ways = [f.boolean(), f.boolean()]
    f.equal([(1, own.low[axis])], -(-far[axis] // step), ways[0])
    f.equal([(1, own.high[axis])], corner[axis] // step, ways[1])
    for way in ways:
        f.at_most([(1, way), (-1, inside)], 0)
    return ways


def _beside_other(f: Formulation, own: BoxVariables, other: BoxVariables, axis: int) -> list[int]:
    ways = [f.boolean(), f.boolean()]
    f.equal([(1, own.low[axis]), (-1, other.high[axis])], 0, ways[0])
    f.equal([(1, own.high[axis]), (-1, other.low[axis])], 0, ways[1])
    for way in ways:
        for j, v in own.bins.items():
            if j in other.bins:
                f.at_most([(1, v), (-1, other.bins[j])], 0, way)
            else:
                f.at_most([(1, v)], 0, way)
    return ways
