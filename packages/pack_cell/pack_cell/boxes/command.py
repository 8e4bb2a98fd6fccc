"""``cell boxes``: show what was understood of a box list, and write it in our own format."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from arm_executor.model.layout import LayoutError, lifting_limit
from arm_executor.reach.layout_file import find_layout
from conveyor_sim.streams import (
    BoxFileError,
    BoxList,
    RejectedRow,
    open_source,
    read_boxes,
    write_boxes,
)
from conveyor_sim.streams.by_name import is_file
from pack_cell.boxes.findings import Unsuited, cannot_lift, cannot_ride, fitting, histogram
from pack_cell.options.declaration import DEFAULT_PROFILE
from pack_cell.options.parsers import bin_kind, whole
from pack_cell.options.shared import add_cell_layout, add_profile, add_reading, reading_of
from pack_cell.running.screen import Screen
from pack_msgs_py.profiles import find_profile
from pack_msgs_py.values import BIN_KINDS, BIN_TYPES, UP_ANY, Box
from pack_msgs_py.wording import how_many

EXIT_OK, EXIT_REJECTED, EXIT_USAGE = 0, 1, 2
_BAR = 40


def add_boxes(verbs: Any) -> None:  # noqa: ANN401 - argparse does not name its subparsers
    """Add ``cell boxes`` to the command line."""
    parser = verbs.add_parser(
        'boxes',
        help='show what is understood of a box list, and what of it can be packed',
        description='Shows which columns of a box file are understood and in which units, what '
        'is not, the first boxes, their sizes, which bins they fit, and what belt and arm cannot '
        'take. Exit code 0: every row is a box; 1: some are rejected; 2: the file cannot be used, '
        'and why.',
    )
    parser.add_argument('boxes', metavar='FILE', help='box file, or a stream by name')
    add_reading(parser, orders=True)
    parser.add_argument(
        '-o', '--output', type=Path, metavar='FILE', help='write the boxes in our own format (CSV)'
    )
    parser.add_argument(
        '--rows', type=whole(0, 1_000_000), default=5, metavar='N', help='boxes to show (default 5)'
    )
    parser.add_argument(
        '--bin', type=bin_kind, action='append', dest='bins', metavar='KIND',
        help=f'kind of bin to try, may be given again: {BIN_KINDS}; default: all with a name',
    )  # fmt: skip
    add_profile(parser, DEFAULT_PROFILE)
    add_cell_layout(parser)


def run_boxes(options: argparse.Namespace) -> int:
    """Do what ``options`` say; return the exit code."""
    screen = Screen()
    try:
        found = _read(options)
        layout = find_layout(options.layout, options.robot)
        boxes = [entry for entry in found.entries if isinstance(entry, Box)]
        rejected = [entry for entry in found.entries if isinstance(entry, RejectedRow)]
        profile = find_profile(options.profile)
        limits = (lifting_limit(layout), profile.max_payload_kg or math.inf)
        lines = [
            *_understood(options.boxes, found, boxes, rejected, options.rows),
            *_sizes(boxes),
            *_fits(boxes, options),
            *_problems('cannot ride on the belt', cannot_ride(boxes)),
            *_problems(
                f'too heavy for {layout.robot}, which lifts {min(limits):g} kg',
                cannot_lift(boxes, min(limits)),
            ),
            *_honoured(boxes, honours_loads=profile.check_top_load, profile=options.profile),
        ]
        for line in lines:
            screen.tell(line)
        if options.output:
            write_boxes(options.output, boxes)
            left_out = f', without {how_many(len(rejected), "rejected row")}' if rejected else ''
            screen.tell(f'written: {how_many(len(boxes), "box")} to {options.output}{left_out}')
    except (BoxFileError, LayoutError, OSError) as error:
        print(f'cell boxes: {error}', file=sys.stderr)
        return EXIT_USAGE
    return EXIT_REJECTED if rejected else EXIT_OK


def _read(options: argparse.Namespace) -> BoxList:
    reading = reading_of(options)
    if is_file(options.boxes):
        return read_boxes(options.boxes, reading)
    source = open_source(options.boxes, reading=reading)
    return BoxList(source.turn(0), notes=source.notes)


def _understood(
    name: str, found: BoxList, boxes: Sequence[Box], rejected: Sequence[RejectedRow], rows: int
) -> Iterator[str]:
    yield f'{name}: {how_many(len(boxes), "box")}, {how_many(len(rejected), "rejected row")}'
    for use in found.columns:
        part = '' if use.part is None else f', number {use.part + 1} of 3'
        unit = f' in {use.unit}' if use.unit else ''
        origin = f' (by {use.unit_from})' if use.unit_from else ''
        mark = f', decimal {use.decimal}' if use.decimal == 'comma' else ''
        yield f'  {use.meaning:<13} is {use.header!r}{part}{unit}{origin}{mark}'
    for note in found.notes:
        yield f'note: {note}'
    for row in rejected[:rows]:
        yield f'rejected: {row.text}'
    if len(rejected) > rows:
        yield f'rejected: {len(rejected) - rows} more'
    if boxes and rows:
        yield 'first boxes (mm, kg)'
    for box in boxes[:rows]:
        size = 'x'.join(f'{edge:g}' for edge in box.size_mm)
        more = [] if box.allowed_up == UP_ANY else [f'allowed_up {box.allowed_up}']
        if box.max_top_load_n is not None:
            more.append(f'carries {box.max_top_load_n:g} N')
        if box.destination:
            more.append(f'to {box.destination}')
        more += [f'{key} {text}' for key, text in box.extra if key in ('sku', 'order_id')]
        yield f'  {box.id:<24} {size:>16}  {box.weight_kg:>7g}  {", ".join(more)}'.rstrip()


def _sizes(boxes: Sequence[Box]) -> Iterator[str]:
    classes = histogram(boxes)
    most = max((count for _, count in classes), default=0)
    if classes:
        yield 'longest edge'
    for name, count in classes:
        yield f'  {name:>16}  {"#" * math.ceil(_BAR * count / most)} {count}'


def _fits(boxes: Sequence[Box], options: argparse.Namespace) -> Iterator[str]:
    profile = find_profile(options.profile)
    yield f'fit an empty bin, with the margins of {options.profile}'
    for spec in options.bins or BIN_TYPES.values():
        upright = fitting(boxes, spec, profile, 'upright')
        turned = fitting(boxes, spec, profile, 'any')
        share = f'{upright} of {len(boxes)} upright'
        yield f'  {spec.name:<8} {share}' + (f', {turned} on any face' if turned > upright else '')


def _problems(what: str, found: Unsuited) -> Iterator[str]:
    if not found:
        return
    shown = [f'{box.id} ({words})' for box, words in zip(found.boxes, found.words, strict=True)]
    more = f' and {len(shown) - 5} more' if len(shown) > 5 else ''
    yield f'{what}: {len(shown)}: {", ".join(shown[:5])}{more}'


def _honoured(boxes: Sequence[Box], *, honours_loads: bool, profile: str) -> Iterator[str]:
    upright = sum(box.allowed_up != UP_ANY for box in boxes)
    bare = sum(box.max_top_load_n == 0 for box in boxes)
    limited = sum(bool(box.max_top_load_n) for box in boxes)
    if upright:
        yield f'{how_many(upright, "box")} may stand on some faces alone'
    if bare or limited:
        but = '' if honours_loads else f', which profile {profile} does not heed'
        carry = 'carries' if bare == 1 else 'carry'
        yield f'{how_many(bare, "box")} {carry} nothing on top, {limited} a limited load{but}'
