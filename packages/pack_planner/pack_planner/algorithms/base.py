"""What every packing algorithm is given and what it answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

from pack_msgs_py.codes import PlacementStatus
from pack_msgs_py.values import Box, PlacedBox
from pack_planner.algorithms.tuned_weights import TunedTable, W
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import Forbidden, nothing_forbidden

#: Who can minimise eq. (1).
BACKENDS = ('search', 'cp_sat', 'milp')


@dataclass
class Memory:
    """What one decision leaves for the next one on the same stream; never needed for the answer.

    ``plan`` holds the placements that the last joint solution meant for the other boxes, each with
    the id of its bin.
    """

    plan: tuple[tuple[str, PlacedBox], ...] = ()


@dataclass(frozen=True, eq=False)
class Problem:
    """One decision: which of these boxes goes where.

    Attributes
    ----------
    engine : search and rules.
    boxes : the look-ahead in the order of the belt, nearest first.
    bins : the open bins, oldest first.
    forbidden : placements that the arm refused.
    budget_s : seconds after which the best answer so far is due.
    node_limit : search nodes after which it is due; with no time budget in reach the same problem
        then always has the same answer. ``None`` for no limit.
    memory : what the algorithm may keep from one decision to the next; see :class:`Memory`.
    backend : who minimises eq. (1) for `mpack` and `mpack_lite`, one of :data:`BACKENDS`; the
        optimum is the same. `search` is ours and the only one that ``node_limit`` bounds; the
        others are OR-Tools' CP-SAT, and SCIP on the MILP of Ojha et al., section III-A.
    cep, sort, selection, large_until : see :class:`pack_planner.decision.options.DecisionOptions`.
    tuned : weights of a file that the user named; ``None`` for those that are shipped.
    weights : those that the algorithm is to use, of ``tuned`` or shipped, as
        :func:`pack_planner.algorithms.tuned_tables.weights_for` says; whoever calls the algorithm
        by its :class:`AlgorithmSpec` need not set it.
    """

    engine: Engine
    boxes: tuple[Box, ...]
    bins: tuple[BinModel, ...]
    forbidden: Forbidden = nothing_forbidden
    budget_s: float = 5.0
    node_limit: int | None = None
    memory: Memory | None = None
    backend: str = 'search'
    cep: bool = False
    sort: str = 'volume'
    selection: str = 'auto'
    large_until: float = 0.5
    tuned: TunedTable | None = None
    weights: object = None

    def __post_init__(self) -> None:
        if self.backend not in BACKENDS:
            msg = f'unknown backend {self.backend!r}: use one of {", ".join(BACKENDS)}'
            raise ValueError(msg)

    def weights_or(self, default: W) -> W:
        """``weights``, of the same type as ``default``, which holds where there are none."""
        return default if self.weights is None else cast('W', self.weights)


@dataclass(frozen=True)
class Choice:
    """The answer: one placement, and how sure the algorithm is of it.

    ``reason`` says for people why this box. ``others`` are what it would choose instead, best
    first, as far as it knows without deciding anew. ``gap`` is how far the objective may at most
    lie above the optimum, relative to it; 0 when it is proven, infinite when nothing is known.
    ``nodes`` is how many it took of the search, see :attr:`Problem.node_limit`.
    """

    candidate: Candidate
    status: PlacementStatus = PlacementStatus.OPTIMAL
    reason: str = ''
    gap: float = 0.0
    others: tuple[Candidate, ...] = ()
    nodes: int = 0


#: Chooses a placement; ``None`` when no box of the look-ahead fits into any open bin.
Algorithm = Callable[[Problem], 'Choice | None']

#: Where one box goes in the given bins (PACKRULE of Ojha et al., section III-B).
PackRule = Callable[[Engine, Box, Sequence[BinModel], Forbidden], 'Candidate | None']
