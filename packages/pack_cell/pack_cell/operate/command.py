"""Carries out the verbs of an operator against a running cell."""

from __future__ import annotations

import argparse
import getpass
import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from pack_cell.operate.options import add_operate, box_of, placed_box_of
from pack_cell.options.parsers import OneLineParser
from pack_cell.running.screen import Screen
from pack_cell.watching.cell_watch import ARM_EXECUTOR, CONVEYOR, STANDS
from pack_cell.watching.finding import NoCell, domain_of_cell
from pack_cell.watching.state_text import NEEDS_SOMEBODY, status_json, status_lines
from pack_msgs_py.codes import Command

if TYPE_CHECKING:
    from pack_cell.ros.cell_client import Answer, CellClient

#: Done; refused, or the cell needs somebody; there is no cell, or it does not answer.
EXIT_DONE, EXIT_REFUSED, EXIT_NO_CELL = 0, 1, 2
#: Diagnostics come once a second.
LISTEN_S = 2.5

#: Verbs that come to one command of the arm executor, or of the conveyor.
_ARM = {
    'pause': Command.PAUSE,
    'stop': Command.STOP,
    'reset': Command.RESET,
    'swap': Command.SWAP_BIN,
    'close': Command.CLOSE_BIN,
    'hold': Command.HOLD_BIN,
    'release': Command.RELEASE_BIN,
}
_BELT = {'drain': Command.DRAIN, 'feed': Command.FEED, 'empty': Command.EMPTY}


def operate(arguments: Sequence[str]) -> int:
    """Carry out one verb of an operator, given as words of the command line; the exit code."""
    parser = OneLineParser(prog='cell')
    add_operate(parser.add_subparsers(dest='verb', required=True))
    return run_operate(parser.parse_args(arguments))


def run_operate(parsed: argparse.Namespace) -> int:
    """Carry out one verb; returns the exit code."""
    # ROS takes half a second to load.
    from pack_cell.ros.cell_client import CellClient

    verb, screen = parsed.verb, Screen()
    try:
        if verb == 'insert':
            (placed_box_of if parsed.bin_id else box_of)(parsed)
        domain = domain_of_cell(parsed.domain)
        who = getattr(parsed, 'who', '') or user_name()
        client = CellClient(
            domain, parsed.namespace, parsed.timeout, who, getattr(parsed, 'why', '')
        )
        with client:
            if verb == 'status':
                return _status(client, screen, as_json=parsed.json)
            for done, text in _steps(client, parsed):
                if not done:
                    screen.problem(f'cell {verb}: {text}')
                    return EXIT_REFUSED
                screen.tell(f'{text[0].upper()}{text[1:]}.')
    except (NoCell, ValueError) as error:
        screen.problem(f'cell {verb}: {error}')
        return EXIT_NO_CELL
    return EXIT_DONE


def user_name() -> str:
    """Who is logged in; empty where that cannot be told."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return os.environ.get('USER', '')


def _status(client: CellClient, screen: Screen, *, as_json: bool) -> int:
    state = client.state(LISTEN_S)
    if as_json:
        sys.stdout.write(json.dumps(status_json(state), indent=2) + '\n')
    else:
        for line in status_lines(state):
            screen.tell(line)
    return EXIT_REFUSED if state.condition in NEEDS_SOMEBODY else EXIT_DONE


def _steps(client: CellClient, parsed: argparse.Namespace) -> Iterable[Answer]:
    """The answers that a verb gets, told as they come; nothing is asked after a refusal."""
    verb = parsed.verb
    if verb in _ARM:
        return [client.arm(_ARM[verb], getattr(parsed, 'subject', ''))]
    if verb in _BELT:
        return [client.belt(_BELT[verb])]
    several: dict[str, Callable[[], Iterable[Answer]]] = {
        'resume': lambda: _resume(client),
        'ack': lambda: _acknowledge(client),
        'remove': lambda: [_remove(client, parsed.subject)],
        'insert': lambda: [_insert(client, parsed)],
        'resolve': lambda: [client.resolve(parsed.subject, placed=parsed.placed)],
        'finish': lambda: _finish(client),
    }
    return several[verb]()


def _resume(client: CellClient) -> list[Answer]:
    """The arm, and the belt where that was paused too."""
    client.wait_until(lambda watch: watch.complete, LISTEN_S)
    belt_paused = client.watch.belt_condition == 'paused'
    answers = []
    if client.watch.paused or not belt_paused:
        answers.append(client.arm(Command.RESUME))
    if belt_paused:
        answers.append(client.belt(Command.RESUME))
    return answers


def _acknowledge(client: CellClient) -> list[Answer]:
    """Whatever stands, where it stands."""
    client.wait_until(lambda watch: watch.complete and len(watch.nodes_with_alarms) > 1, LISTEN_S)
    nodes = [node for node, number in client.watch.nodes_with_alarms.items() if number]
    if not nodes:
        return [(False, 'no alarm and no warning stands')]
    answers = []
    for node in nodes:
        asked = client.belt if node.endswith(CONVEYOR) else client.arm
        answers.append(asked(Command.ACKNOWLEDGE))
    return answers


def _remove(client: CellClient, box_id: str) -> Answer:
    """From a bin when it is in one, else from the belt."""
    in_bin = box_id in client.boxes_in_bins()
    return client.remove_from(ARM_EXECUTOR if in_bin else CONVEYOR, box_id)


def _insert(client: CellClient, parsed: argparse.Namespace) -> Answer:
    if parsed.bin_id:
        return client.insert_in_bin(parsed.bin_id, placed_box_of(parsed))
    return client.insert_on_belt(box_of(parsed))


def _finish(client: CellClient) -> Iterator[Answer]:
    """The arm ends what it does and takes nothing new, the belt is emptied, bins are closed."""
    client.wait_until(lambda watch: watch.complete, LISTEN_S)
    if not client.watch.paused:
        yield client.arm(Command.PAUSE)
    yield client.belt(Command.EMPTY)
    if not client.wait_until(lambda watch: watch.mode in STANDS):
        text = 'the arm is still placing a box; it stays paused: cell finish again, or cell resume'
        yield False, text
    yield client.arm(Command.CLOSE_ALL)
    yield client.arm(Command.RESUME)
