"""Parameters of the node `planner`."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pack_msgs_py.orientation import ORIENTATION_RULES
from pack_msgs_py.parameter_fields import parameter
from pack_msgs_py.profiles import PROFILES, adapted, find_profile
from pack_planner.algorithms import find_algorithm
from pack_planner.algorithms.base import BACKENDS
from pack_planner.algorithms.tuned_tables import check_table, read_table
from pack_planner.decision.options import (
    CLOSINGS,
    MOST_PASSED_OVER,
    SELECTIONS,
    SORTS,
    DecisionOptions,
)
from pack_planner.decision.policy import PolicySettings
from pack_planner.decision.weights import DEFAULT_WEIGHTS, parse_weights

#: A machine may be this much slower than nodes are counted before the clock ends a decision.
SLOWEST_MACHINE = 20


@dataclass(frozen=True)
class PlannerParameters:
    """See the description of each field."""

    algorithm: str = parameter(
        'mpack_lite',
        'packing algorithm, by its name or as `/where/it/is/FILE.py:FUNCTION`; may be changed '
        'between two boxes',
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
    size_sigmas: float = parameter(
        -1.0,
        'standard deviations of its measured size that are kept free around a box, like the '
        "executor; -1 for the profile's own",
        low=-1.0,
        high=10.0,
    )
    clearance_mm: float = parameter(
        -1.0,
        'air between two boxes, half of it to a wall, before sizes are rounded up, like the '
        "executor; -1 for the profile's own",
        unit='mm',
        low=-1.0,
        high=100.0,
    )
    resolution_mm: int = parameter(
        0,
        'grid to which x, y, lengths and breadths are rounded up, like the executor; '
        "0 for the profile's own",
        unit='mm',
        low=0,
        high=100,
    )
    max_payload_kg: float = parameter(
        0.0,
        "heaviest box, for an arm that lifts less than the profile allows; 0 for the profile's own",
        unit='kg',
        low=0.0,
        high=10_000.0,
        read_only=True,
    )
    look_ahead: int = parameter(
        5, 'boxes to choose from', unit='boxes', low=1, high=20, read_only=True
    )
    min_look_ahead: int = parameter(
        0,
        'decide at once when there are so many to choose from; 0: wait for the whole look-ahead',
        unit='boxes',
        low=0,
        high=20,
        read_only=True,
    )
    patience_s: float = parameter(
        3.0,
        'how long to wait for more boxes while there are some, but not enough',
        unit='s',
        low=0.0,
        high=3600.0,
        read_only=True,
    )
    weights: str = parameter(
        DEFAULT_WEIGHTS,
        'weights w1,w2,w3 of eq. (1), lengths in centimetres; for single kinds of bins as in '
        '`1,1,100 RC:2,1,100`; may be changed between two boxes, like all that follow',
    )
    tuned: str = parameter(
        '',
        'file of `cell tune` with the weights of the algorithm; empty for those that are shipped; '
        'a process reads a file once',
    )
    backend: str = parameter(
        'search',
        'who minimises eq. (1) for `mpack` and `mpack_lite`: our own search, or a solver of '
        'OR-Tools',
        choices=BACKENDS,
    )
    cep: bool = parameter(
        False,
        "the paper's constraints for efficient packing, for `mpack` and `mpack_lite`: each box "
        'touches a wall or a box along x, and one along y',
    )
    sort: str = parameter(
        'volume', 'in which order OPack packs the look-ahead virtually', choices=SORTS
    )
    selection: str = parameter(
        'auto',
        'which of the boxes that OPack or MPack could place is placed; `auto` is `least_growth` '
        "for `mpack` and `least_increase`, the paper's, for OPack",
        choices=SELECTIONS,
    )
    large_until: float = parameter(
        0.5,
        'fill rate of the bin until which `large_when_empty` takes the largest box, then the '
        'smallest',
        low=0.0,
        high=1.0,
    )
    closing: str = parameter('fullest', 'which bin is closed when nothing fits', choices=CLOSINGS)
    max_passed_over: int = parameter(
        40,
        'a box that another was preferred to so often must be next (no fewer than look-ahead - 1); '
        '0 for no limit',
        low=0,
        high=MOST_PASSED_OVER,
    )
    budget_s: float = parameter(
        5.0,
        'time for a decision; then the best one found is taken',
        unit='s',
        low=0.0,
        high=86_400.0,
    )
    node_limit: int = parameter(
        0,
        'search nodes for a decision, instead of time repeatable; 0 for no limit',
        low=0,
        high=10**12,
    )
    deadline_s: float = parameter(
        5.5,
        'time for a box: planning that no motion hid, plus motion',
        unit='s',
        low=0.1,
        high=86_400.0,
    )
    speed: float = parameter(
        1.0,
        'robot seconds per wall-clock second, like the executor; at 0, as fast as possible, what '
        'planning costs is counted by what was done instead of by the clock, and `budget_s` in '
        'nodes',
        low=0.0,
        high=1000.0,
        read_only=True,
    )
    candidates: int = parameter(
        12,
        'placements that the arm is asked about at a time, best first; 0 to send goals unasked',
        low=0,
        high=64,
    )
    check_timeout_s: float = parameter(
        1.0,
        'how long the arm may take to answer for each candidate while nothing moves; then the '
        'first choice is sent',
        unit='s',
        low=0.0,
        high=60.0,
    )
    frame_prefix: str = parameter(
        '',
        'Stands before the name of every frame on `/tf`, such as `north/`, where several cells '
        'share it; frames in the messages of the cell keep their names.',
        read_only=True,
    )


def counted_node_s(parameters: PlannerParameters) -> float | None:
    """What a node of the search counts, seconds; ``None`` where planning goes by the clock."""
    if parameters.speed > 0 or parameters.backend != 'search':
        return None
    return find_algorithm(parameters.algorithm).counted_node_s


def settings(parameters: PlannerParameters) -> PolicySettings:
    """How to decide under these parameters; ``ValueError`` says which of them cannot be."""
    profile = adapted(
        find_profile(parameters.profile),
        orientations=parameters.orientations,
        size_sigmas=parameters.size_sigmas,
        clearance_mm=parameters.clearance_mm,
        resolution_mm=parameters.resolution_mm,
    )
    if parameters.max_payload_kg:
        lift = min(parameters.max_payload_kg, profile.max_payload_kg or math.inf)
        profile = replace(profile, max_payload_kg=lift)
    options = DecisionOptions(
        parameters.cep,
        parameters.sort,
        parameters.selection,
        parameters.large_until,
        parameters.closing,
        parameters.max_passed_over,
    )
    algorithm = find_algorithm(parameters.algorithm)
    tuned = read_table(parameters.tuned) if parameters.tuned else None
    if tuned is not None:
        check_table(tuned, algorithm.name, algorithm.weights)
    budget_s, node_limit = parameters.budget_s, parameters.node_limit or None
    node_s = counted_node_s(parameters)
    if node_s:
        in_budget = max(1, round(budget_s / node_s))
        node_limit = in_budget if node_limit is None else min(node_limit, in_budget)
        budget_s *= SLOWEST_MACHINE
    return PolicySettings(
        parameters.algorithm,
        profile,
        parse_weights(parameters.weights),
        budget_s,
        node_limit,
        parameters.backend,
        options,
        tuned,
    )
