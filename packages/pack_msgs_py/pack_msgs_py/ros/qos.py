"""QoS profiles of every topic of the cell, defined once.

State topics keep the newest value for late joiners; event topics keep the last hundred; the
heartbeat proves that the thread behind it still runs.
"""

from __future__ import annotations

from copy import copy

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

STATE = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)

EVENTS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=100,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)

HEARTBEAT_PERIOD_S = 0.1
HEARTBEAT_DEADLINE_S = 0.5
HEARTBEAT_LEASE_S = 1.0

#: For the publisher of `executor_state`, and for a subscriber that wants to hear of its death.
HEARTBEAT = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
    deadline=Duration(seconds=HEARTBEAT_DEADLINE_S),
    liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
    liveliness_lease_duration=Duration(seconds=HEARTBEAT_LEASE_S),
)

#: What the boxes really are, which only a simulation knows.
TRUE_BOXES = 'simulation/true_boxes'

#: A subscriber keeps so many messages: with one alone, a stranger's would take the place of the
#: last true one before it is looked at.
_HEARD_DEPTH = 10


def heard(topic: str) -> QoSProfile:
    """The profile of a subscriber of ``topic``, which takes it from whoever offers it."""
    profile = copy(TOPICS[topic])
    profile.depth = max(profile.depth, _HEARD_DEPTH)
    return profile


TOPICS: dict[str, QoSProfile] = {
    'box_scan': STATE,
    TRUE_BOXES: STATE,
    'bin_state': STATE,
    'bin_closed': EVENTS,
    'bin_closing': EVENTS,
    'placements': EVENTS,
    'placement_report': EVENTS,
    'box_event': EVENTS,
    'executor_state': HEARTBEAT,
    'alarms': STATE,
    'cell_state': STATE,
}

#: For a subscriber of `alarms`: every node publishes its own list, and none may push out another.
ALARMS_HEARD = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=20,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
