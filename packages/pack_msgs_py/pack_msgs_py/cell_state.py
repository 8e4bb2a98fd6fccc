"""The state of the whole cell as values; see pack_msgs/CellState and pack_msgs/NodeState."""

from __future__ import annotations

from dataclasses import dataclass

from pack_msgs_py.alarms import Alarm
from pack_msgs_py.codes import Condition, Level


@dataclass(frozen=True)
class NodeState:
    """What one node does, and what it waits for."""

    name: str
    level: Level = Level.STALE
    state: str = 'silent'
    waits_for: str = ''


@dataclass(frozen=True)
class CellState:
    """What is going on, why, and the one thing to do next; ``next_action`` is empty for nothing."""

    condition: Condition
    summary: str
    next_action: str = ''
    nodes: tuple[NodeState, ...] = ()
    alarms: tuple[Alarm, ...] = ()
    stamp_s: float = 0.0
