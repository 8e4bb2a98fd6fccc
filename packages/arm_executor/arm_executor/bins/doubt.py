"""Boxes of which a crash has left open where they are: found by the arm, else asked of a person."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from arm_executor.bins.records import Attempt, Step
from arm_executor.model.arm_interface import FoundAt
from pack_msgs_py.values import Bin

#: Says where the box of a placement is that was picked, or whose release had begun, given also the
#: station of its bin; ``None`` when that cannot be told.
Finder = Callable[[Attempt, str], FoundAt | None]

#: What others are told of a box in doubt.
DOUBT = (
    'the executor ended while the arm had the box, and the arm cannot tell whether it is in its '
    'bin: look, then cell resolve it with --placed or --removed'
)


@dataclass(frozen=True)
class Recovery:
    """What a restart found.

    Attributes
    ----------
    undecided : boxes of which nobody knows where they are.
    returned, forgotten : boxes that are back on the belt, and such that never left it.
    unmeasured : boxes that are in their bins, and are to be measured again.
    """

    undecided: tuple[Attempt, ...] = ()
    returned: tuple[Attempt, ...] = ()
    forgotten: tuple[Attempt, ...] = ()
    unmeasured: tuple[Attempt, ...] = ()


def as_written(attempt: Attempt, station: str) -> FoundAt:
    """Where a box is in a world that begins anew as the journal says."""
    return FoundAt.IN_BIN if attempt.step.in_bin else FoundAt.ON_BELT


def sorted_out(pending: Iterable[Attempt], stations: Mapping[int, str], find: Finder) -> Recovery:
    """What is to be done about each placement that was under way.

    A box that was only planned is still on the belt, one that the pad has let go is in its bin;
    about the others ``find`` is asked. ``stations`` are those of the bins, by serial.
    """
    undecided: list[Attempt] = []
    returned: list[Attempt] = []
    unmeasured: list[Attempt] = []
    forgotten: list[Attempt] = []
    for attempt in pending:
        if attempt.step is Step.PLANNED:
            forgotten.append(attempt)
        elif attempt.step is Step.PLACED:
            unmeasured.append(attempt)
        else:
            found = find(attempt, stations[attempt.bin_serial])
            kinds = {FoundAt.ON_BELT: returned, FoundAt.IN_BIN: unmeasured, None: undecided}
            kinds[found].append(attempt)
    return Recovery(tuple(undecided), tuple(returned), tuple(forgotten), tuple(unmeasured))


def blocked_bins(bins: Iterable[Bin], unknown: Iterable[Attempt]) -> dict[str, str]:
    """Why no box may go into which of ``bins``, by their ids, for placements in doubt."""
    names = {bin_.serial: bin_.id for bin_ in bins}
    return {
        names[attempt.bin_serial]: (
            f'bin {names[attempt.bin_serial]!r} is blocked: nobody knows whether box '
            f'{attempt.placed.box.id!r} is in it; look, then cell resolve {attempt.placed.box.id} '
            'with --placed or --removed'
        )
        for attempt in unknown
        if attempt.bin_serial in names
    }
