#!/usr/bin/env python3
"""Cut a run at random instants, go on with it, and check where every box is.

Each trial begins `cell run` in a fresh folder, sends SIGKILL to it and to its three nodes at once
at a random instant, deletes the box file, goes on by `cell run --resume`, is cut again, and so on
until the run has been cut as often as asked; then it is let go on to its end. After each cut and at
the end a checker of its own reads the SQLite files (`pack_cell.chaos.book_checker`). With
`--phases` only the arm's node is killed, once behind each step that the journal writes, under
`--respawn`.

    ./cell python tests/chaos/power_cuts.py --trials 20 --cuts 10 --boxes 100
    ./cell python tests/chaos/power_cuts.py --trials 2 --cuts 4 --boxes 20 --physics
    ./cell python tests/chaos/power_cuts.py --trials 2 --phases --boxes 30
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

from pack_cell.chaos.book_checker import check_books, check_run

#: Steps of the journal after which the arm's node is killed.
STEPS = ('planned', 'picked', 'releasing', 'placed', 'verified')
#: From the start of a run to its first decision, seconds: cuts come later than that by this much.
WARM_S = 0.5
TIMED = ('--arm', 'timed', '--deadline', '60', '--speed', '0', '--algorithm', 'mpack_lite')
#: On a busy machine nodes take long to start, which is no stall.
PATIENCE_S = 600.0


@dataclass
class Trial:
    """One run: how often it was cut, what was wrong, and how long it took to go on, seconds."""

    cuts: int = 0
    wrong: list[str] = field(default_factory=list)
    back_s: list[float] = field(default_factory=list)


class CutRun:
    """A run in ``folder`` that is cut and gone on with; ``arguments`` are those of `cell run`."""

    def __init__(self, folder: Path, arguments: list[str], domain: int | None) -> None:
        self.folder = folder
        self._arguments = arguments
        self._env = dict(os.environ)
        if domain is not None:
            self._env['ROS_DOMAIN_ID'] = str(domain)
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Begin the run, or go on with it when it has been begun."""
        begun = (self.folder / 'config' / 'run.json').exists()
        how = ['--resume', str(self.folder)] if begun else self._arguments
        if not begun:
            shutil.rmtree(self.folder, ignore_errors=True)
        (self.folder.parent / 'screen.log').touch()
        with (self.folder.parent / 'screen.log').open('ab') as screen:
            self._process = subprocess.Popen(
                [sys.executable, '-m', 'pack_cell', 'run', *how, *(['--quiet'] * (not begun))],
                stdout=screen,
                stderr=subprocess.STDOUT,
                env=self._env,
            )

    def placed(self) -> int:
        """Boxes that are in bins by the journal."""
        path = self.folder / 'state' / 'executor.sqlite'
        return len(query(path, "SELECT id FROM attempt WHERE step = 'verified'"))

    def wait_for_placed(self, more: int) -> bool:
        """Wait until ``more`` boxes are in bins than now; ``False`` when the run ends before."""
        aim, end = self.placed() + more, time.monotonic() + PATIENCE_S
        while self.placed() < aim:
            if self.ended() or time.monotonic() > end:
                return False
            time.sleep(0.01)
        return True

    def ended(self) -> bool:
        """Whether the run has come to an end by itself."""
        return self._process is None or self._process.poll() is not None

    def cut(self) -> None:
        """Kill all of it at once."""
        assert self._process is not None
        pids = json.loads((self.folder / 'pids.json').read_text()).values()
        for pid in (self._process.pid, *pids):
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        self._process.wait()

    def kill_arm_after(self, step: str) -> bool:
        """Kill the arm's node as soon as the newest placement is at ``step``."""
        path = self.folder / 'state' / 'executor.sqlite'
        end = time.monotonic() + PATIENCE_S
        while not self.ended() and time.monotonic() < end:
            newest = query(path, 'SELECT step FROM attempt ORDER BY id DESC LIMIT 1')
            if newest == [(step,)]:
                pid = json.loads((self.folder / 'pids.json').read_text())['arm_executor']
                os.kill(pid, signal.SIGKILL)
                return True
            time.sleep(0.0005)
        return False

    def finish(self) -> int | None:
        """Wait for the end; its exit code, ``None`` when it does not come."""
        assert self._process is not None
        try:
            return self._process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.cut()
            return None

    def screen(self) -> str:
        """The last lines that it printed."""
        text = (self.folder.parent / 'screen.log').read_text(errors='replace')
        return '\n'.join(text.splitlines()[-12:])


def query(path: Path, statement: str) -> list[tuple[object, ...]]:
    """Rows of a file that another process writes; none while it is not there yet."""
    if not path.exists():
        return []
    db = sqlite3.connect(path, timeout=1.0)
    try:
        return db.execute(statement).fetchall()
    except sqlite3.OperationalError:
        return []
    finally:
        db.close()


def one_trial(number: int, options: argparse.Namespace, base: Path) -> Trial:
    """Begin, cut, go on, cut, ... and let it come to its end."""
    rng = random.Random(f'{options.seed}/{number}')
    folder = base / f'trial{number}' / 'run'
    folder.parent.mkdir(parents=True)
    boxes = folder.parent / 'boxes.csv'
    write_boxes(boxes, options.boxes, rng)
    arm = [] if options.physics else list(TIMED)
    arm += ['--stall-timeout', f'{PATIENCE_S:g}']
    if options.phases:
        arm += ['--respawn', '--speed', '6']
    arguments = [*arm, '--boxes', str(boxes), '--out', str(folder), *options.run]
    run, trial = CutRun(folder, arguments, options.domain), Trial()
    run.start()
    for cut in range(options.cuts if not options.phases else 0):
        # First to anywhere in the run, then to any instant of a box's way.
        share = (options.boxes - run.placed()) / (options.cuts - cut + 1)
        if not run.wait_for_placed(max(1, round(rng.uniform(0.3, 1.3) * share))):
            break
        time.sleep(rng.uniform(0.0, 0.15 if not options.physics else 2.0))
        if run.ended():
            break
        run.cut()
        trial.cuts += 1
        boxes.unlink(missing_ok=True)
        trial.wrong += check_books(folder, options.boxes, ended=False)
        began = time.monotonic()
        run.start()
        if run.wait_for_placed(1):
            trial.back_s.append(time.monotonic() - began)
    for step in STEPS if options.phases else ():
        run.wait_for_placed(1)
        if run.kill_arm_after(step):
            trial.cuts += 1
            began = time.monotonic()
            if run.wait_for_placed(1):
                trial.back_s.append(time.monotonic() - began)
    code = run.finish()
    if code != 0:
        trial.wrong.append(f'the run ended with {code}:\n{run.screen()}')
    else:
        trial.wrong += check_run(folder, options.boxes)
        resumed = json.loads((folder / 'summary.json').read_text())['resumed']['times']
        if resumed != (0 if options.phases else trial.cuts):
            trial.wrong.append(f'resumed {resumed} times by the summary, cut {trial.cuts} times')
    return trial


def write_boxes(path: Path, count: int, rng: random.Random) -> None:
    """A file of ``count`` boxes."""
    lines = ['id,length_mm,width_mm,height_mm,weight_kg']
    for number in range(1, count + 1):
        edges = ','.join(str(rng.randint(150, 400)) for _ in range(3))
        lines.append(f'b{number},{edges},{rng.uniform(0.5, 9):.2f}')
    path.write_text('\n'.join(lines) + '\n')


def main() -> int:
    """Run the trials; exit code 1 when anything was wrong."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('--trials', type=int, default=1)
    parser.add_argument('--cuts', type=int, default=5, help='cuts of each run')
    parser.add_argument('--boxes', type=int, default=100)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--physics', action='store_true', help='the arm in physics')
    parser.add_argument('--phases', action='store_true', help='kill the arm behind each step')
    parser.add_argument('--domain', type=int, help='ROS domain of the runs; any that is free')
    parser.add_argument('--keep', type=Path, help='folder for the runs, kept')
    parser.add_argument('run', nargs='*', help='further arguments of cell run, behind --')
    options = parser.parse_args()
    base = options.keep or Path(tempfile.mkdtemp(prefix='power_cuts_'))
    trials = []
    for number in range(options.trials):
        trial = one_trial(number, options, base)
        trials.append(trial)
        state = 'exact' if not trial.wrong else 'WRONG'
        print(f'trial {number}: {trial.cuts} cuts, {state}', *trial.wrong, sep='\n  ', flush=True)
    back_s = [seconds for trial in trials for seconds in trial.back_s]
    exact = sum(not trial.wrong for trial in trials)
    print(
        f'{sum(trial.cuts for trial in trials)} cuts of {len(trials)} runs of {options.boxes} '
        f'boxes: {exact} of {len(trials)} runs with every box in one place'
    )
    if back_s:
        begun = 'the kill' if options.phases else '--resume'
        print(
            f'from {begun} to the next box in its bin: median {statistics.median(back_s):.1f} s, '
            f'worst {max(back_s):.1f} s'
        )
    if options.keep is None and exact == len(trials):
        shutil.rmtree(base)
    return 0 if exact == len(trials) else 1


if __name__ == '__main__':
    sys.exit(main())
