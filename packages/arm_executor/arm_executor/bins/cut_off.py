"""Cut-offs: the bins of a destination are closed, each as soon as nothing is on its way into it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from arm_executor.bins.book import BookError
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
    busy : id of the bin into which a box is on its way, empty for none.
    swap : closes a bin by id and opens one for a destination at its station; ``BookError`` says
        why not.
    """

    def __init__(
        self,
        bins: Callable[[], tuple[Bin, ...]],
        busy: Callable[[], str],
        swap: Callable[[str, int, str], Bin],
    ) -> None:
        self._bins = bins
        self._busy = busy
        self._swap = swap
        self._pending: dict[str, str] = {}

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
        busy, closed, pending = self._busy(), [], []
        for bin_ in chosen:
            if bin_.id == busy:
                self._pending[bin_.id] = next_destination
                pending.append(bin_.id)
            elif bin_.boxes or next_destination not in ('', destination):
                self._swap(bin_.id, 0, next_destination)
                closed.append(bin_.id)
        return CutOffAnswer(tuple(closed), tuple(pending))

    def goal_ended(self) -> None:
        """A goal has ended: close what waited for it.

        Raises
        ------
        BookError
            It cannot be closed now; it is tried again after the next goal.
        """
        open_bins = {bin_.id: bin_ for bin_ in self._bins()}
        for bin_id, following in list(self._pending.items()):
            bin_ = open_bins.get(bin_id)
            if bin_ is not None and bin_id == self._busy():
                continue
            if bin_ is not None and (bin_.boxes or following not in ('', bin_.destination)):
                self._swap(bin_id, 0, following)
            del self._pending[bin_id]
