"""Options of a run: what to pack."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from conveyor_sim.streams import SYNTAX, Reading, UnclearBoxFile, load_boxes, resolved
from pack_cell.options.declaration import option
from pack_cell.options.parsers import bin_kind, checked, optional_path, whole
from pack_msgs_py.values import BIN_KINDS, BinSpec

_GROUP = 'what to pack'


def readable_boxes(choice: str) -> None:
    """Refuse boxes that cannot be read, whatever other options say of their file."""
    with suppress(UnclearBoxFile):
        load_boxes(choice)


@dataclass(frozen=True)
class WhatToPack:
    """Of a run: what to pack. Lengths in millimetres, times in seconds."""

    boxes: str = option(
        '',
        'the boxes: a file or a stream by name',
        _GROUP,
        read=checked(readable_boxes),
        metavar='BOXES',
        values=SYNTAX,
        default_text="cartons, the project's own stream of 40",
        see='../packages/conveyor_sim/README.md#streams-by-name',
        parameters=('conveyor.boxes_file',),
        as_parameter=resolved,
    )
    units: str = option(
        '',
        'units of a box file that does not say them',
        _GROUP,
        read=checked(Reading),
        metavar='UNITS',
        values='a length, a weight or both, such as `cm,kg`, `in,lb` or `g`',
        default_text='as the file says',
        see='box_lists.md',
        parameters=('conveyor.units',),
    )
    decimal: str = option(
        '',
        'decimal mark of a box file, where its numbers do not tell',
        _GROUP,
        read=checked(lambda text: Reading(decimal=text)),
        metavar='MARK',
        values='`point` or `comma`',
        default_text='as the file says',
        see='box_lists.md',
        parameters=('conveyor.decimal',),
    )
    order_by: str = option(
        '',
        'column of a box file by whose values orders keep apart: a bin takes boxes of one order, '
        'instead of one destination',
        _GROUP,
        metavar='ORDER',
        see='box_lists.md',
        parameters=('conveyor.order_by',),
    )
    count: int = option(
        '0',
        'number of boxes; more than the file holds repeats it, or more are made; 0: all of it once',
        _GROUP,
        read=whole(0, 1_000_000),
        metavar='N',
        parameters=('conveyor.count',),
    )
    seed: int = option(
        '0',
        '0: boxes in the order of the file; else they are shuffled with this seed',
        _GROUP,
        read=whole(0, 2**31 - 1),
        metavar='N',
        parameters=('conveyor.seed',),
        in_summary=True,
    )
    bin_spec: BinSpec = option(
        'LDC',
        'kind of every bin',
        _GROUP,
        name='bin',
        read=bin_kind,
        metavar='KIND',
        values=BIN_KINDS,
        parameters=('arm_executor.bin_type',),
        as_parameter=lambda spec: spec.name,
    )
    start_bins: Path | None = option(
        '',
        'begin with part-filled bins: the open ones of an earlier run, by its folder, or of a file '
        'of `cell journal export`',
        _GROUP,
        read=optional_path,
        metavar='DIR|FILE',
        default_text='empty bins',
        see='reliability.md#begin-with-part-filled-bins',
        parameters=('arm_executor.start_bins',),
        as_parameter=lambda path: str(path.resolve()) if path else '',
    )
    open_bins: int = option(
        '2',
        'bins open at a time',
        _GROUP,
        read=whole(1, 3),
        metavar='N',
        parameters=('arm_executor.open_bins',),
    )
    destinations: int = option(
        '0',
        'give each box that has none one of N destinations, D1 to DN, at random, and the bins to '
        'them in turn; 0: none, any box goes into any bin',
        _GROUP,
        read=whole(0, 1000),
        metavar='N',
        see='destinations.md',
        parameters=('conveyor.destinations',),
    )
    serve: str = option(
        '',
        'destinations that the bins serve at the start, with commas between them, where the boxes '
        'bring their own',
        _GROUP,
        metavar='NAMES',
        default_text='those of `--destinations`',
        see='destinations.md',
    )
