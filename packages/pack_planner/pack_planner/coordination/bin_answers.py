"""What the arm said about placements in each open bin, for whoever asks why it was closed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field

from pack_msgs_py.cell_values import Decision
from pack_msgs_py.closing import Cause, ClosingReason
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.values import Bin
from pack_planner.coordination.answers import TRANSIENT, CheckAnswer, refusal_of
from pack_planner.coordination.negotiation import MARGIN_S
from pack_planner.decision.planner import CloseStep

#: A deadline that is advised is a multiple of this, seconds.
_ADVICE_STEP_S = 0.5


@dataclass
class _Answers:
    """Of one bin. ``slow_s`` is the least motion that took too long, by box, since ``revision``."""

    asked: int = 0
    refused: Counter[ErrorCode] = field(default_factory=Counter)
    revision: int = 0
    slow_s: dict[str, float] = field(default_factory=dict)


class BinAnswers:
    """Counts for the bins that are open."""

    def __init__(self) -> None:
        self._by_bin: dict[str, _Answers] = {}

    def forget_gone(self, bins: Iterable[Bin]) -> None:
        """Drop bins that are not open any more."""
        known = {target.id for target in bins}
        self._by_bin = {name: said for name, said in self._by_bin.items() if name in known}

    def heard(
        self, candidates: Sequence[Decision], answers: Sequence[CheckAnswer], deadline_s: float
    ) -> None:
        """Count what the arm answered about ``candidates``."""
        for candidate, answer in zip(candidates, answers, strict=True):
            if answer.code in TRANSIENT:
                continue
            said = self._by_bin.setdefault(candidate.bin_id, _Answers())
            said.asked += 1
            refusal = refusal_of(answer, deadline_s - MARGIN_S)
            if refusal is ErrorCode.NONE:
                continue
            said.refused[refusal] += 1
            if refusal is not ErrorCode.DEADLINE_UNREACHABLE:
                continue
            if said.revision != candidate.bin_revision:
                said.revision, said.slow_s = candidate.bin_revision, {}
            name = candidate.box.id
            said.slow_s[name] = min(answer.motion_s, said.slow_s.get(name, math.inf))

    def reason(
        self, step: CloseStep, bins: Iterable[Bin], box_ids: Collection[str]
    ) -> ClosingReason:
        """Why ``step`` closes its bin, with ``bins`` open and these boxes on offer."""
        said = self._by_bin.get(step.target.id, _Answers())
        return ClosingReason(
            step.target.id,
            dict(step.causes),
            said.asked,
            dict(said.refused),
            self._enough_s(bins, box_ids) if Cause.TOO_SLOW in step.causes else 0.0,
        )

    def _enough_s(self, bins: Iterable[Bin], box_ids: Collection[str]) -> float:
        """The deadline with which a box could be placed as the bins are; 0 when none is known."""
        slow_s = [
            seconds
            for target in bins
            if (said := self._by_bin.get(target.id)) and said.revision == target.revision
            for name, seconds in said.slow_s.items()
            if name in box_ids
        ]
        if not slow_s:
            return 0.0
        return math.ceil((min(slow_s) + MARGIN_S) / _ADVICE_STEP_S) * _ADVICE_STEP_S
