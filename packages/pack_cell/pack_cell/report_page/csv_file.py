"""The boxes of runs as CSV, for spreadsheets."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from pack_cell.report_page.run_folder import ARTICLE_KEYS, FinishedRun, InBin, RunBox
from pack_cell.report_page.work_order import packing_steps

COLUMNS = (
    'run', 'bin', 'step', 'box', *ARTICLE_KEYS, 'outcome', 'reason', 'destination', 'length_mm',
    'width_mm',
    'height_mm', 'weight_kg', 'layer', 'x_mm', 'y_mm', 'z_mm', 'along_x_mm', 'along_y_mm',
    'up_mm', 'way_up', 'motion_s', 'slack_s', 'planning_s', 'attributes',
)  # fmt: skip
#: A cell that begins so would be run as a formula by a spreadsheet.
_FORMULA = ('=', '+', '-', '@', '\t', '\r', '\n')


def as_text(text: str) -> str:
    """``text`` so that a spreadsheet shows it and does not calculate it."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def write_csv(path: Path, runs: Sequence[FinishedRun]) -> None:
    """A line per box: bin by bin in the order of placing, then what is in no bin."""
    with path.open('w', encoding='utf-8', newline='') as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for run in runs:
            writer.writerows(_rows(run))


def _rows(run: FinishedRun) -> Iterable[tuple[object, ...]]:
    for of_run in run.bins:
        for step in packing_steps(of_run):
            yield _row(run, step.placed.box, of_run.name, step.placed, step.layer, step.turned)
    for box in run.boxes:
        if box.serial is None:
            yield _row(run, box)


def _row(
    run: FinishedRun,
    box: RunBox,
    bin_name: str = '',
    placed: InBin | None = None,
    layer: int | str = '',
    turned: str = '',
) -> tuple[object, ...]:
    none = ('', '', '')
    return (
        as_text(run.name),
        as_text(bin_name),
        '' if placed is None else placed.step,
        as_text(box.id),
        *(as_text(box.attributes.get(key, '')) for key in ARTICLE_KEYS),
        as_text(box.outcome),
        as_text(box.reason or ''),
        as_text(box.destination),
        *(box.size_mm or none),
        _cell(box.weight_kg),
        layer,
        *(none if placed is None else placed.corner_mm),
        *(none if placed is None else placed.size_mm),
        turned,
        _cell(box.motion_s),
        _cell(box.slack_s),
        _cell(box.planning_s),
        as_text(
            '; '.join(
                f'{key}={text}' for key, text in box.attributes.items() if key not in ARTICLE_KEYS
            )
        ),
    )


def _cell(value: float | None) -> object:
    return '' if value is None else value
