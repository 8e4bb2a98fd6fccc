"""Bins that are part-filled at the start: from the books of an earlier run, or from a file of them.

The form of a file is that of ``cell journal export``: ``journal.json`` with ``bins`` and
``placements``. Of it only the bins that were not closed count, and the boxes in them.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from arm_executor.bins.journal import FILE_NAME
from arm_executor.bins.journal_reader import JournalError, read_journal
from arm_executor.bins.records import Step
from pack_msgs_py.box_codec import placed_from_json, pose_from_data
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.profiles import Profile
from pack_msgs_py.validator import validate_sequence
from pack_msgs_py.values import STATIONS, Bin, BinSpec, PlacedBox, parse_bin

_FORMAT = 1


class StartBinsError(ValueError):
    """The bins to begin with cannot be used; the text says which, and why."""


@dataclass(frozen=True)
class StartBin:
    """A bin to begin with, and the pose of the centre of each box in it, bin frame, by id."""

    bin: Bin
    poses: Mapping[str, Pose]


def read_start_bins(path: Path) -> tuple[StartBin, ...]:
    """The open bins of ``path``, oldest first: folder of a run, its journal, or a JSON file.

    Raises
    ------
    StartBinsError
        There is no such thing, or it cannot be read.
    """
    path = path.expanduser()
    places = (path / 'state' / FILE_NAME, path / FILE_NAME) if path.is_dir() else (path,)
    found = next((place for place in places if place.is_file()), None)
    if found is None:
        msg = f'{path} holds no bins to begin with: no run, and no file of them'
        raise StartBinsError(msg)
    if found.suffix == '.json':
        return _of_file(found)
    try:
        with read_journal(found) as journal:
            return tuple(
                StartBin(
                    standing,
                    {a.placed.box.id: a.pose for a in journal.attempts_in(standing.serial)},
                )
                for standing in journal.open_bins()
            )
    except JournalError as error:
        msg = f'no bins can be begun with: {error}'
        raise StartBinsError(msg) from None


def check_start_bins(
    start: Sequence[StartBin], spec: BinSpec, count: int, profile: Profile
) -> None:
    """Refuse bins that a cell with ``count`` bins of kind ``spec`` cannot go on with.

    Raises
    ------
    StartBinsError
        A bin is of another kind or stands where none will, or its boxes break a rule of
        ``profile``.
    """
    for first in start:
        name, station = first.bin.id, first.bin.station
        if first.bin.spec != spec:
            msg = f'bin {name} to begin with is of kind {first.bin.spec.name}, here are {spec.name}'
            raise StartBinsError(msg)
        if station not in STATIONS[:count]:
            msg = f'bin {name} to begin with stands at {station}; of {count} bins none stands there'
            raise StartBinsError(msg)
        broken = validate_sequence(first.bin.boxes, spec, profile, first.bin.destination)
        if broken:
            msg = (
                f'bin {name} to begin with was packed by other rules: {broken[0]}; '
                'take the options that it was packed with'
            )
            raise StartBinsError(msg)
    stations = [first.bin.station for first in start]
    if len(set(stations)) < len(stations):
        msg = f'bins to begin with stand at {", ".join(stations)}: one at a time can stand at each'
        raise StartBinsError(msg)


def renamed(start: Sequence[StartBin], is_taken: Callable[[str], bool]) -> tuple[StartBin, ...]:
    """The same bins, boxes with a name that ``is_taken`` called ``NAME@start`` instead."""

    def name(box_id: str) -> str:
        while is_taken(box_id):
            box_id += '@start'
        return box_id

    return tuple(
        StartBin(
            replace(
                first.bin,
                boxes=tuple(
                    replace(placed, box=replace(placed.box, id=name(placed.box.id)))
                    for placed in first.bin.boxes
                ),
            ),
            {name(box_id): pose for box_id, pose in first.poses.items()},
        )
        for first in start
    )


def write_start_bins(path: Path, start: Sequence[StartBin]) -> None:
    """Write bins so that :func:`read_start_bins` reads them; ``OSError`` when it cannot be."""
    data = {
        'format': _FORMAT,
        'bins': [
            {
                'bin_id': first.bin.id,
                'serial': first.bin.serial,
                'kind': first.bin.spec.name,
                'station': first.bin.station,
                'destination': first.bin.destination,
                'closed': None,
            }
            for first in start
        ],
        'placements': [
            {
                'bin_serial': first.bin.serial,
                'step': Step.VERIFIED.value,
                'box': asdict(placed.box),
                'corner_mm': placed.corner_mm,
                'planned_size_mm': placed.size_mm,
                'orientation': placed.orientation,
                'measured': asdict(first.poses[placed.box.id]),
            }
            for first in start
            for placed in first.bin.boxes
        ],
    }
    path.write_text(json.dumps(data, indent=1) + '\n', encoding='utf-8')


def _of_file(path: Path) -> tuple[StartBin, ...]:
    try:
        data = json.loads(path.read_text(encoding='utf-8'))
        if data['format'] != _FORMAT:
            msg = f'format {data["format"]}, {_FORMAT} can be read'
            raise ValueError(msg)
        standing = [row for row in data['bins'] if row['closed'] is None]
        return tuple(_of_rows(row, data['placements']) for row in standing)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        what = f'{type(error).__name__} {error}' if isinstance(error, KeyError) else str(error)
        msg = f'{path} holds no bins to begin with: {what}'
        raise StartBinsError(msg) from None


def _of_rows(row: Mapping[str, Any], placements: Sequence[Mapping[str, Any]]) -> StartBin:
    inside = [
        placement
        for placement in placements
        if placement['bin_serial'] == row['serial'] and Step(placement['step']).in_bin
    ]
    poses = [
        pose_from_data(placement.get('measured') or placement['target']) for placement in inside
    ]
    boxes = tuple(_placed(placement) for placement in inside)
    known = Bin(
        id=str(row['bin_id']),
        serial=int(row['serial']),
        spec=parse_bin(str(row['kind'])),
        boxes=boxes,
        station=str(row['station']),
        destination=str(row['destination']),
    )
    ids = [placed.box.id for placed in boxes]
    return StartBin(known, dict(zip(ids, poses, strict=True)))


def _placed(placement: Mapping[str, Any]) -> PlacedBox:
    record = {
        'box': placement['box'],
        'corner_mm': placement['corner_mm'],
        'size_mm': placement['planned_size_mm'],
        'orientation': placement['orientation'],
    }
    return placed_from_json(json.dumps(record))
