"""A run that has ended, as the figures of its summary see it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from pack_cell.options.run_options import RunOptions
from pack_cell.options.usual import GRASP_FACES
from pack_cell.report.accounts import BoxAccounts, disagreements
from pack_cell.report.archive import BinFigures
from pack_cell.report.offline_packing import OfflineBins
from pack_cell.report.record import RunRecord
from pack_cell.report.run_log import RunSession
from pack_msgs_py.metrics import fill_metrics_of
from pack_msgs_py.profiles import Profile, adapted, find_profile
from pack_msgs_py.rules import Violation


def execution_profile(options: RunOptions) -> Profile:
    """The rules as planner and executor of a run apply them.

    Whatever the profile allows, it is the arm's ``grasp_faces`` that orientations depend on.
    """
    return adapted(
        find_profile(options.profile),
        orientations=GRASP_FACES[options.grasp_faces],
        size_sigmas=options.size_sigmas,
        clearance_mm=options.clearance_mm,
        resolution_mm=options.resolution_mm,
    )


@dataclass(frozen=True)
class EndedRun:
    """What there is to know of a run at its end.

    Attributes
    ----------
    record : what the topics showed.
    options : what was asked for.
    command : words of the command line.
    wall_time_s : from the start of the command to the end of the nodes, seconds; the sum where
        the run was gone on with.
    first_decision_s : from the start of the command to the first decision, seconds, if any.
    sessions : the start of the run, and each time that it was gone on with; none where that is not
        known.
    problems_seen : what went wrong while it ran, a line each.
    books : what the conveyor wrote down; ``None`` when there is nothing that can be read.
    memory_mb : of each process, by name.
    offline : how many bins the placed boxes need without a belt, where somebody asked.
    """

    record: RunRecord
    options: RunOptions
    command: Sequence[str]
    wall_time_s: float
    first_decision_s: float | None
    problems_seen: Sequence[str] = ()
    books: BoxAccounts | None = None
    memory_mb: Mapping[str, Any] = field(default_factory=dict)
    offline: OfflineBins | None = None
    sessions: Sequence[RunSession] = ()

    @cached_property
    def _bins(self) -> tuple[list[BinFigures], list[BinFigures]]:
        return self.record.bin_figures(execution_profile(self.options))

    @property
    def closed_bins(self) -> list[BinFigures]:
        """The bins that were closed, in the order of opening."""
        return self._bins[0]

    @property
    def open_bins(self) -> list[BinFigures]:
        """The bins that stood in the cell at the end."""
        return self._bins[1]

    @property
    def all_bins(self) -> list[BinFigures]:
        """All of them."""
        return [*self.closed_bins, *self.open_bins]

    @cached_property
    def fills(self) -> dict[str, float | None]:
        """The three fill rates by name, percent; see :func:`pack_msgs_py.metrics.fill_metrics`."""
        return fill_metrics_of(
            [figures.fill_rate for figures in self.closed_bins if figures.boxes],
            [figures.fill_rate for figures in self.open_bins if figures.boxes],
        )

    @cached_property
    def violations(self) -> list[Violation]:
        """Every rule that a placement broke, but where people have changed a bin by hand."""
        return [
            broken
            for figures in self.all_bins
            if figures.bin_id not in self.record.bins_by_hand
            for broken in figures.violations
        ]

    @cached_property
    def unaccounted(self) -> list[str]:
        """Boxes that are not in exactly one place, or of which the books differ, a line each."""
        if self.books is None:
            return self.record.unaccounted()
        hidden = list(self.books.places.values()).count('unseen')
        return self.record.unaccounted(hidden) + disagreements(self.books, self.record)

    @property
    def working_s(self) -> float:
        """Wall seconds since the first decision of each session."""
        if self.sessions:
            return sum(session.working_s for session in self.sessions)
        return self.wall_time_s - (self.first_decision_s or 0.0)
