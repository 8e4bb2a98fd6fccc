"""Why a bin was closed: what kept each box on offer out of the open bins, and what the arm said."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from pack_msgs_py.codes import ErrorCode


class Cause(str, Enum):
    """What keeps a box out of every open bin that it may enter; the first that applies."""

    #: No open bin serves its destination.
    DESTINATION = 'destination'
    #: The arm refused every place that the rules allow it, and only for the time.
    TOO_SLOW = 'too_slow'
    #: The arm refused every place that the rules allow it.
    REFUSED = 'refused'
    #: The rules allow it a place, but the algorithm did not look there.
    OVERLOOKED = 'overlooked'
    #: Each bin would be heavier than it may be.
    BIN_WEIGHT = 'bin_weight'
    #: Whatever it stood on, it would rise above the rim.
    TOO_HIGH = 'too_high'
    #: It would stand, but on boxes that may not carry so much.
    TOP_LOAD = 'top_load'
    #: There is room, and nothing there on which it would stand.
    NO_SUPPORT = 'no_support'


_WORDS = {
    Cause.DESTINATION: 'for another destination',
    Cause.TOO_SLOW: 'refused by the arm for the time',
    Cause.REFUSED: 'refused by the arm',
    Cause.OVERLOOKED: 'not looked for where they fit',
    Cause.BIN_WEIGHT: 'too heavy for the bins',
    Cause.TOO_HIGH: 'too high',
    Cause.TOP_LOAD: 'too heavy for the boxes below',
    Cause.NO_SUPPORT: 'without support',
}
_REFUSALS = {
    ErrorCode.DEADLINE_UNREACHABLE: 'for time',
    ErrorCode.NO_IK_SOLUTION: 'out of reach',
    ErrorCode.PATH_IN_COLLISION: 'without a free path',
    ErrorCode.LIMITS_EXCEEDED: 'beyond its limits',
}


@dataclass(frozen=True)
class ClosingReason:
    """Why a bin was closed.

    Attributes
    ----------
    bin_id : the bin.
    causes : boxes that were on offer, by what kept them out.
    asked : placements in this bin that the arm was asked about, over its whole life.
    refused : how many of these it refused, by code.
    deadline_s : with this deadline it would have placed one of the boxes on offer; 0 when no
        deadline is known with which it would.
    """

    bin_id: str
    causes: Mapping[Cause, int] = field(default_factory=dict)
    asked: int = 0
    refused: Mapping[ErrorCode, int] = field(default_factory=dict)
    deadline_s: float = 0.0

    @property
    def boxes(self) -> int:
        """How many boxes were on offer."""
        return sum(self.causes.values())

    @property
    def text(self) -> str:
        """For people: what kept the boxes out, what the arm refused, and what would help.

        >>> ClosingReason('LDC-3', {Cause.TOO_HIGH: 3, Cause.NO_SUPPORT: 2}).text
        'nothing fits: 3 of 5 boxes too high, 2 without support'
        """
        return '; '.join(filter(None, (f'nothing fits: {self._causes()}', self._arm())))

    def _causes(self) -> str:
        boxes = 'box' if self.boxes == 1 else 'boxes'
        counts = sorted(self.causes.items(), key=lambda item: -item[1])
        parts = [
            f'{number} of {self.boxes} {boxes} {_WORDS[cause]}'
            if index == 0
            else f'{number} {_WORDS[cause]}'
            for index, (cause, number) in enumerate(counts)
        ]
        return ', '.join(parts) or 'no box on offer'

    def _arm(self) -> str:
        text = refusal_text(self.asked, self.refused)
        if not self.causes.get(Cause.TOO_SLOW):
            return text
        longer = f'--deadline {self.deadline_s:g}' if self.deadline_s else 'a longer --deadline'
        return f'{text}: try {longer}' if text else f'try {longer}'


def refusal_text(asked: int, refused: Mapping[ErrorCode, int]) -> str:
    """How many of the ``asked`` placements the arm ``refused``, and why; empty when none."""
    total = sum(refused.values())
    if not total:
        return ''
    by_code = Counter(refused).most_common()
    words = [
        f'{number} {_REFUSALS.get(code, f"with {code.name}")}' for code, number in by_code if number
    ]
    if len(words) == 1:
        words = [f'all {words[0].partition(" ")[2]}']
    return f'arm refused {total} of {asked} places, {", ".join(words)}'
