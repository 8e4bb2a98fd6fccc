"""What went where, by the destinations that the bins serve."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pack_cell.report.archive import BinFigures
from pack_msgs_py.metrics import fill_metrics_of
from pack_msgs_py.wording import how_many


def destinations(
    closed: Sequence[BinFigures], still_open: Sequence[BinFigures]
) -> dict[str, dict[str, Any]]:
    """Boxes in the bins of each destination; empty where every bin takes any box."""
    names = sorted({figures.destination for figures in (*closed, *still_open)} - {''})
    return {name: _destination(name, closed, still_open) for name in names}


def _destination(
    name: str, closed: Sequence[BinFigures], still_open: Sequence[BinFigures]
) -> dict[str, Any]:
    gone, standing = (
        [figures for figures in bins if figures.destination == name and figures.boxes]
        for bins in (closed, still_open)
    )
    fills = fill_metrics_of(
        [figures.fill_rate for figures in gone], [figures.fill_rate for figures in standing]
    )
    return {
        'boxes': sum(figures.boxes for figures in (*gone, *standing)),
        'closed_bins': len(gone),
        'open_bins': len(standing),
        'fill_all': fills['fill_all'],
    }


def destinations_text(summary: dict[str, Any]) -> str:
    """One line for people; empty where there are no destinations."""
    counts = ', '.join(
        f'{name} {how_many(counted["boxes"], "box")} in {counted["closed_bins"]} + '
        f'{how_many(counted["open_bins"], "bin")}'
        for name, counted in summary['destinations'].items()
    )
    return f'{counts}; {summary["mis_sorts"]} mis-sorted' if counts else ''
