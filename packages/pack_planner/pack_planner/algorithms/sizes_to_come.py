"""Sizes that boxes to come may have, and for how much of them a bin still has room."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.profiles import Profile
from pack_msgs_py.values import Box
from pack_planner.algorithms.base import Problem
from pack_planner.engine import BinModel
from pack_planner.engine.height_map import GRAVITY
from pack_planner.engine.room_left import has_room
from pack_planner.engine.turns import support_rule, turns_of

#: How many of the boxes in the open bins count, beside those of the look-ahead.
_REMEMBERED = 24


def known_boxes(problem: Problem) -> list[Box]:
    """What can be said of the boxes to come: those that came are like them."""
    placed = [each.box for model in problem.bins for each in model.source.boxes]
    return [*placed, *problem.boxes]


class SizesToCome:
    """A sample of the sizes that boxes to come may have.

    These are the boxes of the look-ahead, those that came last into each open bin, and mixtures of
    them: the length of one, the breadth of another and the height of a third. So a few known boxes
    stand for all that a stream may bring.

    Parameters
    ----------
    problem : has the known boxes.
    mixed : mixtures for each known box.
    """

    def __init__(self, problem: Problem, mixed: int) -> None:
        self._profile = problem.engine.profile
        share = -(-_REMEMBERED // len(problem.bins))
        latest = [
            each.box for model in problem.bins for each in model.source.boxes[-share:]
        ]  # fmt: skip
        self._fill((*latest, *problem.boxes), mixed)

    def _fill(self, known: tuple[Box, ...], mixed: int) -> None:
        turns = [_rows(box, self._profile) for box in known]
        density = sum(box.weight_kg for box in known) / sum(box.volume_mm3 for box in known)
        rows = [row for own in turns for row in own.values()]
        counts = [len(own) for own in turns]
        volumes = [box.volume_mm3 for box in known]
        weights = [box.weight_kg for box in known]
        for shift in range(1, mixed + 1):
            for number in range(len(known)):
                others = [(number + times * shift) % len(known) for times in range(3)]
                one, two, three = (turns[other] for other in others)
                common = [turn for turn in one if turn in two and turn in three]
                rows += [_mixed(one[turn], two[turn], three[turn]) for turn in common]
                counts.append(len(common))
                edges = (known[other].size_mm[axis] for axis, other in enumerate(others))
                volumes.append(float(np.prod(list(edges))))
                weights.append(density * volumes[-1])
        table = np.array(rows).reshape(-1, 9)
        starts = np.cumsum([0, *counts])
        self._sample = (
            table[:, :3].astype(np.int64), table[:, 3:5].copy(), table[:, 5:].copy(), starts,
            np.array(weights) * GRAVITY,
        )  # fmt: skip
        self._volumes = np.array(volumes)

    def without_room(self, model: BinModel) -> float:
        """For which share of the sample ``model`` has no place any more, by volume, 0 to 1."""
        if model.blocked:
            return 1.0
        fits: NDArray[np.bool_] = has_room(
            model.source.spec.size_mm, *model.arrays(), support_rule(self._profile),
            self._profile.min_vertices, *self._sample,
        )  # fmt: skip
        return float(self._volumes[~fits].sum() / self._volumes.sum())

    def boxes_to_fill(self, model: BinModel) -> float:
        """How many boxes of the mean volume of the sample have the volume of the bin."""
        return float(model.source.spec.volume_mm3 / self._volumes.mean())


#: Planned size, offset of the centre of mass along x and y, and what is surely covered.
_Row = tuple[float, ...]


def _rows(box: Box, profile: Profile) -> dict[int, _Row]:
    """What the search reads of each turn of ``box``, by the number of the orientation."""
    turns = turns_of(box, profile)
    table = np.hstack((turns.sizes, turns.centres, turns.sures)).tolist()
    return {
        number: tuple(row) for number, row in zip(turns.numbers.tolist(), table, strict=True)
    }  # fmt: skip


def _mixed(one: _Row, two: _Row, three: _Row) -> _Row:
    """As long as the first, as broad as the second, as high as the third, along the bin's axes."""
    return (one[0], two[1], three[2], 0.0, 0.0, one[5], two[6], one[7], two[8])
