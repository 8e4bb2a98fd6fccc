"""Decides which box goes where: a library of packing algorithms, and the node `planner`.

``from pack_planner import Box, pack`` is where to begin; docs/algorithms.md goes on from there.
What a name needs is imported when it is first used.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pack_planner.lazy import lazy_names
from pack_planner.machine_code import keep_apart

if TYPE_CHECKING:
    from pack_msgs_py.metrics import fill_metrics
    from pack_msgs_py.profiles import PROFILES, Profile, find_profile
    from pack_msgs_py.rules import Violation
    from pack_msgs_py.validator import validate_bins, validate_sequence
    from pack_msgs_py.values import BIN_TYPES, Bin, BinSpec, Box, PlacedBox, parse_bin
    from pack_planner.algorithms.base import Choice, Problem
    from pack_planner.algorithms.opack import opack
    from pack_planner.algorithms.ranking import nearest_box, ranked
    from pack_planner.algorithms.registry import (
        AlgorithmError,
        algorithm,
        algorithm_names,
        find_algorithm,
    )
    from pack_planner.decision.options import DecisionOptions
    from pack_planner.engine.engine import Candidate, Engine, EngineMismatch, Weights
    from pack_planner.engine.placements import Spots, all_spots, spots_at
    from pack_planner.engine.points import corner_points, extreme_points
    from pack_planner.packing.arrays import PlacementArrays, placement_arrays
    from pack_planner.packing.drawing import draw_bin
    from pack_planner.packing.loop import PackedBox
    from pack_planner.packing.pack import Packing, PackingFigures, pack

_MODULES = {
    'pack_msgs_py.metrics': ('fill_metrics',),
    'pack_msgs_py.profiles': ('PROFILES', 'Profile', 'find_profile'),
    'pack_msgs_py.rules': ('Violation',),
    'pack_msgs_py.validator': ('validate_bins', 'validate_sequence'),
    'pack_msgs_py.values': ('BIN_TYPES', 'Bin', 'BinSpec', 'Box', 'PlacedBox', 'parse_bin'),
    'pack_planner.algorithms.base': ('Choice', 'Problem'),
    'pack_planner.algorithms.opack': ('opack',),
    'pack_planner.algorithms.ranking': ('nearest_box', 'ranked'),
    'pack_planner.algorithms.registry': (
        'AlgorithmError',
        'algorithm',
        'algorithm_names',
        'find_algorithm',
    ),
    'pack_planner.decision.options': ('DecisionOptions',),
    'pack_planner.engine.engine': ('Candidate', 'Engine', 'EngineMismatch', 'Weights'),
    'pack_planner.engine.placements': ('Spots', 'all_spots', 'spots_at'),
    'pack_planner.engine.points': ('corner_points', 'extreme_points'),
    'pack_planner.packing.arrays': ('PlacementArrays', 'placement_arrays'),
    'pack_planner.packing.drawing': ('draw_bin',),
    'pack_planner.packing.loop': ('PackedBox',),
    'pack_planner.packing.pack': ('Packing', 'PackingFigures', 'pack'),
}

__all__ = [
    'BIN_TYPES',
    'PROFILES',
    'AlgorithmError',
    'Bin',
    'BinSpec',
    'Box',
    'Candidate',
    'Choice',
    'DecisionOptions',
    'Engine',
    'EngineMismatch',
    'PackedBox',
    'Packing',
    'PackingFigures',
    'PlacedBox',
    'PlacementArrays',
    'Problem',
    'Profile',
    'Spots',
    'Violation',
    'Weights',
    'algorithm',
    'algorithm_names',
    'all_spots',
    'corner_points',
    'draw_bin',
    'extreme_points',
    'fill_metrics',
    'find_algorithm',
    'find_profile',
    'nearest_box',
    'opack',
    'pack',
    'parse_bin',
    'placement_arrays',
    'ranked',
    'spots_at',
    'validate_bins',
    'validate_sequence',
]

keep_apart(Path(__file__).parent)
__getattr__ = lazy_names(__name__, _MODULES)
