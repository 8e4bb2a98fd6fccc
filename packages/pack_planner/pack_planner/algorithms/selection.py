"""Box selection: which of the boxes that could be placed is placed (Ojha et al., III-A.3)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pack_msgs_py.values import PlacedBox
from pack_planner.algorithms.base import Problem
from pack_planner.engine import Candidate

#: What to minimise; equal candidates stay in the order they are given in.
Key = Callable[[Candidate], tuple[float, ...]]


def selection_rule(problem: Problem, own: str) -> str:
    """The name of the rule ``problem.selection``; ``auto`` is ``own``, that of the algorithm."""
    return own if problem.selection == 'auto' else problem.selection


def selection_key(problem: Problem, rule: str) -> Key:
    """The rule called ``rule`` as a key.

    ``least_increase`` : least w1 (x + y) + w2 (z + dz), the paper's rule.
    ``least_growth`` : the same sentence read another way, least increase of w1 (x + y) + w2 top of
    all that is in the bin, each the most of any box there; of equal ones the largest box.
    ``large_when_empty`` : in the oldest bin that any box goes to, the largest box while the bin's
    fill rate is below ``problem.large_until``, from then on the smallest (the paper's footnote).
    ``largest`` : the box of largest volume.
    ``nearest`` : the box that comes first on the belt.

    Equal ones of all but ``nearest`` go by least increase at last.
    """
    increase = problem.engine.increase
    order = {box.id: index for index, box in enumerate(problem.boxes)}

    def least_increase(candidate: Candidate) -> tuple[float, ...]:
        return (increase(candidate.placed),)

    def least_growth(candidate: Candidate) -> tuple[float, ...]:
        weights, before = (
            problem.engine.weights,
            _most(problem.bins[candidate.bin_index].source.boxes),
        )
        after = (*candidate.placed.corner_mm[:2], candidate.placed.top_mm)
        x, y, top = (max(0, b - a) for a, b in zip(before, after, strict=True))
        growth = weights.position * (x + y) + weights.height * top
        return (growth, *largest(candidate))

    def large_when_empty(candidate: Candidate) -> tuple[float, ...]:
        volume, index = candidate.placed.box.volume_mm3, candidate.bin_index
        low = problem.bins[index].source.fill_rate < problem.large_until
        return (index, -volume if low else volume, increase(candidate.placed))

    def largest(candidate: Candidate) -> tuple[float, ...]:
        return (-candidate.placed.box.volume_mm3, increase(candidate.placed))

    def nearest(candidate: Candidate) -> tuple[float, ...]:
        return (order[candidate.placed.box.id],)

    rules: dict[str, Key] = {
        'least_increase': least_increase,
        'least_growth': least_growth,
        'large_when_empty': large_when_empty,
        'largest': largest,
        'nearest': nearest,
    }
    return rules[rule]


def _most(boxes: Sequence[PlacedBox]) -> tuple[int, ...]:
    """The largest x, y and top of placed boxes, millimetres."""
    reached = [(*placed.corner_mm[:2], placed.top_mm) for placed in boxes]
    return tuple(max(values) for values in zip((0, 0, 0), *reached, strict=True))
