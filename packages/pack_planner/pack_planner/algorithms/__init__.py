"""The packing algorithms, one file each; a new one is one file and one line in `built_in`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pack_planner.algorithms.built_in import BUILT_IN
from pack_planner.lazy import lazy_names

if TYPE_CHECKING:
    from pack_planner.algorithms.base import Algorithm, Choice, PackRule, Problem
    from pack_planner.algorithms.registry import (
        AlgorithmError,
        AlgorithmSpec,
        algorithm,
        algorithm_names,
        find_algorithm,
    )

__all__ = [
    'BUILT_IN',
    'Algorithm',
    'AlgorithmError',
    'AlgorithmSpec',
    'Choice',
    'PackRule',
    'Problem',
    'algorithm',
    'algorithm_names',
    'find_algorithm',
]

__getattr__ = lazy_names(
    __name__,
    {
        'pack_planner.algorithms.base': ('Algorithm', 'Choice', 'PackRule', 'Problem'),
        'pack_planner.algorithms.registry': (
            'AlgorithmError', 'AlgorithmSpec', 'algorithm', 'algorithm_names', 'find_algorithm',
        ),
    },
)  # fmt: skip
