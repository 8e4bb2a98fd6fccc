"""What the benchmark is asked to do, and what comes of one collection of boxes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from pack_msgs_py.profiles import Profile
from pack_msgs_py.values import BinSpec, Box
from pack_planner.algorithms.tuned_weights import TunedTable
from pack_planner.decision.options import DecisionOptions
from pack_planner.decision.weights import WeightTable

#: Records and plan lines are JSON objects.
JsonObject = dict[str, Any]


@dataclass(frozen=True)
class CollectionSource:
    """Where the boxes of the collections come from.

    Attributes
    ----------
    name : for people and for records.
    boxes : boxes of a file; empty for SYN, which is cut from bins.
    in_order : each collection is all of ``boxes``, as listed or shuffled; otherwise boxes are
        drawn with replacement.
    shuffle : seed of the order, ``None`` as listed.
    rejected : id and reason of each row of the file that is no box.
    digest : changes with the content.
    """

    name: str
    boxes: tuple[Box, ...] = ()
    in_order: bool = False
    shuffle: int | None = None
    rejected: tuple[tuple[str, str], ...] = ()
    digest: str = ''


@dataclass(frozen=True)
class Case:
    """One record of the benchmark: an algorithm on one kind of bin with one look-ahead.

    ``algorithm`` is a name, or ``/where/it/is/FILE.py:FUNCTION`` with the ``digest`` of that file;
    ``backend`` is who minimises for it, where the algorithm leaves that open; ``cep`` whether the
    constraints for efficient packing hold, in place of the settings' own.
    """

    algorithm: str
    bin_spec: BinSpec
    look_ahead: int
    collections: int
    source: CollectionSource
    backend: str = 'search'
    cep: bool = False
    digest: str = ''


@dataclass(frozen=True)
class BenchSettings:
    """What holds for all cases.

    Attributes
    ----------
    profile : the packing rules.
    weights : of eq. (1), for each kind of bin.
    options : see :class:`pack_planner.decision.options.DecisionOptions`.
    open_bins : bins that stand open at a time.
    destinations : each box has one of so many, each bin takes boxes of one; 0 for one pool.
    boxes_per_bin : into how many boxes a SYN bin is cut.
    seed : of the collections.
    budget_s : seconds that a decision may take.
    node_limit : search nodes that a decision may take, ``None`` for no limit.
    cpu_clock : measure the computing time of the deciding thread instead of elapsed time.
    tuned : weights of the algorithms that have some for these; ``None`` for the shipped ones.
    scan_sigma_mm : standard deviation of each edge that the scanner measures.
    """

    profile: Profile
    weights: WeightTable = field(default_factory=WeightTable)
    options: DecisionOptions = field(default_factory=DecisionOptions)
    open_bins: int = 3
    destinations: int = 0
    boxes_per_bin: int = 23
    seed: int = 1
    budget_s: float = 5.0
    node_limit: int | None = None
    cpu_clock: bool = False
    tuned: TunedTable | None = None
    scan_sigma_mm: float = 0.0


@dataclass(frozen=True)
class Packed:
    """What came of one collection.

    Attributes
    ----------
    boxes : boxes in the collection.
    events : lines of the plan, without the names of the case.
    unplaced : id and reason of each box that fits no empty bin or is none.
    fills : ``fill_closed``, ``fill_all``, ``fill_first_failure`` in percent.
    closed_bins : how many were closed.
    gaps : proven gap of each placement, infinite where nothing is known.
    """

    boxes: int
    events: tuple[JsonObject, ...]
    unplaced: tuple[JsonObject, ...]
    fills: dict[str, float | None]
    closed_bins: int
    gaps: tuple[float, ...]
