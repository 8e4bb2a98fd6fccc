"""Which of the planner's candidates is carried out, by what the arm answers about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from pack_msgs_py.cell_values import MOST_RUNNERS_UP, Decision, RunnerUp, Scan
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.values import Bin
from pack_planner.coordination.alternatives import Planned
from pack_planner.coordination.answers import TRANSIENT, CheckAnswer, refusal_of
from pack_planner.coordination.planning_time import BY_CLOCK, PlanningTime
from pack_planner.decision.pick_point import lies_oddly
from pack_planner.decision.refusals import Refusals

#: Left of the deadline for sending the goal, and for what the arm plans anew.
MARGIN_S = 0.1
#: When no time is left the arm is asked what it can do in this.
LEAST_S = 0.01
#: An arm that is moving may take this long to answer; nobody waits for it meanwhile.
HIDDEN_TIMEOUT_S = 5.0
#: Where the clock does not count, an answer may take as long as a machine may be busy.
COUNTED_TIMEOUT_S = 60.0


@dataclass(frozen=True)
class Asking:
    """How the arm is asked: about so many ``candidates`` at most (0: not at all), in what time.

    ``timeout_s`` is how long the answer for each may take that no motion hides, ``deadline_s`` the
    time for a box, ``time`` what planning counts of it.
    """

    candidates: int = 0
    timeout_s: float = 1.0
    deadline_s: float = 5.5
    time: PlanningTime = BY_CLOCK


@dataclass(frozen=True)
class Talk:
    """What was said so far about one decision, over all rounds of candidates.

    ``first`` is the planner's first choice. ``first_refusal`` is why the arm cannot do the first
    one that its prediction let through, if ``first_known``; ``planning_s`` and ``check_s`` are what
    all rounds took by the clock, ``spent_s`` what counts of it, ``trigger_s`` the stamp of the
    youngest input when they began; ``others`` are all candidates so far.
    """

    trigger_s: float
    first: Decision | None = None
    first_refusal: ErrorCode = ErrorCode.NONE
    first_known: bool = False
    checked: int = 0
    planning_s: float = 0.0
    check_s: float = 0.0
    spent_s: float = 0.0
    others: tuple[RunnerUp, ...] = ()

    @property
    def begun(self) -> bool:
        """Whether the arm has refused candidates before."""
        return self.checked > 0

    def limit_s(self, deadline_s: float, hidden_s: float) -> float:
        """Motion that still fits before the deadline when a motion hides ``hidden_s``."""
        return deadline_s - MARGIN_S - self.unhidden_s(hidden_s)

    def unhidden_s(self, hidden_s: float) -> float:
        """What was spent beyond the ``hidden_s`` that a motion hides."""
        return max(0.0, self.spent_s - hidden_s)

    def thought(self, planned: Planned, time: PlanningTime) -> Talk:
        """After one more round of planning."""
        candidates = planned.candidates()
        if not candidates:
            return self
        seconds = sum(candidate.planning_s for candidate in candidates)
        return replace(
            self,
            first=self.first or candidates[0],
            planning_s=self.planning_s + seconds,
            spent_s=self.spent_s + time.of_decision(planned.nodes, seconds),
        )

    def heard(
        self, answers: Sequence[CheckAnswer], seconds: float, limit_s: float, time: PlanningTime
    ) -> Talk:
        """After the arm has answered; what takes longer than ``limit_s`` counts as refused."""
        looked_at = [answer for answer in answers if answer.code not in TRANSIENT]
        let_through = [answer for answer in looked_at if not answer.predicted]
        talk = replace(
            self,
            checked=self.checked + len(looked_at),
            check_s=self.check_s + seconds,
            spent_s=self.spent_s + time.of_answers(answers, seconds),
        )
        if self.first_known or not let_through:
            return talk
        return replace(talk, first_refusal=refusal_of(let_through[0], limit_s), first_known=True)

    def weighed(
        self, candidates: Sequence[Decision], answers: Sequence[CheckAnswer], limit_s: float
    ) -> Talk:
        """With the ``candidates`` of one more round, and why the arm would not do them, if so."""
        refusals = [refusal_of(answer, limit_s) for answer in answers]
        refusals += [ErrorCode.NONE] * (len(candidates) - len(refusals))
        more = [
            RunnerUp(one.box.id, one.bin_id, one.corner_mm, one.objective, refusal)
            for one, refusal in zip(candidates, refusals, strict=True)
        ]
        return replace(self, others=(*self.others, *more))

    def written_into(self, decision: Decision) -> Decision:
        """``decision`` with what was said about it."""
        taken = (decision.box.id, decision.bin_id, decision.corner_mm)
        others = [
            other for other in self.others if (other.box_id, other.bin_id, other.corner_mm) != taken
        ]
        first = decision if self.first is None else self.first
        return replace(
            decision,
            planning_s=self.planning_s,
            candidates_checked=self.checked,
            check_s=self.check_s,
            first_objective=first.objective,
            first_refusal=self.first_refusal,
            runners_up=tuple(others[:MOST_RUNNERS_UP]),
        )


def choose(
    candidates: Sequence[Decision],
    answers: Sequence[CheckAnswer],
    limit_s: float,
    deadline_s: float,
) -> Decision | None:
    """The first candidate that the arm can do in time; ``None`` when it refuses what it looked at.

    Of those that would do but for the time that the talk itself took, the quickest; when the arm
    says nothing about any, the first: the goal will show.
    """
    pairs = list(zip(candidates, answers, strict=True))
    able = [(candidate, answer) for candidate, answer in pairs if answer.possible]
    for candidate, answer in able:
        if answer.motion_s <= limit_s:
            return candidate
    known = [(answer.motion_s, i) for i, (_, answer) in enumerate(able)]
    if known and min(known)[0] <= deadline_s - MARGIN_S:
        return able[min(known)[1]][0]
    silent = all(answer.code in TRANSIENT for answer in answers)
    return candidates[0] if silent else None


def learn(
    refusals: Refusals,
    bins: Sequence[Bin],
    candidates: Sequence[Decision],
    answers: Sequence[CheckAnswer],
    deadline_s: float,
    scan: Scan | None = None,
) -> None:
    """Remember which of ``candidates`` the arm cannot do in ``bins``, whoever asks when.

    ``scan`` tells which of them lie oddly.
    """
    by_id = {target.id: target for target in bins}
    for candidate, answer in zip(candidates, answers, strict=True):
        refusal = refusal_of(answer, deadline_s - MARGIN_S)
        if refusal is not ErrorCode.NONE:
            # How long the tray keeps the arm waiting is another matter for the next box.
            too_slow = refusal is ErrorCode.DEADLINE_UNREACHABLE and candidate.is_upright
            target = by_id[candidate.bin_id]
            refusals.learn(
                target,
                candidate,
                refusal,
                lasting=too_slow,
                predicted=answer.predicted,
                lies_oddly=lies_oddly(candidate.box, scan),
            )
