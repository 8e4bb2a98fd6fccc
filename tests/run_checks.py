"""What every run of a cell is checked for: each box in one place, and the rules in every bin."""

from __future__ import annotations

from collections.abc import Callable

from cell_process import CellProcess

from pack_cell.options.run_options import run_options
from pack_cell.report.ended_run import execution_profile
from pack_msgs_py.validator import validate_sequence
from pack_msgs_py.values import Box, PlacedBox, parse_bin

#: The fixture ``start_cell``.
StartCell = Callable[..., CellProcess]

#: Options of a run in which no box is late.
TIMED = ('--arm', 'timed', '--deadline', '60')


def replay(cell: CellProcess) -> dict[int, list[PlacedBox]]:
    """The placed boxes of the record by bin, in the order of the record."""
    bins: dict[int, list[PlacedBox]] = {}
    for row in cell.placements():
        if row['outcome'] != 'placed':
            continue
        placed = PlacedBox(
            Box(
                row['box_id'],
                tuple(row['size_mm']),
                row['weight_kg'],
                size_stddev_mm=tuple(row['size_stddev_mm']),
                yaw_stddev_rad=row['yaw_stddev_rad'],
            ),
            tuple(row['position_mm']),
            tuple(row['placed_size_mm']),
            row['orientation'],
            tuple(row['measured_position_mm']),
        )
        bins.setdefault(row['bin_serial'], []).append(placed)
    return bins


def assert_rules_hold(cell: CellProcess, bin_type: str, profile: str = 'cell') -> None:
    rules = execution_profile(run_options({'profile': profile}))
    for boxes in replay(cell).values():
        broken = validate_sequence(boxes, parse_bin(bin_type), rules)
        assert broken == [], '\n'.join(map(str, broken))


def assert_every_box_in_one_place(cell: CellProcess, count: int) -> None:
    summary, rows = cell.summary(), cell.placements()
    assert summary['boxes_supplied'] == count, cell.text()
    assert summary['placed'] + summary['rejected'] == count, cell.text()
    assert (summary['lost'], summary['unaccounted']) == (0, 0), summary['problems']
    assert len({row['box_id'] for row in rows}) == len(rows) == count
