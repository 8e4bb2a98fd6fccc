"""The packing algorithms, one file each. A new one is one file and one line here."""

from __future__ import annotations

from pack_planner.algorithms.base import Algorithm, Choice, PackRule, Problem
from pack_planner.algorithms.mpack_lite import mpack_lite

ALGORITHMS: dict[str, Algorithm] = {
    'mpack_lite': mpack_lite,
}


def find_algorithm(name: str) -> Algorithm:
    """The algorithm called ``name``; ``ValueError`` lists the known ones."""
    try:
        return ALGORITHMS[name]
    except KeyError:
        msg = f'unknown algorithm {name!r}: use one of {", ".join(ALGORITHMS)}'
        raise ValueError(msg) from None


__all__ = ['ALGORITHMS', 'Algorithm', 'Choice', 'PackRule', 'Problem', 'find_algorithm']
