"""Cut-offs: the bins of a destination are closed, each as soon as nothing is on its way into it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from arm_executor.bins.book_state import BookError
from arm_executor.bins.closings import Closings
from pack_msgs_py.values import Bin


@dataclass(frozen=True)
class CutOffAnswer:
    """Ids of the bins that are closed, and of those that still wait for their last box."""

    closed: tuple[str, ...]
    pending: tuple[str, ...]

    def __str__(self) -> str:
        closed = f'closed: {", ".join(self.closed) or "no bin, none holds a box"}'
        waits = f'; {", ".join(self.pending)} once the box on its way into it rests'
        return closed + (waits if self.pending else '')


class CutOffs:
    """Asked for by an operator; all methods are called from one thread.

    Parameters
    ----------
    bins : the open bins.
    closings : has a bin closed as soon as no box is on its way into it.
    swap : closes a bin by id and opens one for a destination at its station; ``BookError`` says
        why not.
    """

    def __init__(
        self,
        bins: Callable[[], tuple[Bin, ...]],
        closings: Closings,
        swap: Callable[[str, int, str], Bin],
    ) -> None:
        self._bins = bins
        self._closings = closings
        self._swap = swap

    def cut_off(self, destination: str, next_destination: str = '') -> CutOffAnswer:
        """Close every bin of ``destination``; the new ones serve ``next_destination``, or the same.

        An empty bin stays, unless it is to serve another destination.

        Raises
        ------
        BookError
            No destination is named, no open bin serves it, or nothing can be closed now.
        """
        if not destination:
            msg = 'name a destination: bins for any box are closed one by one, with swap_bin'
            raise BookError(msg)
        bins = self._bins()
        chosen = [bin_ for bin_ in bins if bin_.destination == destination]
        if not chosen:
            served = ', '.join(sorted({bin_.destination for bin_ in bins if bin_.destination}))
            msg = f'no open bin serves {destination!r}; served are {served or "any boxes"}'
            raise BookError(msg)
        closed: list[str] = []
        pending: list[str] = []
        for bin_ in chosen:
            if self._closings.is_busy(bin_) or _due(bin_, next_destination):
                done = self._closings.close(bin_, partial(self._close, next_destination))
                (closed if done else pending).append(bin_.id)
        return CutOffAnswer(tuple(closed), tuple(pending))

    def _close(self, next_destination: str, bin_: Bin) -> None:
        if _due(bin_, next_destination):
            self._swap(bin_.id, 0, next_destination)


def _due(bin_: Bin, next_destination: str) -> bool:
    """Whether a bin has to go: it holds a box, or is to serve another destination."""
    return bool(bin_.boxes) or next_destination not in ('', bin_.destination)
