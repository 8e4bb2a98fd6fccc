"""Node `planner`: decides which box of the look-ahead goes where, and has the arm do it.

Subscribes
----------
- `box_scan`: what is on the belt, in any frame; for another one than `cell` also `/tf` and
  `/tf_static`.
- `bin_state`: what is in the open bins.
- `executor_state`: heartbeat of the arm; its absence means the arm is dead.
- `placement_report`: how each goal ended.
- `box_event`: what happened to boxes.

Publishes
---------
- `placements`: every decision as it is made.
- `bin_closing`: why a bin is about to be closed.
- `~/planning_record`: what each decision rested on and what came out (std_msgs/String, JSON), for
  whoever wants to decide it again; made only for subscribers.
- `/diagnostics`: once a second, what it decides with and how fast.

Calls
-----
- `place_box` (action): one goal at a time.
- `check_placements` (service): which of its best candidates the arm can do.
- `swap_bin` (service): when nothing fits into the open bins.
"""

from __future__ import annotations

import sys
import time
import uuid
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.msg import SetParametersResult
from rclpy.action import ActionClient
from rclpy.parameter import Parameter
from std_msgs.msg import String
from unique_identifier_msgs.msg import UUID  # type: ignore[import-untyped]

from pack_msgs.action import PlaceBox
from pack_msgs.msg import (
    PlacementDecision,
)
from pack_msgs.srv import SwapBin
from pack_msgs_py.cell_values import Decision
from pack_msgs_py.closing import ClosingReason
from pack_msgs_py.one_source import new_session
from pack_msgs_py.orientation import at_pick
from pack_msgs_py.parameter_fields import check_value, parameter_fields
from pack_msgs_py.picking import expected_pick
from pack_msgs_py.ros import qos
from pack_msgs_py.ros.conversions import (
    closing_to_ros,
    decision_to_ros,
    placement_to_ros,
    pose_to_ros,
    report_from_ros,
    time_to_ros,
)
from pack_msgs_py.ros.declare_parameters import declare_parameters
from pack_msgs_py.ros.managed_node import NOT_ACTIVE, ManagedNode
from pack_msgs_py.ros.run_node import run_node
from pack_msgs_py.ros.sourced import PLANNER, SourcedPublisher, Sources
from pack_msgs_py.values import Bin, frame_name
from pack_planner.coordination.alternatives import Planned, planned, quick
from pack_planner.coordination.coordinator import Coordinator
from pack_planner.coordination.doing import STARTING, Doing
from pack_planner.coordination.negotiation import Asking
from pack_planner.coordination.patience import Patience
from pack_planner.coordination.planning_record import PlanningQuestion, record_of, record_to_json
from pack_planner.coordination.planning_time import PlanningTime
from pack_planner.coordination.worker import Worker
from pack_planner.decision.pick_point import pick_pose
from pack_planner.decision.planner import Planner
from pack_planner.decision.policy import DecisionState
from pack_planner.parameters import PlannerParameters, counted_node_s, settings
from pack_planner.ros.asking import ArmAsker
from pack_planner.ros.diagnostics import Diagnostics
from pack_planner.ros.inputs import PlannerInputs

STEP_PERIOD_S = 0.1
#: Number of the job that only warms up; decisions count from 1.
WARM_UP = 0
#: Longest that a stopping node waits for a computation that cannot be interrupted.
STOP_TIMEOUT_S = 1.0

Result = tuple[int, 'Planned | None', str]


class PlannerNode(ManagedNode):
    """See the module; while it is not active it decides nothing, and hears all the same."""

    def __init__(self, **node_options: Any) -> None:  # noqa: ANN401 - rclpy's own options
        """``node_options`` go to :class:`rclpy.node.Node`."""
        super().__init__('planner', **node_options)
        self.parameters = declare_parameters(self, PlannerParameters)
        settings(self.parameters)  # refuses what no single parameter can tell
        self.add_on_set_parameters_callback(self._change)
        self._sequence = 0
        self.begin()

    def make(self) -> None:
        """Everything that hears, decides and tells."""
        self._planner: Planner | None = None
        self._warm = False
        self._follower: Planner | None = None
        self._guard = self.create_guard_condition(self._fetch)
        self._worker: Worker[Result] = Worker(self._guard.trigger, 'planning')
        self.at_release(lambda: self._worker.stop(STOP_TIMEOUT_S))
        self._worker.submit(partial(self._answer, WARM_UP, None, 1))
        p = self.parameters
        asking = _asking(p)
        patience = Patience(p.look_ahead, p.min_look_ahead, p.patience_s)
        self.coordinator = Coordinator(self, time.monotonic, p.look_ahead, asking, patience)

        self._session = new_session()
        self._sources = Sources(self, (PLANNER, self._session))
        self._decisions = SourcedPublisher(self, PlacementDecision, 'placements', self._session)
        self._closings = self.create_publisher(
            DiagnosticStatus, 'bin_closing', qos.TOPICS['bin_closing']
        )
        self._questions: dict[int, PlanningQuestion] = {}
        self._records = self.create_publisher(String, '~/planning_record', 100)
        self._action = ActionClient(self, PlaceBox, 'place_box')
        self._swap_bin = self.create_client(SwapBin, 'swap_bin')
        self._asker = ArmAsker(self, self.coordinator.on_checked)
        self._diagnostics = Diagnostics(self, self._doing)
        self._inputs = PlannerInputs(self, self.coordinator, self._sources, p.frame_prefix)
        self.create_timer(STEP_PERIOD_S, self._tick)
        self._hold(quiet=True)
        self.get_logger().info(
            f'planning with {p.algorithm}, profile {p.profile}, look-ahead {p.look_ahead}; '
            'waiting for the belt and the arm'
        )

    def set_active(self, *, active: bool) -> None:
        """Decide, or begin nothing new; the goal that the arm has is brought to its end."""
        self._hold(quiet=True)
        self.coordinator.step()

    def busy(self) -> str:
        """A computation cannot be interrupted."""
        return 'a decision is being computed' if self._worker.is_busy else ''

    def stop(self) -> bool:
        """Stop computing; whether the computation that was running has ended."""
        return self.release()

    def _tick(self) -> None:
        self._inputs.look()
        self._hold()
        self.coordinator.step()

    def _hold(self, *, quiet: bool = False) -> None:
        second = self._sources.second()
        several = second and f'one source for each stream: {second}'
        self.coordinator.hold(several if self.is_active else NOT_ACTIVE, quiet=quiet)

    def _change(self, changes: list[Parameter]) -> SetParametersResult:
        """Take changed parameters; they hold from the next decision on."""
        specs = {spec.name: spec for spec in parameter_fields(PlannerParameters)}
        try:
            values: dict[str, Any] = {
                change.name: check_value(specs[change.name], change.value)
                for change in changes
                if change.name in specs
            }
            wanted = replace(self.parameters, **values)
            settings(wanted)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        self.parameters = wanted
        if self.is_configured:
            self.coordinator.asking = _asking(wanted)
        return SetParametersResult(successful=True)

    # --- computing ---------------------------------------------------------------------------

    def _ready_planner(self) -> Planner:
        """The planner under the parameters of now; the first call compiles the search."""
        wanted = settings(self.parameters)
        if self._planner is None:
            self._planner = Planner(wanted, time.perf_counter)
        self._planner.use(wanted)
        return self._planner

    def _ready_follower(self) -> Planner:
        """Who names alternatives: the planner itself, or a quick one instead of a thorough one."""
        wanted = quick(settings(self.parameters))
        if self._follower is None:
            self._follower = Planner(wanted, time.perf_counter)
        else:
            self._follower.use(wanted)
        return self._follower

    def _answer(self, number: int, state: DecisionState | None, count: int) -> Result:
        """A job of the worker; without a state it only warms up."""
        try:
            planner = follower = self._ready_planner()
            if quick(settings(self.parameters)) != settings(self.parameters):
                follower = self._ready_follower()
            if state is None:
                return (number, None, '')
            return (number, planned(planner.decide, follower.decide, state, count), '')
        except Exception as error:
            # whatever went wrong with one decision, the node must go on hearing the arm
            return (number, None, f'{type(error).__name__}: {error}')

    def _doing(self) -> Doing:
        """What is done; compiling the search may take minutes on a busy machine."""
        return self.coordinator.doing() if self._warm else STARTING

    def _fetch(self) -> None:
        for number, planned_step, error in self._worker.fetch():
            self._warm = True
            self.coordinator.on_planned(number, planned_step, error)
            # Last, since the arm waits for what comes of it.
            self._tell_record(number, planned_step)

    def _tell_record(self, number: int, planned_step: Planned | None) -> None:
        question = self._questions.pop(number, None)
        for old in [earlier for earlier in self._questions if earlier < number]:
            del self._questions[old]
        if question is None or planned_step is None:
            return
        if self._records.get_subscription_count():
            text = record_to_json(record_of(question, planned_step))
            self._records.publish(String(data=text))

    def plan(self, number: int, state: DecisionState, candidates: int) -> None:
        """Compute a decision in the worker's thread."""
        self._questions[number] = PlanningQuestion(number, state, candidates, self.parameters)
        self._worker.submit(partial(self._answer, number, state, candidates))

    # --- outputs -----------------------------------------------------------------------------

    def announce(self, decision: Decision, bins: tuple[Bin, ...]) -> Decision:
        """Publish a decision on `placements`; returns it numbered and stamped."""
        self._sequence += 1
        stamped = replace(decision, sequence=self._sequence, stamp_s=self._now_s())
        self._decisions.publish(decision_to_ros(stamped, _frame(stamped, bins)))
        self._diagnostics.note(stamped)
        return stamped

    def send(self, decision: Decision, target: Bin, unhidden_s: float) -> bytes:
        """Send the goal of `place_box`; returns its id."""
        goal_id = uuid.uuid4().bytes
        goal = PlaceBox.Goal(placement=placement_to_ros(decision, frame_name(target.station)))
        goal.placement.source.session = self._session
        goal.pick_pose.header.frame_id = 'cell'
        goal.pick_pose.header.stamp = self.get_clock().now().to_msg()
        rule = settings(self.parameters).profile.orientations
        lies = at_pick(decision.orientation, rule)
        pick = expected_pick(pick_pose(decision.box, lies), decision.box.id, self._inputs.scan)
        goal.pick_pose.pose = pose_to_ros(pick)
        goal.deadline = time_to_ros(self._now_s() + self.parameters.deadline_s - unhidden_s)
        if not self._action.server_is_ready():
            self.get_logger().warning('place_box has no server yet', throttle_duration_sec=5.0)
        answer = self._action.send_goal_async(goal, goal_uuid=UUID(uuid=list(goal_id)))
        answer.add_done_callback(partial(self._on_answer, goal_id))
        return goal_id

    def _on_answer(self, goal_id: bytes, future: Any) -> None:  # noqa: ANN401 - rclpy's future
        handle = future.result()
        self.coordinator.on_answer(goal_id, accepted=handle.accepted)
        if handle.accepted:
            handle.get_result_async().add_done_callback(partial(self._on_result, goal_id))

    def _on_result(self, goal_id: bytes, future: Any) -> None:  # noqa: ANN401 - rclpy's future
        report = None
        try:
            report = report_from_ros(future.result().result.report)
        except ValueError as error:
            self.get_logger().error(f'report in the result of place_box ignored: {error}')
        self.coordinator.on_result(goal_id, report)

    def check(self, number: int, candidates: Sequence[Decision], enough_s: float) -> None:
        """Call `check_placements`."""
        frames = {
            target.id: frame_name(target.station) for target in self._inputs.known_bins.values()
        }
        self._asker.ask(number, candidates, frames, enough_s)

    def closing(self, reason: ClosingReason) -> None:
        """Publish on `bin_closing`."""
        self._closings.publish(closing_to_ros(reason))

    def swap(self, target: Bin, destination: str) -> None:
        """Call `swap_bin`."""
        request = SwapBin.Request(
            bin_id=target.id, bin_revision=target.revision, destination=destination
        )
        answer = self._swap_bin.call_async(request)
        answer.add_done_callback(self._on_swapped)

    def _on_swapped(self, future: Any) -> None:  # noqa: ANN401 - rclpy's future
        response = future.result()
        self.coordinator.on_swapped(success=response.success, message=response.message)

    def refresh_bins(self) -> None:
        """Subscribe to `bin_state` anew: that brings the current one for sure."""
        self._inputs.refresh_bins()

    def info(self, text: str) -> None:
        """Log for the operator."""
        self.get_logger().info(text)

    def warn(self, text: str) -> None:
        """Log for the operator, what repeats at most every other second."""
        self.get_logger().warning(text, throttle_duration_sec=2.0)

    def _now_s(self) -> float:
        return self.get_clock().now().nanoseconds * 1e-9


def _asking(p: PlannerParameters) -> Asking:
    time_counted = PlanningTime(counted_node_s(p))
    return Asking(p.candidates, p.check_timeout_s, p.deadline_s, time_counted)


def _frame(decision: Decision, bins: tuple[Bin, ...]) -> str:
    """Frame of the bin that ``decision`` is about; empty for a rejected box."""
    return next((frame_name(target.station) for target in bins if target.id == decision.bin_id), '')


def main(args: list[str] | None = None) -> None:
    """Run the node until SIGINT or SIGTERM; ends with code 2 on bad parameters."""
    # With Python's 5 ms, a decision waits that long for a thread that is busy with messages.
    sys.setswitchinterval(0.0005)
    # Compiling cannot be interrupted: stop() then says that its thread goes on.
    run_node('planner', PlannerNode, args=args, stop=PlannerNode.stop)
