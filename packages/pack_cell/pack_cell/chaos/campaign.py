"""Faults against a running cell, one after another by chance, and how long it takes to go on."""

from __future__ import annotations

import os
import random
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from pack_cell.chaos.cell_at_hand import PATIENCE_S, CellAtHand
from pack_cell.ros.executables import NODES, executable
from pack_msgs_py.codes import Command

if TYPE_CHECKING:
    from pack_cell.ros.attacker import SteppedAttacker

#: How long a halted node is halted, seconds.
HALTS_S = (0.5, 1.0, 2.0, 5.0, 10.0, 30.0)
#: How long a second node speaks beside the first one, seconds.
SECOND_S = 4.0
#: Hostile messages of one burst.
BURST = 200
BURST_KINDS = (*('messages',) * 8, 'goals')
#: What an operator does, and what takes it back. A belt that is emptied would end the run.
_ARM_COMMANDS = (
    (Command.PAUSE, Command.RESUME),
    (Command.STOP, Command.RESET),
    (Command.HOLD_BIN, Command.RELEASE_BIN),
    (Command.CLOSE_BIN, Command.SWAP_BIN),
)
_BELT_COMMANDS = ((Command.PAUSE, Command.RESUME), (Command.DRAIN, Command.FEED))
#: He takes it back after so long, and tries again when that is refused, seconds.
_OPERATED_S = 1.0
#: After a fault the cell packs on for up to so long before the next one, seconds.
CALM_S = 3.0


@dataclass(frozen=True)
class FaultMade:
    """One fault: its kind, what was done, and the seconds until a box was placed again."""

    kind: str
    text: str
    back_s: float | None


@dataclass
class Campaign:
    """What was done to a cell, and what came of it."""

    faults: list[FaultMade] = field(default_factory=list)
    messages: int = 0
    wrong: list[str] = field(default_factory=list)

    def table(self) -> list[tuple[str, int, float, float]]:
        """Kind, how often, median and worst seconds to go on; of those that went on."""
        rows = []
        for kind in dict.fromkeys(fault.kind for fault in self.faults):
            of_kind = [fault for fault in self.faults if fault.kind == kind]
            back = [fault.back_s for fault in of_kind if fault.back_s is not None]
            if back:
                rows.append((kind, len(of_kind), statistics.median(back), max(back)))
        return rows


def run_campaign(
    cell: CellAtHand,
    attacker: SteppedAttacker,
    *,
    minutes: float,
    messages: int,
    seed: int,
    domain: int,
    say: Callable[[str], None],
) -> Campaign:
    """Do one fault after another to a cell that runs, for ``minutes``.

    ``messages`` hostile ones are spread over that time. Ends early when the cell does not go on.
    """
    campaign, chance = Campaign(), random.Random(seed)
    halts = [seconds for seconds in HALTS_S if seconds <= 10.0 * minutes]
    actions: dict[str, Callable[[], str]] = {
        'a node is killed': lambda: _kill(cell, chance),
        'a node hangs': lambda: _halt(cell, chance, halts),
        'all is cut': lambda: _cut(cell),
        'hostile messages': lambda: _burst(campaign, attacker, BURST),
        'a second node': lambda: _second(chance, cell.folder, domain),
        'an operator': lambda: _operate(chance, domain),
    }
    end_s = time.monotonic() + 60.0 * minutes
    while time.monotonic() < end_s and not cell.ended:
        kind = chance.choice(list(actions))
        text = actions[kind]()
        back_s = cell.seconds_to_next(lambda: attacker.listen(0.01))
        campaign.faults.append(FaultMade(kind, text, back_s))
        went_on = 'does not go on' if back_s is None else f'goes on after {back_s:.1f} s'
        say(f'{kind}: {text}; the cell {went_on}')
        if back_s is None:
            campaign.wrong.append(f'{kind} ({text}): the cell does not go on\n{cell.screen()}')
            break
        attacker.listen(chance.uniform(0.0, CALM_S))
    while campaign.messages < messages and not cell.ended:
        _burst(campaign, attacker, min(10 * BURST, messages - campaign.messages))
        if cell.seconds_to_next(lambda: attacker.listen(0.01)) is None:
            campaign.wrong.append(f'after hostile messages it does not go on\n{cell.screen()}')
            break
    return campaign


def _kill(cell: CellAtHand, chance: random.Random) -> str:
    node = chance.choice(list(NODES))
    cell.kill(node)
    return f'{node} is killed'


def _halt(cell: CellAtHand, chance: random.Random, halts: list[float]) -> str:
    node, seconds = chance.choice(list(NODES)), chance.choice(halts)
    cell.halt(node, seconds)
    return f'{node} is halted for {seconds:g} s'


def _cut(cell: CellAtHand) -> str:
    cell.cut()
    return 'all processes are killed, and the run is resumed'


def _burst(campaign: Campaign, attacker: SteppedAttacker, count: int) -> str:
    before = attacker.sent.total()
    attacker.attack(count, BURST_KINDS)
    campaign.messages += attacker.sent.total() - before
    return f'{count} of them'


def _operate(chance: random.Random, domain: int) -> str:
    """Do what an operator may do at the belt or at station A, and take it back."""
    from pack_cell.ros.cell_client import CellClient

    with CellClient(domain, None, PATIENCE_S, 'chaos', 'to see what comes of it') as client:
        at_arm = chance.random() < 0.7
        done, undone = chance.choice(_ARM_COMMANDS if at_arm else _BELT_COMMANDS)

        def command(which: Command) -> tuple[bool, str]:
            return client.arm(which, 'A') if at_arm else client.belt(which)

        went, said = command(done)
        end_s, back = time.monotonic() + PATIENCE_S, not went
        while not back and time.monotonic() < end_s:
            time.sleep(_OPERATED_S)
            back, said = command(undone)
        whose = 'arm' if at_arm else 'belt'
        return f'{done.name} and {undone.name} of the {whose} ({said})'


def _second(chance: random.Random, folder: Path, domain: int) -> str:
    """Start one of the nodes once more in the same domain, for a while."""
    node = chance.choice(list(NODES))
    arm = ['-p', 'arm:=timed'] if node == 'arm_executor' else []
    with (folder / 'log' / f'second_{node}.log').open('ab') as log:
        process = subprocess.Popen(
            [sys.executable, str(executable(*NODES[node])), '--ros-args', *arm],
            stdout=log,
            stderr=subprocess.STDOUT,
            env=dict(os.environ, ROS_DOMAIN_ID=str(domain)),
        )
        time.sleep(SECOND_S)
        process.terminate()
        try:
            process.wait(10.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    return f'{node} is started a second time'
