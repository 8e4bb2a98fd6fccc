"""What the nodes say, put together to the state of the whole cell.

Fed with heartbeats, diagnostics, alarms and scans; knows no ROS. Times are seconds of a steady
clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

from pack_msgs_py.alarms import Alarm
from pack_msgs_py.cell_state import CellState, NodeState
from pack_msgs_py.codes import Condition, Level, Mode

#: The nodes of a cell.
CONVEYOR, PLANNER, ARM_EXECUTOR = 'conveyor', 'planner', 'arm_executor'
NODES = (CONVEYOR, PLANNER, ARM_EXECUTOR)
#: Modes in which the arm begins no motion.
STANDS = (Mode.PAUSED, Mode.ALARM, Mode.PROTECTIVE_STOP, Mode.FAULT)
#: A node that has said nothing for so long is silent: heartbeats come ten times a second,
#: diagnostics each second.
HEARTBEAT_SILENCE_S, SILENCE_S = 2.0, 5.0
#: So long a cell may take to come up before a node that was never heard is missing.
STARTING_S = 20.0


@dataclass(frozen=True)
class ArmHeard:
    """The last heartbeat of the arm executor; see pack_msgs/ExecutorState."""

    mode: Mode
    active_box: str
    message: str
    heard_s: float


@dataclass(frozen=True)
class NodeHeard:
    """The last diagnostics of a node."""

    level: Level
    message: str
    values: Mapping[str, str]
    heard_s: float


@dataclass(frozen=True)
class BeltHeard:
    """What the last scan said: boxes on the belt, and still to come (below 0: without end)."""

    boxes: int
    remaining: int


class CellWatch:
    """Remembers what each node said last, and says what that means.

    Parameters
    ----------
    clock : steady seconds.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._began_s = clock()
        self._arm: ArmHeard | None = None
        self._nodes: dict[str, NodeHeard] = {}
        self._alarms: dict[str, tuple[Alarm, ...]] = {}
        self._belt: BeltHeard | None = None

    def on_heartbeat(self, mode: Mode, active_box: str, message: str) -> None:
        """The arm executor is alive."""
        self._arm = ArmHeard(mode, active_box, message, self._clock())

    def on_diagnostics(
        self, node: str, level: Level, message: str, values: Mapping[str, str]
    ) -> None:
        """A node says what it does; ``node`` is one of :data:`NODES`."""
        self._nodes[node] = NodeHeard(level, message, values, self._clock())

    def on_alarms(self, node: str, alarms: tuple[Alarm, ...]) -> None:
        """All that stands in a node."""
        self._alarms[node] = alarms

    def forget_gone(self, names: Callable[[], Collection[str]]) -> None:
        """Forget the alarms of nodes that are none of ``names`` any more, or never were."""
        if any(self._alarms.values()):
            there = names()
            self._alarms = {node: said for node, said in self._alarms.items() if node in there}

    def on_scan(self, boxes: int, remaining: int) -> None:
        """So many boxes are on the belt, and so many are to come."""
        self._belt = BeltHeard(boxes, remaining)

    @property
    def complete(self) -> bool:
        """Whether every node has been heard, and what is on the belt."""
        heard = self._arm is not None and self._belt is not None
        return heard and all(name in self._nodes for name in NODES)

    @property
    def mode(self) -> Mode | None:
        """Mode of the arm executor; ``None`` before its first heartbeat."""
        return None if self._arm is None else self._arm.mode

    def starts(self, name: str) -> bool:
        """Whether a node that is heard says itself that it is not ready yet."""
        if name == ARM_EXECUTOR:
            return self.mode is Mode.INACTIVE
        heard = self._nodes.get(name)
        return heard is not None and heard.message == 'starting'

    @property
    def active_box(self) -> str:
        """Box that the arm is at; empty for none."""
        return '' if self._arm is None else self._arm.active_box

    @property
    def paused(self) -> bool:
        """Whether the arm is paused, or pauses once its box is in its bin."""
        heard = self._nodes.get(ARM_EXECUTOR)
        pausing = heard is not None and bool(heard.values.get('paused'))
        return self.mode is Mode.PAUSED or pausing

    @property
    def belt_condition(self) -> str:
        """What the conveyor says of its belt, in a word; empty before it has said anything."""
        belt = self._nodes.get(CONVEYOR)
        return '' if belt is None else belt.values.get('belt', '')

    @property
    def nodes_with_alarms(self) -> Mapping[str, int]:
        """How many alarms and warnings stand in each node that has told, by its full name."""
        return {node: len(alarms) for node, alarms in self._alarms.items()}

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """All that stands, alarms first, oldest first."""
        every = [alarm for alarms in self._alarms.values() for alarm in alarms]
        return tuple(sorted(every, key=lambda alarm: (not alarm.blocks, alarm.raised_s)))

    def state(self, stamp_s: float = 0.0) -> CellState:
        """The state of the cell now; ``stamp_s`` is written into it."""
        now_s = self._clock()
        nodes = tuple(self._node(name, now_s) for name in NODES)
        condition, summary, action = self._judged(nodes, now_s)
        return CellState(condition, summary, action, nodes, self.alarms, stamp_s)

    # -- nodes ----------------------------------------------------------------------------------

    def heard_s(self, name: str) -> float:
        """When a node was heard last, by the clock; minus infinity when it never was."""
        heard = [self._nodes[name].heard_s] if name in self._nodes else []
        if name == ARM_EXECUTOR and self._arm is not None:
            heard.append(self._arm.heard_s)
        return max(heard, default=-math.inf)

    def _node(self, name: str, now_s: float) -> NodeState:
        silent_s = now_s - self.heard_s(name)
        if math.isinf(silent_s):
            return NodeState(name, state='not heard')
        if silent_s > (HEARTBEAT_SILENCE_S if name == ARM_EXECUTOR else SILENCE_S):
            return NodeState(name, state=f'silent for {silent_s:.0f} s')
        heard = self._nodes.get(name)
        level, text, waits_for = Level.OK, '', ''
        if heard is not None:
            level, text = heard.level, heard.message
            waits_for = heard.values.get('waits_for', '')
        arm = self._arm
        if name == ARM_EXECUTOR and arm is not None:
            # Ten times a second, where diagnostics come once.
            text = arm.message or _doing(arm)
            if heard is not None and heard.values.get('mode') != arm.mode.name:
                waits_for = ''
        return NodeState(name, level, text, waits_for)

    # -- the whole ------------------------------------------------------------------------------

    def _judged(self, nodes: tuple[NodeState, ...], now_s: float) -> tuple[Condition, str, str]:
        """The worst that applies, a sentence about it, and what to do."""
        if all(node.state == 'not heard' for node in nodes):
            return Condition.UNKNOWN, 'No node of a cell is heard.', 'Start one: cell run'
        silent = [node for node in nodes if node.level is Level.STALE]
        coming_up = now_s - self._began_s < STARTING_S
        gone = [node for node in silent if node.state != 'not heard' or not coming_up]
        if gone:
            told = ' and '.join(f'{node.name} is {node.state}' for node in gone)
            names = ' and '.join(node.name for node in gone)
            return Condition.FAULT, f'FAULT: {told}.', f'Look at its log, and restart {names}.'
        arm = self._arm
        if arm is not None and arm.mode is Mode.FAULT:
            action = 'Look at the arm and at its log, and restart arm_executor.'
            return Condition.FAULT, f'FAULT: {arm.message}', action
        blocking = [alarm for alarm in self.alarms if alarm.blocks]
        if blocking:
            first = blocking[0]
            return Condition.ALARM, f'ALARM {first.code}: {first.message}', first.action
        if arm is not None and arm.mode is Mode.ALARM:
            return Condition.ALARM, f'ALARM: {arm.message}', 'Look, then: cell ack'
        if arm is not None and arm.mode is Mode.PROTECTIVE_STOP:
            action = 'See that nobody is near the arm, then: cell reset'
            return Condition.STOPPED, f'STOPPED: {arm.message}', action
        if arm is not None and arm.mode is Mode.PAUSED:
            said = arm.message or 'PAUSED by an operator'
            return Condition.PAUSED, said, 'To go on: cell resume'
        belt = self._nodes.get(CONVEYOR)
        condition = '' if belt is None else belt.values.get('belt', '')
        if belt is not None and condition == 'paused':
            return Condition.PAUSED, f'The belt is {_said(belt)}', 'To go on: cell resume'
        if silent or arm is None or arm.mode is Mode.INACTIVE or self._belt is None:
            ready = arm is not None and arm.mode is not Mode.INACTIVE
            waits = [node.name for node in silent] or ['the belt' if ready else 'the arm']
            return Condition.STARTING, f'STARTING: waits for {" and ".join(waits)}.', ''
        return self._at_work(arm, self._belt, condition, '' if belt is None else belt.message)

    @staticmethod
    def _at_work(
        arm: ArmHeard, belt: BeltHeard, condition: str, said: str
    ) -> tuple[Condition, str, str]:
        """Nothing stands in the way."""
        there = f'{belt.boxes} {"box" if belt.boxes == 1 else "boxes"} on the belt'
        idle = arm.mode is Mode.IDLE and not belt.boxes
        if condition == 'draining' or said.startswith('DRAINED'):
            said = said if said.startswith('DRAINED') else 'DRAINED'
            if idle:
                return Condition.ENDED, f'{said}; the belt is empty.', 'To go on: cell feed'
            return Condition.DRAINING, f'{said}; {there} still to be packed.', ''
        if idle and belt.remaining == 0:
            return Condition.ENDED, 'ENDED: every box has come to its end.', ''
        if idle:
            return Condition.WAITING, 'WAITING for boxes: the belt is empty.', ''
        return Condition.RUNNING, f'RUNNING: the arm is {_doing(arm)}, {there}.', ''


def _doing(arm: ArmHeard) -> str:
    """What the arm does, for people."""
    if arm.mode is Mode.EXECUTING:
        return f'placing box {arm.active_box!r}'
    return arm.mode.name.lower().replace('_', ' ')


def _said(belt: NodeHeard) -> str:
    """Who has paused the belt; just paused where nobody says it."""
    return belt.message if belt.message.startswith('PAUSED') else 'PAUSED'
