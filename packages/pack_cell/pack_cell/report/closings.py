"""Why bins were closed, one by one and all together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from pack_cell.report.archive import BinFigures
from pack_msgs_py.closing import Cause, ClosingReason, refusal_text
from pack_msgs_py.codes import ErrorCode


def closings(closed: Sequence[BinFigures]) -> list[dict[str, Any]]:
    """Each closed bin as plain data: boxes, fill in percent, and why the planner closed it."""
    return [_closing(figures) for figures in closed]


def _closing(figures: BinFigures) -> dict[str, Any]:
    reason = figures.reason or ClosingReason(figures.bin_id)
    return {
        'bin': figures.bin_id,
        'boxes': figures.boxes,
        'fill': 100.0 * figures.fill_rate,
        'reason': '' if figures.reason is None else reason.text,
        'causes': {cause.value: number for cause, number in reason.causes.items()},
        'arm_asked': reason.asked,
        'arm_refused': {code.name: number for code, number in reason.refused.items()},
    }


def closings_text(rows: Sequence[dict[str, Any]]) -> str:
    """One line for people over all bins; empty where the planner closed none."""
    causes: Counter[Cause] = Counter()
    refused: Counter[ErrorCode] = Counter()
    for row in rows:
        causes.update({Cause(name): number for name, number in row['causes'].items()})
        refused.update({ErrorCode[name]: number for name, number in row['arm_refused'].items()})
    if not causes:
        return ''
    whole = ClosingReason('', causes)
    arm = refusal_text(sum(row['arm_asked'] for row in rows), refused)
    return '; '.join(filter(None, (whole.text.partition(': ')[2], arm)))
