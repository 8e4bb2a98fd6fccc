"""Bins that are closed at an operator's request, each as soon as no box is on its way into it."""

from __future__ import annotations

from collections.abc import Callable

from arm_executor.bins.book_state import BookError
from pack_msgs_py.values import Bin

#: Closes a bin, at once.
CloseNow = Callable[[Bin], object]


class Closings:
    """All methods are called from one thread.

    Parameters
    ----------
    bins : the open bins.
    busy : id of the bin into which a box is on its way, empty for none.
    """

    def __init__(self, bins: Callable[[], tuple[Bin, ...]], busy: Callable[[], str]) -> None:
        self._bins = bins
        self._busy = busy
        self._pending: dict[str, CloseNow] = {}

    def is_busy(self, bin_: Bin) -> bool:
        """Whether a box is on its way into ``bin_``."""
        return bin_.id == self._busy()

    def close(self, bin_: Bin, close_now: CloseNow) -> bool:
        """Have ``close_now`` close ``bin_``; whether that is done, or waits for the box.

        Raises
        ------
        BookError
            It cannot be closed.
        """
        if self.is_busy(bin_):
            self._pending[bin_.id] = close_now
            return False
        close_now(bin_)
        return True

    def goal_ended(self) -> None:
        """A goal has ended: close what waited for it.

        Raises
        ------
        BookError
            A bin cannot be closed now; it is tried again after the next goal.
        """
        failed = ''
        open_bins = {bin_.id: bin_ for bin_ in self._bins()}
        for bin_id, close_now in list(self._pending.items()):
            if bin_id in open_bins and bin_id == self._busy():
                continue
            try:
                if bin_id in open_bins:
                    close_now(open_bins[bin_id])
            except BookError as error:
                failed = failed or str(error)
                continue
            del self._pending[bin_id]
        if failed:
            raise BookError(failed)
