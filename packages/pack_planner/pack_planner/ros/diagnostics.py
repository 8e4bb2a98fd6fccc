"""What the node says of itself on `/diagnostics` (REP 107)."""

from __future__ import annotations

from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from pack_msgs_py.cell_values import Decision
from pack_msgs_py.codes import ErrorCode, PlacementStatus
from pack_planner.coordination.doing import Doing

PERIOD_S = 1.0


class Diagnostics:
    """Counts decisions, and publishes the figures once a second; ``doing`` tells what is done."""

    def __init__(self, node: Node, doing: Callable[[], Doing]) -> None:
        self._node = node
        self._doing = doing
        self._last: Decision | None = None
        self._placed = self._rejected = self._asked = self._possible = self._candidates = 0
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        node.create_timer(PERIOD_S, self._publish)

    def note(self, decision: Decision) -> None:
        """A decision was announced."""
        self._last = decision
        if decision.status is PlacementStatus.REJECT:
            self._rejected += 1
            return
        self._placed += 1
        if decision.candidates_checked:
            self._asked += 1
            self._candidates += decision.candidates_checked
            self._possible += decision.first_refusal is ErrorCode.NONE

    def _publish(self) -> None:
        doing = self._doing()
        values = {
            'waits_for': doing.waits_for,
            'algorithm': str(self._node.get_parameter('algorithm').value),
            'decisions': f'{self._placed} placements, {self._rejected} rejected',
        }
        if self._last is not None:
            values['last_decision_ms'] = f'{1e3 * self._last.planning_s:.1f}'
            values['last_check_ms'] = f'{1e3 * self._last.check_s:.1f}'
        if self._asked:
            values['first_choices_possible'] = f'{self._possible / self._asked:.1%}'
            values['candidates_per_decision'] = f'{self._candidates / self._asked:.2f}'
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK,
            name=self._node.get_fully_qualified_name().lstrip('/'),
            message=doing.state,
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )
        msg = DiagnosticArray(status=[status])
        msg.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(msg)
