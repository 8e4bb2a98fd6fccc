"""What those who listen cost the cell: runs of one seed without them, with recorder, with page.

    ./cell python benchmarks/live_page.py --runs 5 --count 40
    ./cell python benchmarks/live_page.py --runs 1 --count 24 --speed 1 --only page
    ./cell python benchmarks/live_page.py --runs 1 --count 60 --kill 20

The runs go by turns. A row for each: processor time of the page, to start and then on, and of all
else; how many percent of the cell's the page takes once it is up; the 99th percentile of planning,
and of planning and asking the arm. Then what differs from the runs without listeners: planning box
by box, as far as the same box was placed at the same place, and how many were not.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

TICKS = os.sysconf('SC_CLK_TCK')
#: Who listens, and the options of `cell run` for it.
LISTENERS = {
    'nobody': ['--record', 'nothing'],
    'recorder': [],
    'page': ['--record', 'nothing', '--view', '--view-port', '0'],
    'both': ['--view', '--view-port', '0'],
}


def family(pid: int) -> Iterator[int]:
    """A process and all that it has started."""
    yield pid
    with contextlib.suppress(OSError):
        for task in list(Path(f'/proc/{pid}/task').glob('*/children')):
            for child in task.read_text().split():
                yield from family(int(child))


def processor_s(pid: int) -> float:
    """User and system time of a process."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def is_page(pid: int) -> bool:
    """Whether a process serves the page."""
    words = Path(f'/proc/{pid}/cmdline').read_bytes().split(b'\0')
    return b'pack_cell' in words and b'view' in words


@dataclass
class Spent:
    """Processor time of each process, as last seen."""

    page: dict[int, float] = field(default_factory=dict)
    rest: dict[int, float] = field(default_factory=dict)

    def look(self, root: int) -> None:
        """Read the processor time of all processes below ``root``."""
        for pid in family(root):
            with contextlib.suppress(OSError):
                (self.page if is_page(pid) else self.rest)[pid] = processor_s(pid)

    @property
    def sums(self) -> tuple[float, float]:
        """Seconds of the page, and of all else."""
        return sum(self.page.values()), sum(self.rest.values())


def kill_pages(environment: dict[str, str], times: int, run: subprocess.Popen[bytes]) -> int:
    """Start pages beside the run, two at once, and kill them, so many while the run goes on."""
    killed = 0
    while killed < times and run.poll() is None:
        pages = [
            subprocess.Popen(
                [sys.executable, '-m', 'pack_cell', 'view', '--port', '0'],
                stdout=subprocess.PIPE,
                env=environment,
            )
            for _ in range(min(2, times - killed))
        ]
        for page in pages:
            assert page.stdout is not None
            page.stdout.readline()
            # Anywhere between coming up and hearing everything.
            time.sleep(random.uniform(0.0, 0.5))
            page.send_signal(signal.SIGKILL)
            page.wait()
            page.stdout.close()
        killed += len(pages)
    return killed


def one_run(options: argparse.Namespace, who: str, kills: int = 0) -> list[dict[str, Any]]:
    """Run the cell once, print its row, and return its placements."""
    out = Path(tempfile.mkdtemp(prefix='live-page-')) / 'run'
    command = [sys.executable, '-m', 'pack_cell', 'run', '--quiet', '--count', str(options.count)]
    command += ['--speed', str(options.speed), '--arm', options.arm, '--out', str(out)]
    command += ['--seed', str(options.seed), *LISTENERS[who]]
    environment = dict(os.environ, ROS_DOMAIN_ID=str(options.domain))
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=environment)
    spent, up, killed = Spent(), (0.0, 0.0), 0
    shown = out / 'log' / 'view.log'
    while process.poll() is None:
        spent.look(process.pid)
        if up == (0.0, 0.0) and shown.exists() and 'is shown at' in shown.read_text():
            up = spent.sums
        if kills and not killed and (out / 'pids.json').exists():
            killed = kill_pages(environment, kills, process)
        time.sleep(0.05)
    if not (out / 'summary.json').exists():
        sys.exit(f'the run ended with code {process.returncode} and no summary')
    rows = [json.loads(line) for line in (out / 'placements.jsonl').read_text().splitlines()]
    rows = [row for row in rows if row['planning_s'] is not None]
    planning = [1e3 * row['planning_s'] for row in rows]
    whole = [1e3 * (row['planning_s'] + row['check_s']) for row in rows]
    page_s, rest_s = spent.sums
    share = 100 * (page_s - up[0]) / (page_s - up[0] + rest_s - up[1])
    summary = json.loads((out / 'summary.json').read_text())
    cells = (
        who + (f', killed {killed} times' if kills else ''),
        f'{up[0]:.1f} + {page_s - up[0]:.1f} s' if up[0] else '–',
        f'{rest_s:.1f} s',
        f'{share:.1f} %' if up[0] else '–',
        f'{np.percentile(planning, 99):.0f} ms',
        f'{np.percentile(whole, 99):.0f} ms',
        f'{summary["placed"]} of {options.count}',
        f'{len(summary["problems"])}',
        f'{process.returncode}',
    )
    print(f'| {" | ".join(cells)} |', flush=True)
    return rows


def placed_at(row: dict[str, Any]) -> tuple[Any, ...]:
    """Which box went where."""
    return row['box_id'], row['bin_serial'], *row['position_mm'], row['orientation']


def difference(who: str, pairs: list[Any]) -> str:
    """How planning with ``who`` differs from without, and whether the boxes went elsewhere."""
    shifts, elsewhere = list[float](), 0
    both: tuple[list[float], list[float]] = ([], [])
    for bare, listened in pairs:
        same = [
            (a, b) for a, b in zip(bare, listened, strict=False) if placed_at(a) == placed_at(b)
        ]
        elsewhere += max(len(bare), len(listened)) - len(same)
        shifts += [1e3 * (b['planning_s'] - a['planning_s']) for a, b in same]
        for times, rows in zip(both, (bare, listened), strict=True):
            times.extend(1e3 * row['planning_s'] for row in rows)
    half = stats.t.ppf(0.975, len(shifts) - 1) * stats.sem(shifts)
    p99 = [np.percentile(times, 99) for times in both]
    return (
        f'| {who} | {len(shifts)} | {np.mean(shifts):+.2f} ± {half:.2f} ms | '
        f'{np.median(shifts):+.2f} ms | {p99[0]:.0f} ms | {p99[1]:.0f} ms | {elsewhere} |'
    )


def main() -> None:
    """Run by turns and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--runs', type=int, default=3)
    parser.add_argument('--count', type=int, default=40)
    parser.add_argument('--speed', type=float, default=0.0)
    parser.add_argument('--arm', default='physics')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--domain', type=int, default=random.randrange(40, 100))
    parser.add_argument('--only', nargs='+', choices=LISTENERS, default=list(LISTENERS))
    parser.add_argument('--kill', type=int, default=0, help='kill a page so many times in a run')
    options = parser.parse_args()
    print('| who listens | page: start + then | the rest | page, of all | planning p99 '
          '| decision p99 | placed | problems | code |')  # fmt: skip
    print('|---|---|---|---|---|---|---|---|---|')
    pairs: dict[str, list[Any]] = {}
    for number in range(options.runs):
        if options.kill:
            bare = one_run(options, 'nobody') if 'nobody' in options.only else None
            killed = one_run(options, 'nobody', options.kill)
            if bare is not None:
                pairs.setdefault('page, killed', []).append((bare, killed))
            continue
        # In another order each time, so that nobody always comes first.
        turn = number % len(options.only)
        rows = {who: one_run(options, who) for who in options.only[turn:] + options.only[:turn]}
        for who in rows.keys() - {'nobody'} if 'nobody' in rows else ():
            pairs.setdefault(who, []).append((rows['nobody'], rows[who]))
    if pairs:
        print('\n| against nobody | boxes | planning, mean | median | p99 without | p99 with '
              '| placed elsewhere |')  # fmt: skip
        print('|---|---|---|---|---|---|---|')
        for who, of_who in sorted(pairs.items()):
            print(difference(who, of_who))


if __name__ == '__main__':
    main()
