"""Conversions between values and messages, in pairs named by direction.

``*_to_ros`` takes a value and returns a message; ``*_from_ros`` validates a message and returns a
value, or raises ``ValueError`` (mostly :class:`pack_msgs_py.checks.InvalidValue`) saying what is
wrong.
"""

from pack_msgs_py.ros.conversions.basic import (
    duration_from_ros,
    duration_to_ros,
    pose_from_ros,
    pose_to_ros,
    time_from_ros,
    time_to_ros,
    vector_from_ros,
    vector_to_ros,
)
from pack_msgs_py.ros.conversions.closing import closing_from_ros, closing_to_ros
from pack_msgs_py.ros.conversions.content import (
    bin_from_ros,
    bin_to_ros,
    bins_from_ros,
    bins_to_ros,
    box_from_ros,
    box_to_ros,
    placed_box_from_ros,
    placed_box_to_ros,
)
from pack_msgs_py.ros.conversions.operating import (
    alarm_from_ros,
    alarm_to_ros,
    alarms_from_ros,
    alarms_to_ros,
    cell_state_from_ros,
    cell_state_to_ros,
)
from pack_msgs_py.ros.conversions.traffic import (
    decision_from_ros,
    decision_to_ros,
    event_from_ros,
    event_to_ros,
    placement_from_ros,
    placement_to_ros,
    report_from_ros,
    report_to_ros,
    scan_from_ros,
    scan_to_ros,
    scanned_box_from_ros,
    scanned_box_to_ros,
)

__all__ = [
    'alarm_from_ros',
    'alarm_to_ros',
    'alarms_from_ros',
    'alarms_to_ros',
    'bin_from_ros',
    'bin_to_ros',
    'bins_from_ros',
    'bins_to_ros',
    'box_from_ros',
    'box_to_ros',
    'cell_state_from_ros',
    'cell_state_to_ros',
    'closing_from_ros',
    'closing_to_ros',
    'decision_from_ros',
    'decision_to_ros',
    'duration_from_ros',
    'duration_to_ros',
    'event_from_ros',
    'event_to_ros',
    'placed_box_from_ros',
    'placed_box_to_ros',
    'placement_from_ros',
    'placement_to_ros',
    'pose_from_ros',
    'pose_to_ros',
    'report_from_ros',
    'report_to_ros',
    'scan_from_ros',
    'scan_to_ros',
    'scanned_box_from_ros',
    'scanned_box_to_ros',
    'time_from_ros',
    'time_to_ros',
    'vector_from_ros',
    'vector_to_ros',
]
