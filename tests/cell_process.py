"""A whole cell as a user starts it, watched line by line."""

from __future__ import annotations

import json
import os
import queue
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

PLACED = re.compile(r'^\s*\d+/\d+\s')


class CellProcess:
    """``cell run`` in a process of its own; its lines can be waited for."""

    def __init__(self, out: Path, *arguments: str, domain: int) -> None:
        self.out = out
        self.lines: list[str] = []
        self._queue: queue.Queue[str | None] = queue.Queue()
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'pack_cell', 'run', '--out', str(out), *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=dict(os.environ, ROS_DOMAIN_ID=str(domain), COLUMNS='200'),
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._queue.put(line.rstrip('\n'))
        self._queue.put(None)

    def wait_for_line(self, pattern: str, seconds: float = 90.0) -> str:
        """The next line that matches ``pattern``; fails when none comes in time."""
        end = time.monotonic() + seconds
        while True:
            try:
                line = self._queue.get(timeout=max(0.0, end - time.monotonic()))
            except queue.Empty:
                message = f'no line {pattern!r} within {seconds} s:\n' + self.text()
                raise AssertionError(message) from None
            if line is None:
                self._queue.put(None)
                message = f'the cell ended without a line {pattern!r}:\n' + self.text()
                raise AssertionError(message)
            self.lines.append(line)
            if re.search(pattern, line):
                return line

    def wait_for_placements(self, count: int, seconds: float = 90.0) -> None:
        """Wait until ``count`` more boxes are in their bins."""
        for _ in range(count):
            self.wait_for_line(PLACED.pattern, seconds)

    def wait(self, seconds: float = 240.0) -> int:
        """Wait for the end; return the exit code."""
        try:
            code = self.process.wait(timeout=seconds)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise AssertionError(f'the cell did not end in {seconds} s:\n' + self.text()) from None
        self._reader.join(timeout=5)
        while not self._queue.empty():
            line = self._queue.get()
            if line is not None:
                self.lines.append(line)
        return code

    def interrupt(self) -> None:
        """Press Ctrl-C."""
        self.process.send_signal(signal.SIGINT)

    def kill_node(self, name: str) -> int:
        """``kill -9`` a node by name; return the process id it had."""
        pid = int(json.loads((self.out / 'pids.json').read_text())[name])
        os.kill(pid, signal.SIGKILL)
        return pid

    def text(self) -> str:
        """What it printed, and the end of each node's log."""
        logs = [
            f'--- {path.name}\n' + '\n'.join(path.read_text(errors='replace').splitlines()[-15:])
            for path in sorted((self.out / 'log').glob('*.log'))
        ]
        return '\n'.join([*self.lines, *logs])

    def summary(self) -> dict[str, Any]:
        """The summary it wrote."""
        summary: dict[str, Any] = json.loads((self.out / 'summary.json').read_text())
        return summary

    def placements(self) -> list[dict[str, Any]]:
        """The rows it wrote."""
        lines = (self.out / 'placements.jsonl').read_text().splitlines()
        return [json.loads(line) for line in lines]

    def close(self) -> None:
        """Make sure that nothing is left running."""
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(timeout=20)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
