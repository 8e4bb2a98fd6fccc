"""What the planner waits for at the bins: the answer to a swap, and the bin that follows it.

A report that a box is in its bin and the bin's new content come on two topics. Until the bins show
what was reported, nothing is decided on them; both waits end by themselves.
"""

from __future__ import annotations

from collections.abc import Iterable

from pack_msgs_py.values import Bin

BINS_TIMEOUT_S = 5.0
SWAP_TIMEOUT_S = 5.0


class AwaitedBins:
    """True while anything is awaited; times are seconds of the steady clock."""

    def __init__(self) -> None:
        self._change: tuple[str, int, float] | None = None  # bin id, revision seen, until
        self._swap: tuple[Bin, float] | None = None  # the bin to go, asked at

    def __bool__(self) -> bool:
        return self._change is not None or self._swap is not None

    def await_swap(self, target: Bin, now_s: float) -> None:
        """`swap_bin` was called for ``target``."""
        self._swap = (target, now_s)

    def swap_answered(self) -> Bin | None:
        """The bin whose swap was awaited until now; ``None`` when none was."""
        target = self._swap[0] if self._swap is not None else None
        self._swap = None
        return target

    def await_change(self, bin_id: str, revision: int, now_s: float) -> None:
        """The bin is reported to have changed since ``revision``, or to be gone."""
        self._change = (bin_id, revision, now_s + BINS_TIMEOUT_S)

    def update(self, bins: Iterable[Bin], now_s: float) -> list[str]:
        """End what has come true or taken too long; a warning for each of the latter.

        Parameters
        ----------
        bins : the bins of the newest snapshot; none when there is no snapshot.
        """
        warnings = []
        if self._change is not None:
            bin_id, revision, until_s = self._change
            if not any(target.id == bin_id and target.revision <= revision for target in bins):
                self._change = None
            elif now_s > until_s:
                warnings.append(f'bin {bin_id!r} did not change as reported; going on')
                self._change = None
        if self._swap is not None and now_s - self._swap[1] > SWAP_TIMEOUT_S:
            warnings.append(f'no answer to swap_bin within {SWAP_TIMEOUT_S:g} s')
            self._swap = None
        return warnings
