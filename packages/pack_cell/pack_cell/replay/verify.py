"""Every decision of a recorded run made again from what it rested on then."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from pack_msgs_py.codes import PlacementStatus
from pack_planner.coordination.alternatives import planned, quick
from pack_planner.coordination.planning_record import PlanningRecord, answer_of
from pack_planner.decision.planner import PlaceStep, Planner
from pack_planner.parameters import settings

#: A search that took so much of its budget may have been cut short by it.
_NEAR_BUDGET = 0.9


@dataclass(frozen=True)
class DecidedAgain:
    """A recorded decision beside what comes out of it now.

    Attributes
    ----------
    record : what it rested on, and what was answered.
    answer : what is answered now, a line for each placement, best first.
    time_limited : whether the search was cut short by its budget, then or now.
    """

    record: PlanningRecord
    answer: tuple[str, ...]
    time_limited: bool

    @property
    def same(self) -> bool:
        """Whether both are the same, alternatives included."""
        return self.answer == self.record.answer

    @property
    def text(self) -> str:
        """What differs, for people."""
        was, now = self.record.answer, self.answer
        why = ' (its search was limited by time)' if self.time_limited else ''
        if was[0] != now[0]:
            return f'question {self.record.question.number}{why}: was {was[0]}; is {now[0]}'
        return (
            f'question {self.record.question.number}{why}: {was[0]} as before, but of '
            f'{len(was) - 1} alternatives then and {len(now) - 1} now some differ'
        )


def decide_again(records: Iterable[PlanningRecord]) -> Iterator[DecidedAgain]:
    """Make each recorded decision again, under the parameters of that moment.

    Raises
    ------
    ValueError
        An algorithm, or a file with its weights, is not there any more.
    """
    planners: dict[str, Planner] = {}
    for record in records:
        question = record.question
        wanted = settings(question.parameters)
        following = quick(wanted)
        for role, under in (('first', wanted), ('following', following)):
            if role not in planners:
                planners[role] = Planner(under, time.perf_counter)
            planners[role].use(under)
        first = planners['first']
        follower = first if following == wanted else planners['following']
        made = planned(first.decide, follower.decide, question.state, question.candidates)
        budget_s = question.parameters.budget_s
        cut_short = isinstance(made.outcome, PlaceStep) and (
            made.outcome.decision.status is PlacementStatus.BUDGET
        )
        near = budget_s > 0.0 and record.planning_s > _NEAR_BUDGET * budget_s
        yield DecidedAgain(record, answer_of(made), cut_short or near)
