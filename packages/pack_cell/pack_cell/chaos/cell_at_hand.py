"""A running cell for faults: its processes are killed, halted and started again."""

from __future__ import annotations

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

#: A cell gets so long to place its next box, and to end, seconds.
PATIENCE_S = 120.0
LOOK_AGAIN_S = 0.02


class CellAtHand:
    """``cell run`` with ``arguments`` into ``folder``, in ROS domain ``domain``."""

    def __init__(self, folder: Path, arguments: list[str], domain: int) -> None:
        self.folder = folder
        self._arguments = arguments
        self._screen = folder.with_suffix('.screen.log')
        self._env = dict(os.environ, ROS_DOMAIN_ID=str(domain))
        self._process: subprocess.Popen[bytes] | None = None
        self.cuts = 0

    def start(self) -> None:
        """Begin the run, or go on with it after a cut."""
        how = ['--resume', str(self.folder)] if self.cuts else ['--out', str(self.folder)]
        self._screen.parent.mkdir(parents=True, exist_ok=True)
        with self._screen.open('ab') as screen:
            self._process = subprocess.Popen(
                [
                    *(sys.executable, '-m', 'pack_cell', 'run', *how),
                    *([] if self.cuts else self._arguments),
                ],
                stdout=screen,
                stderr=subprocess.STDOUT,
                env=self._env,
            )

    @property
    def ended(self) -> bool:
        """Whether it has ended by itself."""
        return self._process is None or self._process.poll() is not None

    def placed(self) -> int:
        """Boxes that rest in bins by the journal of the arm."""
        path = self.folder / 'state' / 'executor.sqlite'
        if not path.exists():
            return 0
        try:
            db = sqlite3.connect(f'file:{path}?mode=ro', uri=True, timeout=1.0)
            try:
                statement = "SELECT count(*) FROM attempt WHERE step = 'verified'"
                return int(db.execute(statement).fetchone()[0])
            finally:
                db.close()
        except sqlite3.OperationalError:
            return 0

    def seconds_to_next(
        self, meanwhile: Callable[[], None] = lambda: None, patience_s: float = PATIENCE_S
    ) -> float | None:
        """Seconds until one more box is in its bin; ``None`` when none comes in time.

        ``meanwhile`` is called now and then.
        """
        began_s, aim = time.monotonic(), self.placed() + 1
        while self.placed() < aim:
            if self.ended or time.monotonic() - began_s > patience_s:
                return None
            meanwhile()
            time.sleep(LOOK_AGAIN_S)
        return time.monotonic() - began_s

    def kill(self, node: str) -> None:
        """SIGKILL to a node, which the run starts again; returns once it has."""
        pid = self._pids()[node]
        _send(pid, signal.SIGKILL)
        end_s = time.monotonic() + PATIENCE_S
        while self._pids().get(node) == pid and not self.ended and time.monotonic() < end_s:
            time.sleep(LOOK_AGAIN_S)

    def halt(self, node: str, seconds: float) -> None:
        """SIGSTOP to a node, and SIGCONT after ``seconds``."""
        pid = self._pids()[node]
        _send(pid, signal.SIGSTOP)
        time.sleep(seconds)
        _send(pid, signal.SIGCONT)

    def cut(self) -> None:
        """SIGKILL to the run and all its nodes at once, and go on with it."""
        assert self._process is not None
        for pid in (self._process.pid, *self._pids().values()):
            _send(pid, signal.SIGKILL)
        self._process.wait()
        self.cuts += 1
        self.start()

    def end(self) -> int | None:
        """Ctrl-C; the exit code, ``None`` when it does not end."""
        assert self._process is not None
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        try:
            return self._process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            for pid in (self._process.pid, *self._pids().values()):
                _send(pid, signal.SIGKILL)
            self._process.wait()
            return None

    def screen(self) -> str:
        """The last lines that it printed."""
        lines = self._screen.read_text(errors='replace').splitlines()
        return '\n'.join(lines[-15:])

    def _pids(self) -> dict[str, int]:
        path = self.folder / 'pids.json'
        return dict(json.loads(path.read_text())) if path.exists() else {}


def _send(pid: int, number: signal.Signals) -> None:
    try:
        os.kill(pid, number)
    except ProcessLookupError:
        return
