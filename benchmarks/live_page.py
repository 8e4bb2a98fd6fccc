"""What the live page costs the cell: runs with and without it, by turns; with --kill, killed again.

    ./cell python benchmarks/live_page.py --runs 3 --count 40
    ./cell python benchmarks/live_page.py --runs 1 --count 60 --kill 20

Prints, for each run, the processor time of the page and of all else, and the 99th percentile of
planning and of the whole decision (planning and asking the arm).
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
from pathlib import Path

import numpy as np

TICKS = os.sysconf('SC_CLK_TCK')
PAGE, REST = 'page', 'rest'


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


def kill_pages(environment: dict[str, str], times: int) -> None:
    """Start a page beside the run and kill it, so many times."""
    for _ in range(times):
        page = subprocess.Popen(
            [sys.executable, '-m', 'pack_cell', 'view', '--port', '0'],
            stdout=subprocess.PIPE,
            env=environment,
        )
        assert page.stdout is not None
        page.stdout.readline()
        page.send_signal(signal.SIGKILL)
        page.wait()
        page.stdout.close()


def one_run(options: argparse.Namespace, *, with_page: bool) -> str:
    """A row of the table."""
    out = Path(tempfile.mkdtemp(prefix='live-page-')) / 'run'
    command = [sys.executable, '-m', 'pack_cell', 'run', '--quiet', '--count', str(options.count)]
    command += ['--speed', str(options.speed), '--arm', options.arm, '--out', str(out)]
    command += ['--view', '--view-port', '0'] if with_page else []
    environment = dict(os.environ, ROS_DOMAIN_ID=str(options.domain))
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=environment)
    spent: dict[str, dict[int, float]] = {PAGE: {}, REST: {}}
    killed = not (with_page and options.kill)
    while process.poll() is None:
        for pid in family(process.pid):
            try:
                spent[PAGE if is_page(pid) else REST][pid] = processor_s(pid)
            except OSError:
                continue
        if not killed and (out / 'pids.json').exists():
            killed = True
            kill_pages(environment, options.kill)
        time.sleep(0.05)
    if not (out / 'summary.json').exists():
        sys.exit(f'the run ended with code {process.returncode} and no summary')
    rows = [json.loads(line) for line in (out / 'placements.jsonl').read_text().splitlines()]
    planning = [row['planning_s'] for row in rows if row['planning_s'] is not None]
    whole = [row['planning_s'] + row['check_s'] for row in rows if row['planning_s'] is not None]
    page_s, rest_s = (sum(spent[part].values()) for part in (PAGE, REST))
    share = f'{100 * page_s / (page_s + rest_s):.1f} %' if with_page else '–'
    summary = json.loads((out / 'summary.json').read_text())
    return (
        f'| {"yes" if with_page else "no"} | {page_s:.1f} s | {rest_s:.1f} s | {share} | '
        f'{1e3 * np.percentile(planning, 99):.0f} ms | {1e3 * np.percentile(whole, 99):.0f} ms | '
        f'{summary["placed"]} of {options.count} | {process.returncode} |'
    )


def main() -> None:
    """Run by turns and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--runs', type=int, default=3)
    parser.add_argument('--count', type=int, default=40)
    parser.add_argument('--speed', type=float, default=0.0)
    parser.add_argument('--arm', default='physics')
    parser.add_argument('--domain', type=int, default=random.randrange(40, 100))
    parser.add_argument('--kill', type=int, default=0)
    options = parser.parse_args()
    print('| page | page, CPU | the rest | share | planning p99 | decision p99 | placed | code |')
    print('|---|---|---|---|---|---|---|---|')
    for _ in range(options.runs):
        for with_page in (False, True):
            print(one_run(options, with_page=with_page), flush=True)


if __name__ == '__main__':
    main()
