"""The placements offered to the arm: the algorithm's choice, and what it would choose next.

Each one is what the algorithm says when the ones before were refused, so that the order is its
own; a refused position bars 10 cm around it, so that they differ.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from pack_msgs_py.cell_values import Decision
from pack_planner.decision.planner import PlaceStep, PlannerStep
from pack_planner.decision.policy import DecisionState, PolicySettings


def quick(settings: PolicySettings) -> PolicySettings:
    """``settings`` for naming alternatives, which must not take long."""
    algorithm = settings.spec.alternatives or settings.algorithm
    return replace(settings, algorithm=algorithm, backend='search')


@dataclass(frozen=True)
class Planned:
    """What to do, and for a placement what to do instead, best first, should the arm refuse it."""

    outcome: PlannerStep
    alternatives: tuple[Decision, ...] = ()

    def candidates(self) -> tuple[Decision, ...]:
        """The placements to ask the arm about, best first."""
        if not isinstance(self.outcome, PlaceStep):
            return ()
        return (self.outcome.decision, *self.alternatives)


def planned(
    first: Callable[[DecisionState], PlannerStep],
    following: Callable[[DecisionState], PlannerStep],
    state: DecisionState,
    count: int,
) -> Planned:
    """The outcome by ``first``, and up to ``count`` - 1 alternatives by ``following``."""
    outcome = first(state)
    alternatives: list[Decision] = []
    last = outcome
    while isinstance(last, PlaceStep) and len(alternatives) < count - 1:
        decision = last.decision
        target = next(there for there in state.bins if there.id == decision.bin_id)
        state = replace(state, forbidden=state.forbidden.plus(target, decision))
        last = following(state)
        if isinstance(last, PlaceStep):
            alternatives.append(last.decision)
    return Planned(outcome, tuple(alternatives))
