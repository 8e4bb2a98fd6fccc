"""Folders of runs that never were, for the tests of the report."""

import json
from pathlib import Path

#: A box in the front left corner of the bin LDC-1.
ROW = {
    'box_id': 'a',
    'size_mm': [596.0, 396.0, 201.0],
    'true_size_mm': [595.0, 395.0, 200.0],
    'weight_kg': 5.0,
    'destination': '',
    'bin_serial': 1,
    'bin_type': 'LDC',
    'bin_destination': '',
    'position_mm': [0, 0, 0],
    'placed_size_mm': [600, 400, 200],
    'orientation': 'xyz',
    'planning_s': 0.02,
    'check_s': 0.1,
    'arm_planning_s': 0.05,
    'wait_s': 0.5,
    'motion_s': 4.0,
    'slack_s': 1.4,
    'stamp_s': 10.0,
    'measured_position_mm': [298.5, 198.0, 100.0],
    'outcome': 'placed',
    'code': 'NONE',
    'reason': None,
}
REJECTED = dict.fromkeys(ROW) | {
    'box_id': 'too-long',
    'outcome': 'rejected',
    'reason': 'oversize: 1900 mm fit no bin',
    'stamp_s': 11.0,
}
SUMMARY = {
    'boxes_supplied': 1,
    'placed': 1,
    'rejected': 0,
    'lost': 0,
    'unaccounted': 0,
    'closed_bins': 0,
    'closings': [],
    'open_bins': 1,
    'fill_closed': None,
    'fill_all': 6.1,
    'deadline_s': 5.5,
    'deadline_misses': 0,
    'rule_violations': 0,
    'boxes_per_hour': 900.0,
    'bin': 'LDC',
    'boxes': 'cartons',
    'versions': {'python': '3.11'},
    'command': 'cell run --count 1',
    'problems': [],
    'profile': 'dense',
}


def write_folder(folder: Path, rows=(ROW,), fed: str = '', **summary) -> Path:
    """A folder with these rows, and ``SUMMARY`` with these changes; ``fed`` is its boxes.csv."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'summary.json').write_text(json.dumps(SUMMARY | summary))
    (folder / 'placements.jsonl').write_text(''.join(json.dumps(row) + '\n' for row in rows))
    if fed:
        lines = ('id,length_mm,width_mm,height_mm,weight_kg', *fed.split())
        (folder / 'boxes.csv').write_text('\n'.join(lines) + '\n')
    return folder


def closing(serial: int, reason: str = '') -> dict:
    """What a summary says of the closed bin ``serial``."""
    return {'bin': f'LDC-{serial}', 'boxes': 1, 'fill': 6.1, 'reason': reason}


def stacked(count: int, per_bin: int = 16):
    """Rows of ``count`` boxes, ``per_bin`` in a bin in layers of four, placed one after another."""
    rows = []
    for number in range(count):
        serial, at = divmod(number, per_bin)
        corner = [600 * (at % 2), 400 * (at // 2 % 2), 200 * (at // 4)]
        middle = [c + half for c, half in zip(corner, (298.0, 198.0, 100.0), strict=True)]
        rows.append(
            ROW
            | {
                'box_id': f'box-{number}',
                'bin_serial': serial + 1,
                'position_mm': corner,
                'measured_position_mm': middle,
                'stamp_s': float(number),
                'slack_s': 1.0 + 0.001 * (number % 7),
            }
        )
    return rows
