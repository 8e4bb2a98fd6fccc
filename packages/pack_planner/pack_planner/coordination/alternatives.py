"""The placements offered to the arm: the algorithm's choice, and what it would choose next.

Mostly the algorithm names them itself. Otherwise each one is what it says when the ones before were
refused, so that the order is its own; a refused position bars what is near it, so that they differ.

A bin is closed only when the algorithm finds nothing more with nothing barred but what was really
refused: :meth:`pack_planner.decision.refusals.Forbidden.to_the_last`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from pack_msgs_py.cell_values import Decision
from pack_planner.decision.planner import CloseStep, PlaceStep, PlannerStep
from pack_planner.decision.policy import DecisionState, PolicySettings


def quick(settings: PolicySettings) -> PolicySettings:
    """``settings`` for naming alternatives, which must not take long."""
    algorithm = settings.spec.alternatives or settings.algorithm
    return replace(settings, algorithm=algorithm, backend='search')


def nodes_of(step: PlannerStep) -> int:
    """How many nodes the search took for ``step``."""
    return step.nodes if isinstance(step, PlaceStep) else 0


@dataclass(frozen=True)
class Planned:
    """What to do, and for a placement what to do instead, best first, should the arm refuse it.

    ``nodes`` is how many the search took for all of it.
    """

    outcome: PlannerStep
    alternatives: tuple[Decision, ...] = ()
    nodes: int = 0

    def candidates(self) -> tuple[Decision, ...]:
        """The placements to ask the arm about, best first."""
        if not isinstance(self.outcome, PlaceStep):
            return ()
        return (self.outcome.decision, *self.alternatives)

    def limited(self, count: int) -> Planned:
        """The same with at most ``count`` placements."""
        return replace(self, alternatives=self.alternatives[: max(0, count - 1)])


def planned(
    first: Callable[[DecisionState], PlannerStep],
    following: Callable[[DecisionState], PlannerStep],
    state: DecisionState,
    count: int,
) -> Planned:
    """The outcome by ``first``, and its own alternatives, or ``count`` - 1 by ``following``."""
    outcome = first(state)
    nodes = nodes_of(outcome)
    if isinstance(outcome, CloseStep) and state.forbidden.leaves_out:
        state = replace(state, forbidden=state.forbidden.to_the_last())
        outcome = following(state)
        nodes += nodes_of(outcome)
    if isinstance(outcome, PlaceStep) and outcome.others:
        return Planned(outcome, outcome.others, nodes)
    alternatives: list[Decision] = []
    last = outcome
    while isinstance(last, PlaceStep) and len(alternatives) < count - 1:
        decision = last.decision
        target = next(there for there in state.bins if there.id == decision.bin_id)
        state = replace(state, forbidden=state.forbidden.plus(target, decision))
        last = following(state)
        nodes += nodes_of(last)
        if isinstance(last, PlaceStep):
            alternatives.append(last.decision)
    return Planned(outcome, tuple(alternatives), nodes)
