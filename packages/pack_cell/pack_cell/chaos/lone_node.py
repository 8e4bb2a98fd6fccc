"""One node alone with a hostile rest of the cell, which it has to believe."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from pack_cell.ros.executables import NODES, executable
from pack_msgs_py.signals import signal_name

#: What each node is started with.
PARAMETERS = {
    'conveyor': ('count:=200', 'speed:=20.0', 'faults:=all=0.02'),
    'planner': ('orientations:=upright', 'candidates:=4'),
    'arm_executor': ('arm:=timed', 'speed:=20.0', 'orientations:=upright'),
    'recorder': (),
    'cell_monitor': (),
    'viewer': ('port:=0',),
}
#: Nodes that keep their books in a folder.
_WITH_STATE = ('conveyor', 'arm_executor')
#: What a node is told: messages mostly.
KINDS = (*('messages',) * 6, *('services',) * 2, 'goals', 'parameters')
#: A node gets so long to start, to answer after the last message, and to end, seconds.
PATIENCE_S = 30.0
#: After so many messages the node is given time to hear them, and a good word.
BURST = 20


@dataclass
class LoneNode:
    """How a node has taken what it was told; ``types`` are those of its interfaces, and
    ``wrong`` says what should not be."""

    name: str
    sent: dict[str, int] = field(default_factory=dict)
    types: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)
    seconds: float = 0.0


def attack_alone(
    name: str,
    messages: int,
    seed: int,
    folder: Path,
    domain: int,
    say: Callable[[str], None] = lambda text: None,
) -> LoneNode:
    """Start the node ``name`` in ``domain``, tell it ``messages`` hostile things, and end it.

    Its log and its state stay in ``folder``; ``say`` hears how far it is.
    """
    from pack_cell.ros.attacker import SteppedAttacker

    result = LoneNode(name)
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / f'{name}.log'
    given = (*PARAMETERS[name], *([f'state_dir:={folder}'] if name in _WITH_STATE else []))
    words = [word for pair in given for word in ('-p', pair)]
    program = [str(executable(*NODES[name]))] if name in NODES else ['-m', f'pack_cell.ros.{name}']
    command = [sys.executable, *program, '--ros-args', *words]
    attacker = SteppedAttacker(seed, domain, believed=True)
    with log.open('wb') as out:
        process = subprocess.Popen(
            command,
            stdout=out,
            stderr=subprocess.STDOUT,
            env=dict(os.environ, ROS_DOMAIN_ID=str(domain), PYTHONUNBUFFERED='1'),
        )
    began_s = time.monotonic()
    try:
        if not attacker.get_to_know(name):
            result.wrong.append(f'{name} did not start:\n{_tail(log)}')
            return result
        result.types = sorted(attacker.known[name].types)
        while attacker.sent.total() < messages and process.poll() is None:
            attacker.attack(min(BURST, messages - attacker.sent.total()), KINDS, name)
            attacker.beat()
            attacker.listen(0.02)
            say(f'{name}: {attacker.sent.total()} of {messages}')
        if process.poll() is None and attacker.parameters_of(name, PATIENCE_S) is None:
            result.wrong.append(f'{name} does not answer any more:\n{_tail(log)}')
    finally:
        result.sent = dict(attacker.sent)
        result.seconds = time.monotonic() - began_s
        attacker.close()
        result.wrong += _end(name, process, log)
    return result


def _end(name: str, process: subprocess.Popen[bytes], log: Path) -> list[str]:
    """End the node; what was wrong with its end, and with its log."""
    wrong = []
    if process.poll() is not None:
        code = process.returncode
        how = f'was killed by {signal_name(-code)}' if code < 0 else f'ended with code {code}'
        wrong.append(f'{name} {how} under the messages:\n{_tail(log)}')
    else:
        process.send_signal(signal.SIGINT)
        try:
            code = process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            wrong.append(f'{name} does not end:\n{_tail(log)}')
        else:
            if code:
                wrong.append(f'{name} ended with code {code}:\n{_tail(log)}')
    text = log.read_text(errors='replace')
    if 'Traceback' in text:
        wrong.append(f'{name} has logged an exception:\n{text[text.index("Traceback") :][:2000]}')
    return wrong


def _tail(log: Path) -> str:
    return '\n'.join(log.read_text(errors='replace').splitlines()[-12:])
