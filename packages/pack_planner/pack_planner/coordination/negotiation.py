"""Which of the planner's candidates is carried out, by what the arm answers about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from pack_msgs_py.cell_values import Decision
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.values import Bin
from pack_planner.coordination.alternatives import Planned
from pack_planner.decision.refusals import Refusals

#: Left of the deadline for sending the goal, and for what the arm plans anew.
MARGIN_S = 0.1
#: When no time is left the arm is asked what it can do in this.
LEAST_S = 0.01
#: An arm that is moving may take this long to answer; nobody waits for it meanwhile.
HIDDEN_TIMEOUT_S = 5.0

#: Endings, and answers, that say nothing about the placement.
TRANSIENT = frozenset(
    {
        ErrorCode.UNKNOWN,
        ErrorCode.STALE_BIN_REVISION,
        ErrorCode.BUSY,
        ErrorCode.NOT_ACTIVE,
        ErrorCode.BOX_NOT_ON_BELT,
        ErrorCode.STALE_GOAL,
        ErrorCode.START_STATE_INVALID,
        ErrorCode.BOX_NOT_PRESENTED,
        ErrorCode.CANCELED,
        ErrorCode.PROTECTIVE_STOP,
    }
)


@dataclass(frozen=True)
class Asking:
    """How the arm is asked: about so many ``candidates`` at most (0: not at all), in what time.

    ``timeout_s`` is how long the answer for each may take that no motion hides, ``deadline_s`` the
    time for a box.
    """

    candidates: int = 0
    timeout_s: float = 1.0
    deadline_s: float = 5.5


@dataclass(frozen=True)
class CheckAnswer:
    """What the arm says of one candidate; see PlacementCheck.msg.

    ``motion_s`` is the time that it would take, 0 when there is no motion; ``predicted`` says that
    it was refused by a prediction alone, without planning.
    """

    code: ErrorCode
    motion_s: float = 0.0
    predicted: bool = False

    @property
    def possible(self) -> bool:
        """Whether there is a motion, however long it takes."""
        slow = self.code is ErrorCode.DEADLINE_UNREACHABLE and self.predicted
        return slow or self.code is ErrorCode.NONE


@dataclass(frozen=True)
class Talk:
    """What was said so far about one decision, over all rounds of candidates.

    ``first`` is the planner's first choice. ``first_refusal`` is why the arm cannot do the first
    one that its prediction let through, if ``first_known``; ``planning_s`` and ``check_s`` are what
    all rounds took, ``trigger_s`` the stamp of the youngest input when they began.
    """

    trigger_s: float
    first: Decision | None = None
    first_refusal: ErrorCode = ErrorCode.NONE
    first_known: bool = False
    checked: int = 0
    planning_s: float = 0.0
    check_s: float = 0.0

    @property
    def begun(self) -> bool:
        """Whether the arm has refused candidates before."""
        return self.checked > 0

    @property
    def spent_s(self) -> float:
        """What the decision has cost so far."""
        return self.planning_s + self.check_s

    def limit_s(self, deadline_s: float, *, hidden: bool) -> float:
        """Motion that still fits before the deadline; what a motion hides costs nothing."""
        return deadline_s - MARGIN_S - (0.0 if hidden else self.spent_s)

    def thought(self, planned: Planned) -> Talk:
        """After one more round of planning."""
        candidates = planned.candidates()
        if not candidates:
            return self
        seconds = sum(candidate.planning_s for candidate in candidates)
        first = self.first or candidates[0]
        return replace(self, first=first, planning_s=self.planning_s + seconds)

    def heard(self, answers: Sequence[CheckAnswer], seconds: float, limit_s: float) -> Talk:
        """After the arm has answered; what takes longer than ``limit_s`` counts as refused."""
        looked_at = [answer for answer in answers if answer.code not in TRANSIENT]
        let_through = [answer for answer in looked_at if not answer.predicted]
        talk = replace(self, checked=self.checked + len(looked_at), check_s=self.check_s + seconds)
        if self.first_known or not let_through:
            return talk
        return replace(talk, first_refusal=refusal_of(let_through[0], limit_s), first_known=True)

    def written_into(self, decision: Decision) -> Decision:
        """``decision`` with what was said about it."""
        first = decision if self.first is None else self.first
        return replace(
            decision,
            planning_s=self.planning_s,
            candidates_checked=self.checked,
            check_s=self.check_s,
            first_objective=first.objective,
            first_refusal=self.first_refusal,
        )


def refusal_of(answer: CheckAnswer, limit_s: float) -> ErrorCode:
    """Why a candidate cannot be done; ``NONE`` when it can, or when nobody knows."""
    if answer.possible:
        slow = answer.motion_s > limit_s
        return ErrorCode.DEADLINE_UNREACHABLE if slow else ErrorCode.NONE
    return ErrorCode.NONE if answer.code in TRANSIENT else answer.code


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
) -> None:
    """Remember which of ``candidates`` the arm cannot do in ``bins``, whoever asks when."""
    by_id = {target.id: target for target in bins}
    for candidate, answer in zip(candidates, answers, strict=True):
        refusal = refusal_of(answer, deadline_s - MARGIN_S)
        if refusal is not ErrorCode.NONE:
            # How long the tray keeps the arm waiting is another matter for the next box.
            too_slow = refusal is ErrorCode.DEADLINE_UNREACHABLE and candidate.is_upright
            target = by_id[candidate.bin_id]
            refusals.learn(target, candidate, refusal, lasting=too_slow, predicted=answer.predicted)
