#!/usr/bin/env python3
"""Memory, open files and logs of a cell that packs for long.

Begins `cell run` with a cheap algorithm and the timed arm as fast as possible, and measures every
process each time so many boxes more are in their bins. What a process grows by is the slope of a
straight line through its memory after the warm-up.

    ./cell python benchmarks/soak.py --boxes 10000 --csv soak.csv

Exit code 1 when a process grows by more than 5 MB per 1000 boxes, holds more files at the end than
after the warm-up, or lets a log grow beyond what is rotated.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import sqlite3
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pack_cell.running.log_rotation import MOST_BYTES
from pack_cell.running.memory import resident_mb

CHEAP = ('--arm', 'timed', '--deadline', '60', '--speed', '0', '--algorithm', 'mpack_lite')
MOST_MB = 5.0
#: Files that a process may open now and then: a log that is read, a connection to the graph.
FILES_MORE = 3
LOOK_S = 1.0


@dataclass(frozen=True)
class Sample:
    """A process when so many boxes are in bins."""

    boxes: int
    name: str
    memory_mb: float
    files: int


def placed(folder: Path) -> int:
    """Boxes that are in bins by the journal."""
    path = folder / 'state' / 'executor.sqlite'
    if not path.exists():
        return 0
    db = sqlite3.connect(f'file:{path}?mode=ro', uri=True, timeout=1.0)
    try:
        statement = "SELECT count(*) FROM attempt WHERE step = 'verified'"
        return int(db.execute(statement).fetchone()[0])
    except sqlite3.OperationalError:
        return 0
    finally:
        db.close()


def measured(folder: Path, cell: int, boxes: int) -> list[Sample]:
    """Every process of the cell now."""
    pids = {**json.loads((folder / 'pids.json').read_text()), 'cell': cell}
    found = []
    for name, pid in pids.items():
        memory = resident_mb(pid)
        try:
            files = len(os.listdir(f'/proc/{pid}/fd'))
        except OSError:
            continue
        if memory is not None:
            found.append(Sample(boxes, name, memory, files))
    return found


def told_of(samples: list[Sample], name: str, warm: int) -> tuple[str, bool]:
    """A row of the table for one process, and whether it is as it should be."""
    late = [sample for sample in samples if sample.name == name and sample.boxes >= warm]
    if len(late) < 2:
        return f'| {name} | too short to tell | | | |', False
    boxes = np.array([sample.boxes for sample in late])
    memory = np.array([sample.memory_mb for sample in late])
    growth = 1000.0 * float(np.polyfit(boxes, memory, 1)[0])
    first, last = late[0], late[-1]
    right = growth < MOST_MB and last.files <= first.files + FILES_MORE
    row = (
        f'| {name} | {first.memory_mb:.0f} | {last.memory_mb:.0f} | {growth:.2f} '
        f'| {first.files} to {last.files} |'
    )
    return row, right


def main() -> int:
    """Run, measure, tell."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('--boxes', type=int, default=10_000)
    parser.add_argument('--every', type=int, default=100, help='boxes between two measurements')
    parser.add_argument('--warm', type=int, default=1000, help='boxes of the warm-up')
    parser.add_argument('--minutes', type=float, default=600.0, help='end it after so long')
    parser.add_argument('--csv', type=Path, help='where the measurements go as they come')
    parser.add_argument('--out', type=Path, help='folder of the run')
    parser.add_argument('run', nargs='*', help='further arguments of cell run, behind --')
    options = parser.parse_args()
    folder = options.out or Path(tempfile.mkdtemp(prefix='soak_')) / 'run'
    given = ['--count', str(options.boxes), '--out', str(folder), '--quiet', *options.run]
    cell = subprocess.Popen([sys.executable, '-m', 'pack_cell', 'run', *CHEAP, *given])
    samples: list[Sample] = []
    began_s, aim = time.monotonic(), options.every
    with (options.csv or folder.with_suffix('.csv')).open('w', newline='') as out:
        writer = csv.writer(out)
        writer.writerow(['boxes', 'process', 'memory_mb', 'open_files'])
        while cell.poll() is None:
            time.sleep(LOOK_S)
            boxes = placed(folder)
            if boxes >= aim:
                now = measured(folder, cell.pid, boxes)
                samples += now
                writer.writerows((s.boxes, s.name, s.memory_mb, s.files) for s in now)
                out.flush()
                aim = boxes + options.every
            if time.monotonic() - began_s > 60.0 * options.minutes:
                cell.terminate()
                cell.wait()
    minutes = (time.monotonic() - began_s) / 60.0
    rows = [told_of(samples, name, options.warm) for name in dict.fromkeys(s.name for s in samples)]
    logs = {path.name: path.stat().st_size for path in (folder / 'log').iterdir()}
    print(f'{placed(folder)} boxes in {minutes:.0f} minutes, exit code {cell.returncode}')
    print('| process | MB after the warm-up | MB at the end | MB per 1000 boxes | open files |')
    print('|---|---|---|---|---|')
    print(*(row for row, _ in rows), sep='\n')
    print('logs, kB:', ', '.join(f'{name} {size // 1000}' for name, size in sorted(logs.items())))
    right = bool(rows) and all(fine for _, fine in rows)
    return 0 if right and max(logs.values(), default=0) <= 2 * MOST_BYTES else 1


if __name__ == '__main__':
    sys.exit(main())
