"""Alarms, and the state of the cell."""

from __future__ import annotations

from pack_msgs.msg import Alarm as AlarmMsg
from pack_msgs.msg import AlarmArray
from pack_msgs.msg import CellState as CellStateMsg
from pack_msgs.msg import NodeState as NodeStateMsg
from pack_msgs_py.alarms import Alarm
from pack_msgs_py.cell_state import CellState, NodeState
from pack_msgs_py.checks import InvalidValue, check_length, check_name, clean_text
from pack_msgs_py.codes import Condition, Level, Severity
from pack_msgs_py.ros.conversions.basic import time_from_ros, time_to_ros

#: More than ever stand in a node at a time.
MOST_ALARMS = 1000
#: Of a cell.
MOST_NODES = 100


def alarm_to_ros(alarm: Alarm) -> AlarmMsg:
    """An alarm or a warning as pack_msgs/Alarm."""
    return AlarmMsg(
        raised=time_to_ros(alarm.raised_s),
        severity=int(alarm.severity),
        code=alarm.code,
        message=alarm.message,
        action=alarm.action,
        box_id=alarm.box_id,
        bin_id=alarm.bin_id,
    )


def alarm_from_ros(msg: AlarmMsg) -> Alarm:
    """pack_msgs/Alarm as a checked value."""
    if not msg.code:
        text = f'an alarm without a code: {clean_text(msg.message)!r}'
        raise InvalidValue(text)
    return Alarm(
        code=check_name('code', msg.code),
        message=clean_text(msg.message),
        severity=Severity(msg.severity),
        action=clean_text(msg.action),
        box_id=check_name('box_id', msg.box_id),
        bin_id=check_name('bin_id', msg.bin_id),
        raised_s=time_from_ros(msg.raised),
    )


def alarms_to_ros(node: str, alarms: tuple[Alarm, ...], now_s: float) -> AlarmArray:
    """All that stands in ``node`` as pack_msgs/AlarmArray."""
    msg = AlarmArray(node=node, alarms=[alarm_to_ros(alarm) for alarm in alarms])
    msg.header.stamp = time_to_ros(now_s)
    return msg


def alarms_from_ros(msg: AlarmArray) -> tuple[str, tuple[Alarm, ...]]:
    """Name of the node, and what stands in it."""
    check_length('alarms', msg.alarms, MOST_ALARMS)
    return check_name('node', msg.node), tuple(alarm_from_ros(alarm) for alarm in msg.alarms)


def cell_state_to_ros(state: CellState) -> CellStateMsg:
    """The state of the cell as pack_msgs/CellState."""
    msg = CellStateMsg(
        state=int(state.condition),
        summary=state.summary,
        next_action=state.next_action,
        nodes=[
            NodeStateMsg(
                name=node.name, level=int(node.level), state=node.state, waits_for=node.waits_for
            )
            for node in state.nodes
        ],
        alarms=[alarm_to_ros(alarm) for alarm in state.alarms],
    )
    msg.header.stamp = time_to_ros(state.stamp_s)
    return msg


def cell_state_from_ros(msg: CellStateMsg) -> CellState:
    """pack_msgs/CellState as a checked value."""
    check_length('nodes', msg.nodes, MOST_NODES)
    check_length('alarms', msg.alarms, MOST_ALARMS)
    return CellState(
        condition=Condition(msg.state),
        summary=clean_text(msg.summary),
        next_action=clean_text(msg.next_action),
        nodes=tuple(
            NodeState(
                check_name('name', node.name),
                Level(node.level),
                clean_text(node.state),
                clean_text(node.waits_for),
            )
            for node in msg.nodes
        ),
        alarms=tuple(alarm_from_ros(alarm) for alarm in msg.alarms),
        stamp_s=time_from_ros(msg.header.stamp),
    )
