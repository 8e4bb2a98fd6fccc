"""Cuts a run on a block device of its own, which loses what was not written back to it.

The run writes into an ext4 file system on a loop device over a file. At a cut all processes are
killed and the file is copied as it is: what the kernel still held is not in it. The copy is
mounted in its place, ext4 replays its journal, the books are checked, and the run goes on. Needs
root, ``mkfs.ext4`` and loop devices.

    sudo -E ./cell python tests/chaos/cut_image.py --cuts 6 --boxes 30
"""

from __future__ import annotations

import argparse
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from power_cuts import TIMED, CutRun

from pack_cell.chaos.book_checker import check_books, check_run
from pack_cell.journal.verify import book_errors

SIZE_MB = 128


class CutDevice:
    """A file system on ``image``, mounted at ``place``."""

    def __init__(self, folder: Path) -> None:
        self._image, self.place = folder / 'image', folder / 'mounted'
        self.place.mkdir()
        with self._image.open('wb') as file:
            file.truncate(SIZE_MB * 2**20)
        subprocess.run(['mkfs.ext4', '-q', self._image], check=True)
        self._mount()

    def _mount(self) -> None:
        subprocess.run(['mount', '-o', 'loop', self._image, self.place], check=True)

    def cut(self) -> None:
        """Go on with what has come to the device until now."""
        kept = self._image.with_suffix('.kept')
        shutil.copyfile(self._image, kept)
        self.release()
        kept.replace(self._image)
        self._mount()

    def release(self) -> None:
        """Unmount it."""
        subprocess.run(['umount', '-l', self.place], check=True)


def main() -> int:
    """Cut one run again and again; the exit code is 1 when anything was wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--cuts', type=int, default=6)
    parser.add_argument('--boxes', type=int, default=30)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--domain', type=int)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        device = CutDevice(Path(folder))
        try:
            out = device.place / 'run'
            given = ['--count', str(options.boxes), '--out', str(out), '--record', 'nothing']
            run = CutRun(out, [*TIMED, *given], options.domain)
            run.start()
            for number in range(options.cuts):
                if not run.wait_for_placed(rng.randint(1, options.boxes // (options.cuts + 1))):
                    break
                told = run.placed()
                run.cut()
                device.cut()
                found = [*check_books(out, options.boxes, ended=False), *book_errors(out / 'state')]
                if run.placed() < told:
                    found.append(f'{told} boxes were in bins before the cut, {run.placed()} after')
                print(f'cut {number + 1}: {run.placed()} boxes in bins, {found or "exact"}')
                wrong += found
                run.start()
            code = run.finish()
            wrong += check_run(out, options.boxes) if code == 0 else [f'ended with {code}']
            print(f'ended with {code}: {wrong or "every box in one place"}')
        finally:
            device.release()
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
