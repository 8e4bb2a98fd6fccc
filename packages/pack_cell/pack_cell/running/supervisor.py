"""Starts the nodes of a cell as processes, reaps them, restarts them if asked, stops them."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from pack_cell.running.log_rotation import rotate
from pack_msgs_py.signals import signal_name

#: How long a node may take to end after SIGINT, and again after SIGTERM, before the next step.
STOP_PATIENCE_S = 5.0
MAX_RESPAWNS = 10
#: A node that has run for so long does not count as one that dies at once, seconds.
GOOD_LIFE_S = 60.0


@dataclass(frozen=True)
class NodeSpec:
    """One node to run: its name, the command, and where its output goes.

    An ``attendant`` only looks on: it is not started again, and the cell goes on without it.
    """

    name: str
    command: Sequence[str]
    log: Path
    attendant: bool = False


@dataclass
class _RunningNode:
    spec: NodeSpec
    process: subprocess.Popen[bytes]
    log: IO[bytes]
    respawns: int = 0
    since_s: float = field(default_factory=time.monotonic)


@dataclass(frozen=True)
class NodeDeath:
    """A node that ended although nobody asked it to."""

    name: str
    code: int
    log: Path
    respawned: bool
    attendant: bool = False

    def __str__(self) -> str:
        if self.code < 0:
            how = f'was killed by {signal_name(-self.code)}'
        else:
            how = f'ended with code {self.code}'
        return f'node {self.name} {how}; its log is {self.log}'

    def tail(self, lines: int = 12) -> list[str]:
        """The last ``lines`` of the node's log."""
        text = self.log.read_text(errors='replace') if self.log.exists() else ''
        return text.splitlines()[-lines:]


@dataclass
class Supervisor:
    """Owns the processes of one cell.

    Start and poll from the main thread only: the nodes are tied to the thread that started them,
    so that they end when this process is killed.
    """

    specs: Sequence[NodeSpec]
    environment: Mapping[str, str]
    respawn: bool = False
    _running: dict[str, _RunningNode] = field(default_factory=dict)

    def start(self) -> None:
        """Start every node."""
        for spec in self.specs:
            spec.log.parent.mkdir(parents=True, exist_ok=True)
            self._running[spec.name] = self._spawn(spec)

    def _spawn(self, spec: NodeSpec) -> _RunningNode:
        log = spec.log.open('ab')
        command = list(spec.command)
        setpriv = shutil.which('setpriv')
        if setpriv is not None:  # nodes must not outlive a supervisor that was killed with SIGKILL
            command = [setpriv, '--pdeathsig', 'TERM', *command]
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            env=dict(os.environ, **self.environment),
            start_new_session=True,  # Ctrl-C in the terminal reaches the supervisor alone
        )
        return _RunningNode(spec, process, log)

    def pids(self) -> dict[str, int]:
        """Process id of each node that runs, by name."""
        return {name: running.process.pid for name, running in self._running.items()}

    def started_s(self) -> dict[str, float]:
        """When the process of each node that runs was started, by name; steady seconds."""
        return {name: running.since_s for name, running in self._running.items()}

    def poll(self) -> list[NodeDeath]:
        """Reap nodes that ended unasked; start them again if ``respawn`` is set.

        One that dies at once is started again ten times. Logs that have grown long are put aside.
        """
        deaths = []
        for name, running in list(self._running.items()):
            rotate(running.spec.log)
            code = running.process.poll()
            if code is None:
                continue
            running.log.close()
            attendant = running.spec.attendant
            lived = time.monotonic() - running.since_s >= GOOD_LIFE_S
            respawns = 0 if lived else running.respawns
            again = self.respawn and respawns < MAX_RESPAWNS and not attendant
            if again:
                fresh = self._spawn(running.spec)
                fresh.respawns = respawns + 1
                self._running[name] = fresh
            else:
                del self._running[name]
            deaths.append(NodeDeath(name, code, running.spec.log, again, attendant))
        return deaths

    def tell(self, name: str, sig: signal.Signals) -> None:
        """Send a signal to a node; nothing when it does not run."""
        running = self._running.get(name)
        if running is not None and running.process.poll() is None:
            running.process.send_signal(sig)

    def stop(self) -> dict[str, int]:
        """End every node, politely first; return their exit codes by name.

        Attendants end last: they see the others out.
        """
        codes: dict[str, int] = {}
        for attendant in (False, True):
            group = {
                name: running
                for name, running in self._running.items()
                if running.spec.attendant is attendant
            }
            codes |= _ended(group)
        for running in self._running.values():
            running.log.close()
        self._running.clear()
        return codes


def _ended(group: Mapping[str, _RunningNode]) -> dict[str, int]:
    """End some nodes; their exit codes by name."""
    codes: dict[str, int] = {}
    for sig in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        for running in group.values():
            if running.process.poll() is None:
                running.process.send_signal(sig)
        end = time.monotonic() + STOP_PATIENCE_S
        for name, running in group.items():
            try:
                left = max(0.0, end - time.monotonic())
                codes[name] = running.process.wait(timeout=left)
            except subprocess.TimeoutExpired:
                continue
        if len(codes) == len(group):
            break
    return codes
