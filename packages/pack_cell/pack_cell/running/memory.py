"""What the processes of a cell take of the memory, at a tenth of the run and at its end."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

_PAGE = os.sysconf('SC_PAGE_SIZE')
#: Share of the run at which memory is measured first: all code is loaded, and most boxes to come.
EARLY = 0.1


def resident_mb(pid: int) -> float | None:
    """Resident memory of a process, megabytes; ``None`` when it has gone, or on another system."""
    try:
        pages = int(Path(f'/proc/{pid}/statm').read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return None
    return round(pages * _PAGE / 1e6, 1)


class MemoryWatch:
    """Measures once early and once whenever asked; ``cell`` is this process itself."""

    def __init__(self) -> None:
        self._early: dict[str, float] = {}
        self._late: dict[str, float] = {}

    def measure(self, pids: Mapping[str, int], share: float) -> None:
        """``share`` of the run is over, 0 to 1."""
        sizes = {name: resident_mb(pid) for name, pid in {**pids, 'cell': os.getpid()}.items()}
        known = {name: size for name, size in sizes.items() if size is not None}
        if not self._early and share >= EARLY:
            self._early = known
        self._late = known or self._late

    def summary(self) -> dict[str, dict[str, float | None]]:
        """Megabytes by process."""
        return {
            name: {'at_10_percent': self._early.get(name), 'at_end': size}
            for name, size in self._late.items()
        }
