#!/usr/bin/env python3
"""Cut the power where a disk loses what was not synced, and check where every box is.

A run is made under `write_log.c`, which writes down all that is done to the files of its books.
From that log the files are built as a power cut at any instant may leave them: all that was synced
is there, and of each write since then nothing, all of it, or any of its sectors, in any order
between files and within one. In each such state a checker that shares no code with the nodes
(`pack_cell.chaos.book_checker`) reads the books, `cell journal verify` checks their hash chains,
and whatever the nodes had told by then on `box_event`, as the recording of the run has it, must
stand in them. With `--resume` some of the states are gone on with to the end of the run.

Needs a C compiler. A file that was made counts as there with its own next sync, one that was
deleted as gone with the next sync of any, as file systems with a journal have it.

    ./cell python tests/chaos/unsynced_writes.py --boxes 30 --states 2000 --resume 5
"""

from __future__ import annotations

import argparse
import bisect
import os
import random
import shutil
import sqlite3
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from power_cuts import TIMED, write_boxes
from rclpy.serialization import deserialize_message

from pack_cell.chaos.book_checker import IN_BIN, check_books, check_run
from pack_cell.journal.verify import book_errors
from pack_cell.recording.reading import find_recordings, read_messages
from pack_msgs.msg import BoxEvent

WRITE, SYNC, TRUNCATE, DELETE = 1, 2, 3, 4
_HEAD = struct.Struct('<QQIHH')
#: A disk writes so many bytes or none of them.
SECTOR = 512
PATIENCE_S = 600.0


@dataclass(frozen=True)
class Step:
    """One write, sync, truncation or deletion of the file ``name``."""

    time_ns: int
    kind: int
    name: str
    offset: int
    data: bytes


def steps_of(folder: Path) -> list[Step]:
    """What all processes have written down, in order of time."""
    steps = []
    for path in folder.glob('*.log'):
        content, at = path.read_bytes(), 0
        while at + _HEAD.size <= len(content):
            time_ns, offset, length, kind, name_length = _HEAD.unpack_from(content, at)
            at += _HEAD.size
            name = Path(content[at : at + name_length].decode()).name
            data = content[at + name_length : at + name_length + length]
            at += name_length + length
            steps.append(Step(time_ns, kind, name, offset, data))
    return sorted(steps, key=lambda step: step.time_ns)


def put(content: bytearray | None, step: Step) -> bytearray | None:
    """Carry out a step; ``None`` stands for no file."""
    if step.kind == DELETE:
        return None
    content = bytearray() if content is None else content
    content.extend(bytes(max(0, step.offset - len(content))))
    if step.kind == TRUNCATE:
        del content[step.offset :]
    else:
        content[step.offset : step.offset + len(step.data)] = step.data
    return content


def sectors(step: Step, chance: random.Random) -> Iterator[Step]:
    """Any of the sectors that a write touches."""
    at = step.offset
    end = at + len(step.data)
    while at < end:
        until = min(end, (at // SECTOR + 1) * SECTOR)
        if chance.random() < 0.5:
            data = step.data[at - step.offset : until - step.offset]
            yield Step(step.time_ns, WRITE, step.name, at, data)
        at = until


class Disk:
    """The files as they were written until some step."""

    def __init__(self) -> None:
        self._synced: dict[str, bytearray | None] = {}
        self._since: dict[str, list[Step]] = {}

    def do(self, step: Step) -> None:
        """Go on by one step."""
        if step.kind != SYNC:
            self._since.setdefault(step.name, []).append(step)
            return
        for name, since in list(self._since.items()):
            deleted = [number for number, one in enumerate(since) if one.kind == DELETE]
            certain = len(since) if name == step.name else max(deleted, default=-1) + 1
            for one in since[:certain]:
                self._synced[name] = put(self._synced.get(name), one)
            self._since[name] = since[certain:]

    @property
    def unsynced(self) -> int:
        """How many steps have not been synced."""
        return sum(map(len, self._since.values()))

    def cut(self, folder: Path, how: str, chance: random.Random) -> None:
        """Write the files as a cut leaves them.

        ``how`` says what is there of the steps that were not synced: `none`, `all`, `some` of
        them, or any of their `sectors`.
        """
        folder.mkdir(parents=True)
        for name in {*self._synced, *self._since}:
            before = self._synced.get(name)
            content = None if before is None else bytearray(before)
            for step in self._since.get(name, []) if how != 'none' else ():
                if how == 'sectors' and step.kind == WRITE:
                    for part in sectors(step, chance):
                        content = put(content, part)
                elif how == 'all' or chance.random() < 0.5:
                    content = put(content, step)
            if content is not None:
                (folder / name).write_bytes(content)


def record(folder: Path, log: Path, boxes: int, seed: int, arguments: list[str]) -> None:
    """Make a run in ``folder`` whose writes are in ``log``."""
    library = log.parent / 'write_log.so'
    source = Path(__file__).with_name('write_log.c')
    compiler = ['cc', '-O2', '-shared', '-fPIC', '-o', str(library), str(source), '-ldl']
    subprocess.run(compiler, check=True)
    log.mkdir()
    stream = folder.parent / 'boxes.csv'
    write_boxes(stream, boxes, random.Random(seed))
    run = [*TIMED, '--boxes', str(stream), '--out', str(folder), '--quiet']
    env = dict(os.environ, LD_PRELOAD=str(library), UNSYNCED_LOG=str(log))
    command = [sys.executable, '-m', 'pack_cell', 'run', *run, *arguments]
    subprocess.run(command, env=env, check=True, timeout=PATIENCE_S, stdout=subprocess.DEVNULL)


def told_in(run: Path) -> list[tuple[int, int, str]]:
    """What the nodes have told of boxes: when, nanoseconds since the epoch, which event, and id."""
    told = []
    for path in find_recordings(run):
        for message in read_messages(path, ['/box_event']):
            event = deserialize_message(message.data, BoxEvent)
            told.append((message.published_ns, event.event, event.box_id))
    return sorted(told)


def untrue(state: Path, told: list[tuple[int, int, str]]) -> Iterator[str]:
    """What has been told, and does not stand in the books."""
    attempts = rows(state / 'executor.sqlite', 'SELECT box_id, step FROM attempt')
    places = dict(rows(state / 'conveyor.sqlite', 'SELECT box_id, place FROM boxes'))
    begun = {box_id for box_id, _ in attempts}
    in_bins = {box_id for box_id, step in attempts if step in IN_BIN}
    for _, event, box_id in told:
        if event == BoxEvent.PICKED and box_id not in begun:
            yield f'{box_id} was told to be picked, and no placement of it was begun'
        elif event == BoxEvent.PLACED and box_id not in in_bins:
            yield f'{box_id} was told to be placed, and is in no bin'
        elif event == BoxEvent.REJECTED and places.get(box_id) != 'rejected':
            yield f'{box_id} was told to be rejected, and is {places.get(box_id)}'


def rows(path: Path, query: str) -> list[tuple[str, str]]:
    """Of a copy, since reading takes up what is in the write-ahead log."""
    if not path.exists():
        return []
    with tempfile.TemporaryDirectory() as folder:
        for part in path.parent.glob(f'{path.name}*'):
            shutil.copyfile(part, Path(folder) / part.name)
        db = sqlite3.connect(Path(folder) / path.name)
        try:
            return db.execute(query).fetchall()
        except sqlite3.OperationalError as error:
            if 'no such table' in str(error):
                return []
            raise
        finally:
            db.close()


def wrong_in(base: Path, how: str, told: list[tuple[int, int, str]], boxes: int) -> list[str]:
    """What is wrong with the books in ``base``/state when so much has been told."""
    state = base / 'state'
    try:
        wrong = [*check_books(base, boxes, ended=False), *untrue(state, told)]
        if (state / 'executor.sqlite').exists():  # else the cut came before it was there
            wrong += book_errors(state)
    except sqlite3.DatabaseError as error:
        wrong = [str(error)]
    return [f'{how}: {text}' for text in wrong]


def go_on(run: Path, base: Path, boxes: int) -> list[str]:
    """Resume the run from the books in ``base``/state; what is wrong at its end."""
    again = base / 'run'
    shutil.copytree(run, again, ignore=shutil.ignore_patterns('state', 'summary.json', 'log'))
    shutil.copytree(base / 'state', again / 'state')
    command = [sys.executable, '-m', 'pack_cell', 'run', '--resume', str(again)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    if done.returncode:
        return [f'resumed, it ended with {done.returncode}: {done.stdout[-800:]}{done.stderr}']
    return check_run(again, boxes)


def main() -> int:
    """Make the run, build the states, check them; exit code 1 when anything was wrong."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('--boxes', type=int, default=30)
    parser.add_argument('--states', type=int, default=2000, help='states of the disk to check')
    parser.add_argument('--resume', type=int, default=0, help='so many are gone on with')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--keep', type=Path, help='folder for the run and its log, kept')
    parser.add_argument('run', nargs='*', help='further arguments of cell run, behind --')
    options = parser.parse_args()
    base = options.keep or Path(tempfile.mkdtemp(prefix='unsynced_'))
    base.mkdir(parents=True, exist_ok=True)
    run, log = base / 'run', base / 'log'
    if not log.exists():
        record(run, log, options.boxes, options.seed, options.run)
    steps, told = steps_of(log), told_in(run)
    kinds = [sum(step.kind == kind for step in steps) for kind in (WRITE, SYNC)]
    text = '{} writes and {} syncs of the books'.format(*kinds)
    print(f'{text}; {len(told)} events were told', flush=True)
    chance, disk = random.Random(options.seed), Disk()
    hows = ('none', 'all', 'some', 'sectors')
    cuts = sorted(chance.choices(range(len(steps)), k=max(1, options.states // len(hows))))
    resumed = set(chance.sample(range(len(cuts)), min(options.resume, len(cuts))))
    checked, torn, gone_on, bad, done = 0, 0, 0, 0, 0
    for number, cut in enumerate(cuts):
        for step in steps[done : cut + 1]:
            disk.do(step)
        done = cut + 1
        by_then = told[: bisect.bisect(told, (steps[cut].time_ns,))]
        for how in hows if disk.unsynced else ('none',):
            here = Path(tempfile.mkdtemp(dir=base, prefix='state_'))
            disk.cut(here / 'state', how, chance)
            wrong = wrong_in(here, how, by_then, options.boxes)
            if not wrong and number in resumed and how == 'sectors':
                wrong = go_on(run, here, options.boxes)
                gone_on += 1
            checked, torn = checked + 1, torn + (how != 'none')
            bad += bool(wrong)
            if wrong:
                print(f'cut behind step {cut}:', *wrong, sep='\n  ', flush=True)
            shutil.rmtree(here)
    print(
        f'{checked} states of the disk, {torn} of them with parts of what was not synced: '
        f'{bad} wrong; {gone_on} runs were gone on with'
    )
    if options.keep is None:
        shutil.rmtree(base)
    return 1 if bad else 0


if __name__ == '__main__':
    sys.exit(main())
