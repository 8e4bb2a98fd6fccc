"""Parameters of the node `planner`."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pack_msgs_py.orientation import ORIENTATION_RULES
from pack_msgs_py.parameters import parameter
from pack_msgs_py.profiles import PROFILES, find_profile
from pack_planner.algorithms import ALGORITHMS
from pack_planner.algorithms.base import BACKENDS
from pack_planner.decide import Settings
from pack_planner.engine import Weights


@dataclass(frozen=True)
class PlannerParameters:
    """See the description of each field."""

    algorithm: str = parameter(
        'mpack_lite',
        'packing algorithm; may be changed between two boxes',
        choices=tuple(ALGORITHMS),
    )
    profile: str = parameter(
        'cell',
        'packing rules; may be changed between two boxes, like those of the executor',
        choices=tuple(PROFILES),
    )
    orientations: str = parameter(
        '',
        "orientation rule instead of the profile's own; empty keeps that one",
        choices=('', *ORIENTATION_RULES),
    )
    look_ahead: int = parameter(
        5, 'boxes to choose from', unit='boxes', low=1, high=20, read_only=True
    )
    w1: float = parameter(1.0, 'weight of x + y in eq. (1), per centimetre', low=0.0)
    w2: float = parameter(1.0, 'weight of z + dz in eq. (1), per centimetre', low=0.0)
    w3: float = parameter(100.0, "weight of the bin's index in eq. (1), oldest bin 1", low=0.0)
    backend: str = parameter(
        'search',
        'who minimises eq. (1) for `mpack` and `mpack_lite`: our own search, or a solver of '
        'OR-Tools; may be changed between two boxes',
        choices=BACKENDS,
    )
    budget_s: float = parameter(
        5.0, 'time for a decision; then the best one found is taken', unit='s', low=0.0
    )
    node_limit: int = parameter(
        0, 'search nodes for a decision, instead of time repeatable; 0 for no limit', low=0
    )
    deadline_s: float = parameter(
        5.5, 'time for a box: planning that no motion hid, plus motion', unit='s', low=0.1
    )


def settings(parameters: PlannerParameters) -> Settings:
    """How to decide under these parameters."""
    profile = find_profile(parameters.profile)
    if parameters.orientations:
        profile = replace(profile, orientations=parameters.orientations)
    return Settings(
        parameters.algorithm,
        profile,
        Weights(parameters.w1, parameters.w2, parameters.w3),
        parameters.budget_s,
        parameters.node_limit or None,
        parameters.backend,
    )
