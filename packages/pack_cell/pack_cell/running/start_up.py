"""Which nodes of a cell are still to come up: while one is, a run that does nothing is no stall."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pack_cell.watching.cell_watch import NODES
from pack_msgs_py.cell_state import CellState

#: A node that has not come up by then has something wrong with it, on however slow a machine.
START_PATIENCE_S = 300.0
#: It is told after so long which node is waited for, and again each time so much later.
TELL_EVERY_S = 30.0
#: What is heard so soon after the start of a process is of the one before it: loading ROS takes
#: longer.
OLD_WORDS_S = 1.0


class StartUp:
    """Knows since when each node that is not up yet is waited for.

    Parameters
    ----------
    started : when the process of each node was started; steady seconds.
    heard_s : when a node was heard last; minus infinity for never.
    starts : whether a node that is heard is not ready yet: an arm, a planner that compiles.
    """

    def __init__(
        self,
        started: Callable[[], Mapping[str, float]],
        heard_s: Callable[[str], float],
        starts: Callable[[str], bool],
    ) -> None:
        self._started, self._heard_s, self._starts = started, heard_s, starts
        self._told_s = TELL_EVERY_S
        self._up: dict[str, float] = {}

    def coming(self, now_s: float) -> dict[str, float]:
        """The nodes that are not up, and for how many seconds their processes have run.

        One is up when it is ready. What has come up stays so until it is started again.
        """
        coming = {}
        for name, began_s in self._started().items():
            if name not in NODES or self._up.get(name) == began_s:
                continue
            heard = self._heard_s(name) >= began_s + OLD_WORDS_S
            if heard and not self._starts(name):
                self._up[name] = began_s
            else:
                coming[name] = now_s - began_s
        return coming

    def news(self, now_s: float) -> str:
        """What is waited for, each time it has become long; empty when there is nothing to tell."""
        coming = self.coming(now_s)
        longest_s = max(coming.values(), default=0.0)
        if longest_s < self._told_s:
            self._told_s = TELL_EVERY_S if not coming else self._told_s
            return ''
        self._told_s = longest_s + TELL_EVERY_S
        return f'waits for {" and ".join(coming)} to come up, for {longest_s:.0f} s by now'

    def given_up(self, now_s: float, patience_s: float, state: CellState) -> str:
        """Which nodes have not come up within ``patience_s``, and what they say; else empty."""
        late = {name: s for name, s in self.coming(now_s).items() if s > patience_s}
        said = {node.name: node.state for node in state.nodes}
        return '; '.join(
            f'node {name} has not come up within {seconds:.0f} s ({said.get(name, "not heard")})'
            for name, seconds in late.items()
        )
