"""The packing algorithms, one file each. A new one is one file and one line here."""

from __future__ import annotations

from pack_planner.algorithms.base import Algorithm, Choice, PackRule, Problem
from pack_planner.algorithms.best_fit import best_fit
from pack_planner.algorithms.best_short_side_fit import best_short_side_fit
from pack_planner.algorithms.column_building import column_building
from pack_planner.algorithms.dbl import dbl
from pack_planner.algorithms.first_fit import first_fit
from pack_planner.algorithms.floor_building import floor_building
from pack_planner.algorithms.heightmap_min import heightmap_min
from pack_planner.algorithms.lsah import lsah
from pack_planner.algorithms.mpack import mpack
from pack_planner.algorithms.mpack_lite import mpack_lite
from pack_planner.algorithms.o_best_fit import o_best_fit
from pack_planner.algorithms.o_first_fit import o_first_fit
from pack_planner.algorithms.o_jampack import o_jampack
from pack_planner.algorithms.online_bph import online_bph
from pack_planner.algorithms.rollout import rollout
from pack_planner.algorithms.walle import walle

ALGORITHMS: dict[str, Algorithm] = {
    'mpack_lite': mpack_lite,
    'mpack': mpack,
    'rollout': rollout,
    'first_fit': first_fit,
    'best_fit': best_fit,
    'o_first_fit': o_first_fit,
    'o_best_fit': o_best_fit,
    'o_jampack': o_jampack,
    'dbl': dbl,
    'lsah': lsah,
    'heightmap_min': heightmap_min,
    'online_bph': online_bph,
    'walle': walle,
    'floor_building': floor_building,
    'column_building': column_building,
    'best_short_side_fit': best_short_side_fit,
}

#: Those that minimise eq. (1), and so can leave that to another backend.
WITH_BACKENDS = ('mpack_lite', 'mpack')


def find_algorithm(name: str) -> Algorithm:
    """The algorithm called ``name``; ``ValueError`` lists the known ones."""
    try:
        return ALGORITHMS[name]
    except KeyError:
        msg = f'unknown algorithm {name!r}: use one of {", ".join(ALGORITHMS)}'
        raise ValueError(msg) from None


__all__ = [
    'ALGORITHMS',
    'WITH_BACKENDS',
    'Algorithm',
    'Choice',
    'PackRule',
    'Problem',
    'find_algorithm',
]
