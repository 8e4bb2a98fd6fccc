"""The placements offered to the arm: the algorithm's choice, and what it would choose next.

Each one is what the algorithm says when the ones before were refused, so that the order is its
own; a refused position bars 10 cm around it, so that they differ.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from pack_msgs_py.cell_values import Decision
from pack_planner.decision.planner import Outcome, Place
from pack_planner.decision.policy import Settings, Situation


def quick(settings: Settings) -> Settings:
    """``settings`` for naming alternatives: those of MPack come from MPackLite, in milliseconds."""
    if settings.algorithm == 'mpack':
        settings = replace(settings, algorithm='mpack_lite')
    return replace(settings, backend='search')


@dataclass(frozen=True)
class Planned:
    """What to do, and for a placement what to do instead, best first, should the arm refuse it."""

    outcome: Outcome
    alternatives: tuple[Decision, ...] = ()

    def candidates(self) -> tuple[Decision, ...]:
        """The placements to ask the arm about, best first."""
        if not isinstance(self.outcome, Place):
            return ()
        return (self.outcome.decision, *self.alternatives)


def planned(
    first: Callable[[Situation], Outcome],
    following: Callable[[Situation], Outcome],
    situation: Situation,
    count: int,
) -> Planned:
    """The outcome by ``first``, and up to ``count`` - 1 alternatives by ``following``."""
    outcome = first(situation)
    found: list[Decision] = []
    last = outcome
    while isinstance(last, Place) and len(found) < count - 1:
        decision = last.decision
        target = next(one for one in situation.bins if one.id == decision.bin_id)
        situation = replace(situation, forbidden=situation.forbidden.plus(target, decision))
        last = following(situation)
        if isinstance(last, Place):
            found.append(last.decision)
    return Planned(outcome, tuple(found))
