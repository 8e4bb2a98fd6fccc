"""The three nodes started one by one, with parameters of one's own, watched by a recorder."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray

from pack_cell.report.record import RunRecord
from pack_cell.ros.executables import NODES, executable
from pack_cell.ros.recorder import Recorder
from pack_msgs_py.codes import BoxEventKind
from pack_msgs_py.ros.testing import Spinner

LOOK_AGAIN_S = 0.2


class NodeGroup:
    """Nodes of one cell in the ROS domain ``domain``; their logs are in ``folder``."""

    def __init__(self, folder: Path, domain: int) -> None:
        self.folder = folder
        self.record = RunRecord()
        self._running: dict[str, subprocess.Popen[bytes]] = {}
        self._parameters: dict[str, list[str]] = {}
        self._changed = threading.Condition()
        self._spinner = Spinner(domain=domain)
        self.recorder = Recorder(self.record, self._on_change, context=self._spinner.context)
        self._diagnostics: dict[str, str] = {}
        self.recorder.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)
        self._spinner.add(self.recorder)

    def start(self, name: str, **parameters: object) -> None:
        """Start a node of the cell; without parameters those of the last time hold."""
        given = [f'{key}:={value}' for key, value in parameters.items()]
        self._parameters.setdefault(name, [])
        if given:
            self._parameters[name] = [word for pair in given for word in ('-p', pair)]
        program = [
            str(executable(*NODES.get(name, ('pack_cell', name)))),
            '--ros-args',
            *self._parameters[name],
        ]
        self._launch(name, program)

    def run(self, name: str, code: str) -> None:
        """Run a program of Python code as a node of this name."""
        path = self.folder / f'{name}.py'
        path.write_text(code)
        self._launch(name, [str(path)])

    def _launch(self, name: str, program: list[str]) -> None:
        with (self.folder / f'{name}.log').open('ab') as log:
            self._running[name] = subprocess.Popen(
                [sys.executable, *program],
                stdout=log,
                stderr=subprocess.STDOUT,
                env=dict(os.environ, PYTHONUNBUFFERED='1'),
            )

    def kill(self, name: str) -> None:
        """``kill -9``, and wait until it is dead."""
        self._running[name].send_signal(signal.SIGKILL)
        self._running[name].wait()

    def wait_until(self, condition: Callable[[RunRecord], object], seconds: float) -> None:
        """Wait until the record is so; fails with the ends of the logs."""
        end = time.monotonic() + seconds
        with self._changed:
            # Not every message is told of, so look again now and then.
            while not (met := condition(self.record)) and time.monotonic() < end:
                self._changed.wait(LOOK_AGAIN_S)
        assert met, f'not within {seconds} s:\n{self.text()}'

    def placed(self) -> int:
        """How many boxes rest in bins."""
        return self.record.count(BoxEventKind.PLACED)

    def wait_for_end(self, seconds: float) -> None:
        """Wait until every box of the stream is accounted for."""
        self.wait_until(lambda record: record.complete() and record.all_reported(), seconds)

    def seen(self, key: str) -> float:
        """A number of the conveyor's diagnostics; 0 before the first."""
        return float(self._diagnostics.get(key, 0))

    def pause(self, seconds: float) -> None:
        """Let the cell run on for a while, to hit another moment of its cycle."""
        with self._changed:
            self._changed.wait_for(lambda: False, seconds)

    def text(self) -> str:
        """Where the boxes are, and the end of each log."""
        places = '\n'.join(f'{key}: {value}' for key, value in self.record.places().items())
        logs = [
            f'--- {path.name}\n' + '\n'.join(path.read_text(errors='replace').splitlines()[-25:])
            for path in sorted(self.folder.glob('*.log'))
        ]
        return '\n'.join([places, *logs])

    def log(self, name: str) -> str:
        """All that a node has said."""
        return (self.folder / f'{name}.log').read_text(errors='replace')

    def close(self) -> None:
        """Make sure that nothing is left running."""
        for process in self._running.values():
            if process.poll() is None:
                process.terminate()
        for process in self._running.values():
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._spinner.close()

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        for status in msg.status:
            if status.name == 'conveyor':
                with self._changed:
                    self._diagnostics = {pair.key: pair.value for pair in status.values}
                    self._changed.notify_all()

    def _on_change(self, kind: str, value: object) -> None:
        with self._changed:
            self._changed.notify_all()
