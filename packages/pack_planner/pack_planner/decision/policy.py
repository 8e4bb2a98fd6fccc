"""What to do next with the boxes on offer and the open bins; node and benchmark share it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from pack_msgs_py.profiles import Profile
from pack_msgs_py.rules import may_enter
from pack_msgs_py.values import Bin, Box
from pack_planner.algorithms import Algorithm, AlgorithmSpec, Choice, Problem, find_algorithm
from pack_planner.algorithms.base import Memory
from pack_planner.algorithms.tuned_weights import TunedTable
from pack_planner.decision.bin_closing import bin_to_close
from pack_planner.decision.options import DecisionOptions
from pack_planner.decision.refusals import Forbidden
from pack_planner.decision.weights import WeightTable
from pack_planner.engine import Engine, EngineMismatch


@dataclass(frozen=True)
class PolicySettings:
    """How to decide: algorithm, rules, weights, what it may cost, and :class:`DecisionOptions`.

    ``algorithm`` is what :func:`pack_planner.algorithms.find_algorithm` takes; ``weights`` are
    those of eq. (1), ``tuned`` those of the algorithm where they are not the shipped ones.
    """

    algorithm: str | Algorithm
    profile: Profile
    weights: WeightTable = field(default_factory=WeightTable)
    budget_s: float = 5.0
    node_limit: int | None = None
    backend: str = 'search'
    options: DecisionOptions = field(default_factory=DecisionOptions)
    tuned: TunedTable | None = None

    @property
    def spec(self) -> AlgorithmSpec:
        """The algorithm; ``ValueError`` when there is none of that name."""
        return find_algorithm(self.algorithm)


@dataclass(frozen=True)
class DecisionState:
    """What a decision rests on.

    Attributes
    ----------
    boxes : the look-ahead in the order of the belt, nearest first.
    bins : the open bins, oldest first.
    forbidden : placements that the arm refused.
    passed_over : for each of ``boxes``, how often another one was taken while it was on offer;
        empty when nobody counts.
    """

    boxes: tuple[Box, ...]
    bins: tuple[Bin, ...]
    forbidden: Forbidden = field(default_factory=Forbidden)
    passed_over: tuple[int, ...] = ()


def next_step(
    settings: PolicySettings, engine: Engine, state: DecisionState, memory: Memory | None = None
) -> Choice | Bin | None:
    """The placement to make, else the bin to close, else ``None``: every bin is empty.

    Boxes that no open bin serves wait, without blocking the others, until a bin is closed; one is
    closed for them when they have been passed over as often as they may. Of the others, those that
    have been passed over as often as they may are the only ones on offer; see
    :func:`due`. When no bin could be closed, a box is placed without constraints for efficient
    packing rather than not at all.
    """
    options = settings.options
    served = _served(state)
    overdue = _overdue(state, options.max_passed_over)
    if overdue or not served.boxes:
        return bin_to_close(options.closing, engine, overdue or state.boxes, state.bins)
    boxes = due(served.boxes, served.passed_over, options.max_passed_over)
    models = tuple(engine.model(target) for target in state.bins)

    def choose(*, cep: bool) -> Choice | None:
        return settings.spec(
            Problem(
                engine, boxes, models, state.forbidden, settings.budget_s, settings.node_limit,
                memory, settings.backend, cep, options.sort, options.selection,
                options.large_until, settings.tuned,
            )
        )  # fmt: skip

    choice = choose(cep=options.cep)
    if choice is not None:
        return choice
    closing = bin_to_close(options.closing, engine, boxes, state.bins)
    if closing is None and options.cep:
        return choose(cep=False)
    return closing


def check_choice(
    settings: PolicySettings, engine: Engine, state: DecisionState, choice: Choice
) -> None:
    """Hold a choice against the packing rules once more.

    Raises
    ------
    EngineMismatch
        It breaks a rule, or is about a box or a bin that was not on offer. From a built-in
        algorithm that is a defect of this package.
    """
    candidate = choice.candidate
    box, index = candidate.placed.box, candidate.bin_index
    if box not in state.boxes:
        broken = f'box {box.id!r} is not on offer'
    elif not 0 <= index < len(state.bins):
        broken = f'there is no bin {index}, only 0 to {len(state.bins) - 1}'
    else:
        broken = engine.broken_rules(candidate, state.bins[index])
    if not broken:
        return
    algorithm = settings.spec
    if algorithm.is_built_in:
        msg = f'engine and rules disagree: {broken}; please report this'
    else:
        msg = f'algorithm {algorithm.name!r} chose a placement that the rules forbid: {broken}'
    raise EngineMismatch(msg)


def _is_served(box: Box, bins: Sequence[Bin]) -> bool:
    return any(may_enter(box, target.destination) for target in bins)


def _overdue(state: DecisionState, limit: int) -> tuple[Box, ...]:
    """Boxes that no open bin serves, passed over ``limit`` times or more; 0 for no limit."""
    boxes, counts = state.boxes, state.passed_over
    if limit == 0 or len(counts) != len(boxes):
        return ()
    return tuple(
        box
        for box, count in zip(boxes, counts, strict=True)
        if count >= limit and box.destination and not _is_served(box, state.bins)
    )


def by_wait(state: DecisionState) -> tuple[Box, ...]:
    """The boxes on offer, those first that were passed over most, then as on the belt."""
    boxes, counts = state.boxes, state.passed_over
    if len(counts) != len(boxes):
        return boxes
    order = sorted(range(len(boxes)), key=lambda index: -counts[index])
    return tuple(boxes[index] for index in order)


def _served(state: DecisionState) -> DecisionState:
    """The same without the boxes that may enter none of the open bins."""
    boxes, counts = state.boxes, state.passed_over
    chosen = [i for i, box in enumerate(boxes) if _is_served(box, state.bins)]
    if len(counts) == len(boxes):
        counts = tuple(counts[i] for i in chosen)
    return replace(state, boxes=tuple(boxes[i] for i in chosen), passed_over=counts)


def due(boxes: tuple[Box, ...], passed_over: Sequence[int], limit: int) -> tuple[Box, ...]:
    """The boxes of which one must be next, so that none is passed over more than ``limit`` times.

    All of ``boxes`` while there is time for each; with ``limit`` 0 always. Of n boxes on offer one
    may have to wait for n - 1 others, so a smaller ``limit`` counts as n - 1.
    """
    if limit == 0 or len(passed_over) != len(boxes):
        return boxes
    limit = max(limit, len(boxes) - 1)
    order = sorted(range(len(boxes)), key=lambda index: (-passed_over[index], index))
    for place, index in enumerate(order):
        # the boxes up to this place need every decision that is left to them
        if limit - passed_over[index] <= place:
            return tuple(boxes[chosen] for chosen in sorted(order[: place + 1]))
    return boxes


class PassedOver:
    """Counts how often each box on offer was passed over, where no belt does."""

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}

    def of(self, boxes: Iterable[Box]) -> tuple[int, ...]:
        """The counts of ``boxes``, in their order."""
        return tuple(self._counts.get(box.id, 0) for box in boxes)

    def take(self, taken: Box, boxes: Iterable[Box]) -> None:
        """``taken`` was placed, the others of ``boxes`` were not."""
        self._counts = {
            box.id: self._counts.get(box.id, 0) + 1 for box in boxes if box.id != taken.id
        }
