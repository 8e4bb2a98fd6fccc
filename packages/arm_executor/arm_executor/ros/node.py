"""Node `arm_executor`: places boxes with the arm, and owns the truth of the bins.

- action `place_box` (PlaceBox): one placement at a time; every goal is accepted by ROS and ends
  with an error code, since a rejected ROS goal could not carry one
- service `check_placements` (CheckPlacements): can the arm do these, and how long would it take
- service `swap_bin` (SwapBin): close a bin, open an empty one
- service `cut_off` (CutOff): close the bins of a destination
- service `~/resolve_box` (ResolveBox): where a box is that a crash has left in doubt
- service `~/operate` (Operate): pause, stop, reset, acknowledge, and what is done with bins; with
  who and why, for the journal
- services `~/insert_box` (InsertPlacedBox) and `~/remove_box` (RemoveBox): by hand, into a bin and
  out of it
- services `~/pause` (SetBool), `~/stop` and `~/reset` (Trigger): the same without a name
- publishes `alarms` (AlarmArray), and heeds those of other nodes
- publishes `bin_state`, `bin_closed`, `box_event`, `placement_report`, `executor_state` (10 Hz),
  `/diagnostics` (1 Hz), and for viewers what :mod:`arm_executor.ros.views` lists
- subscribes to `box_scan`, and for the simulated arms to `simulation/true_boxes` (BoxScan)
- subscribes to `executor_state`, to hear of a second executor: then no goal is taken
"""

from __future__ import annotations

import queue
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future

from arm_executor.arms.kind import ArmKind, ArmSetup
from arm_executor.arms.registry import ARMS, DEFAULT_ARM, find_arm
from arm_executor.arms.true_boxes import Truth
from arm_executor.bins.book import BinBook
from arm_executor.bins.journal import Journal, JournalError
from arm_executor.bins.records import configuration
from arm_executor.bins.start_bins import check_start_bins, read_start_bins
from arm_executor.goals.admission import Refusal
from arm_executor.goals.bin_work import BinWork
from arm_executor.goals.core import ExecutorCore
from arm_executor.goals.outputs import (
    AlarmsChanged,
    BinClosed,
    BinsChanged,
    Failed,
    Finished,
    Happened,
    Output,
    Progress,
    Replied,
    Said,
)
from arm_executor.goals.place_goal import PlaceGoal
from arm_executor.model.arm_interface import Arm
from arm_executor.model.pick_area import PickArea
from arm_executor.parameters import ExecutorParameters, destinations_from, settings_from
from arm_executor.reach.layout_file import layout_for
from arm_executor.ros.messages import (
    feedback_to_ros,
    goal_from_ros,
    true_boxes_from_ros,
    unusable_goal,
)
from arm_executor.ros.operating import OperatorServices
from arm_executor.ros.publishers import Publishers
from arm_executor.ros.resolving import ResolveService
from arm_executor.ros.services import Services
from arm_executor.ros.views import Views
from pack_msgs.action import PlaceBox
from pack_msgs.msg import AlarmArray, BoxScan, ExecutorState
from pack_msgs_py.alarms import raised
from pack_msgs_py.cell_values import Report
from pack_msgs_py.codes import ErrorCode, Mode
from pack_msgs_py.one_source import new_session
from pack_msgs_py.ros import conversions, qos
from pack_msgs_py.ros.declare_parameters import declare_parameters, given_value
from pack_msgs_py.ros.run_node import run_node
from pack_msgs_py.ros.sourced import ARM, Sources
from pack_msgs_py.ros.transforms import ScanFrames
from pack_msgs_py.values import STATIONS, parse_bin

if TYPE_CHECKING:
    from arm_executor.ros.robot_link import RosRobotLink

DIAGNOSTICS_PERIOD_S = 1.0
#: The process must be gone 3 s after a signal; a motion that does not stop is left behind.
STOP_TIMEOUT_S = 2.0
#: How long the action server keeps results for a client that asks late. All of them are told on
#: each change of one, which costs a busy client a lot.
RESULT_TIMEOUT_S = 5


class ArmExecutor(Node):
    """See the module's docstring for its interfaces.

    Parameters
    ----------
    make_arm : builds the arm instead of the kind that the parameter ``arm`` names.
    node_arguments : those of :class:`rclpy.node.Node`.

    Raises
    ------
    ValueError, JournalError
        A parameter, or the journal in ``state_dir``, cannot be used.
    """

    def __init__(
        self,
        *,
        make_arm: Callable[[ArmSetup], Arm] | None = None,
        **node_arguments: Any,  # noqa: ANN401 - handed on to rclpy
    ) -> None:
        super().__init__('arm_executor', **node_arguments)
        self._outputs: queue.SimpleQueue[Output] = queue.SimpleQueue()
        self._handles: dict[bytes, ServerGoalHandle] = {}
        self._results: dict[bytes, Future] = {}
        self._mode = Mode.INACTIVE
        self._link: RosRobotLink | None = None
        kind = find_arm(str(given_value(self, 'arm', DEFAULT_ARM)))
        groups = {f'{one.name}.' for one in (*ARMS, kind) if one.parameters is not None}
        parameters = declare_parameters(self, ExecutorParameters, others=groups)
        spec = parse_bin(parameters.bin_type)
        stations = STATIONS[: parameters.open_bins]
        self._layout = layout_for(
            parameters.layout,
            parameters.robot,
            dict.fromkeys(stations, spec),
            must_reach=kind.moves_robot,
        )
        limit = None if kind.lifting_limit is None else kind.lifting_limit(self._layout)
        settings = settings_from(parameters, limit)
        settings = replace(settings, pick_area=PickArea(self._layout))
        self._orientations = settings.profile.orientations
        self._journal = Journal(parameters.state_dir, configuration(spec, settings.profile))
        destinations = destinations_from(parameters)
        self._book = BinBook(self._journal, spec, parameters.open_bins, self._now_s, destinations)
        if parameters.start_bins:
            start = read_start_bins(Path(parameters.start_bins))
            check_start_bins(start, spec, parameters.open_bins, settings.profile)
            self._book.begin_with(start)
        self._frames = ScanFrames(self, parameters.frame_prefix)
        self._truth = Truth(parameters.state_dir if kind.keeps_true_boxes else '')
        setup = ArmSetup(
            layout=self._layout,
            speed=parameters.speed,
            joint_jerk=None if parameters.joint_jerk < 0 else parameters.joint_jerk,
            truth=self._truth,
            parameters=self._of_kind(kind),
        )
        if kind.has_driver and make_arm is None:
            self._link = self._linked(setup)
            setup = replace(setup, link=self._link)
        self._core = ExecutorCore(
            self._book,
            settings,
            partial(make_arm or kind.make, setup),
            self._emit,
            wall=self._now_s,
        )
        session = new_session()
        self._publish = Publishers(self, session)
        self._sources = Sources(self, (ARM, session))
        self._second = ''
        self._views = Views(
            self,
            self._layout,
            spec,
            self._core.joints,
            kind.moves_robot and not kind.has_driver,
            self._core.robot_time,
            parameters.frame_prefix,
        )
        self._wake = self.create_guard_condition(self._drain)
        self._make_interfaces()
        self._core.start()

    def _of_kind(self, kind: ArmKind) -> Any:  # noqa: ANN401 - as the kind declares them
        if kind.parameters is None:
            return None
        return declare_parameters(self, kind.parameters, prefix=f'{kind.name}.')

    def _linked(self, setup: ArmSetup) -> RosRobotLink:
        # Only here: on a plain Jazzy the interfaces of a driver may not be there.
        try:
            from arm_executor.ros.robot_link import RosRobotLink
        except ImportError as error:
            msg = (
                f'{error}: arm trajectory needs control_msgs, ur_msgs and ur_dashboard_msgs; '
                'apt install ros-jazzy-control-msgs ros-jazzy-ur-msgs ros-jazzy-ur-dashboard-msgs'
            )
            raise ValueError(msg) from error
        rail_at = self._layout.rail.x_min
        return RosRobotLink(self, setup.parameters, rail_at, setup.speed)

    def _make_interfaces(self) -> None:
        for kind, topic, take in (
            (BoxScan, 'box_scan', self._on_scan),
            (BoxScan, qos.TRUE_BOXES, self._on_truth),
        ):
            checked = self._sources.checked(topic, take)
            self.create_subscription(kind, topic, checked, qos.heard(topic))
        others = self._sources.checked('executor_state', lambda msg: None)
        self.create_subscription(ExecutorState, 'executor_state', others, 10)
        self.create_subscription(AlarmArray, 'alarms', self._on_alarms, qos.ALARMS_HEARD)
        bins = BinWork(self._core, self._book)
        self._served = Services(
            self, self._core, bins, self._layout, self._orientations, self._drain
        )
        ResolveService(self, self._core)
        OperatorServices(self, self._core, bins, self._drain, self._operated)
        self._publish.alarms(self._core.panel.standing)
        self._action = ActionServer(
            self,
            PlaceBox,
            'place_box',
            self._finish,
            handle_accepted_callback=self._start_goal,
            cancel_callback=self._cancel,
            result_timeout=RESULT_TIMEOUT_S,
        )
        self.create_timer(qos.HEARTBEAT_PERIOD_S, self._beat)
        self.create_timer(DIAGNOSTICS_PERIOD_S, self._publish_diagnostics)

    def _now_s(self) -> float:
        return 1e-9 * float(self.get_clock().now().nanoseconds)

    def stop_motion(self) -> bool:
        """Leave the arm still; ``False`` when its thread could not be ended in time."""
        ended = self._core.end(STOP_TIMEOUT_S)
        if ended:
            self._journal.close()
        return ended

    def destroy_node(self) -> None:
        """Give everything back, the action server too: rclpy would leave it on the network."""
        self._action.destroy()
        if self._link is not None:
            self._link.close()
        super().destroy_node()

    # -- goals ----------------------------------------------------------------------------------

    def _start_goal(self, handle: ServerGoalHandle) -> None:
        goal_id = bytes(handle.goal_id.uuid)
        self._handles[goal_id] = handle
        self._results[goal_id] = Future()
        handle.execute()
        try:
            goal = goal_from_ros(handle.request, goal_id, self._now_s())
        except ValueError as error:
            goal = unusable_goal(handle.request, goal_id)
            self._core.refuse(goal, Refusal(ErrorCode.INVALID_GOAL, str(error)))
        else:
            self._take(goal, handle.request.placement.source.session)
        self._drain()

    def _take(self, goal: PlaceGoal, session: int) -> None:
        """Take a goal of the planner, unless somebody else speaks for a part of the cell."""
        why = self._sources.goal(session, lambda: None) or self._sources.second()
        if why:
            self._core.refuse(goal, Refusal(ErrorCode.NOT_ACTIVE, why))
        else:
            self._core.submit(goal)

    def _cancel(self, handle: ServerGoalHandle) -> CancelResponse:
        self._core.cancel(bytes(handle.goal_id.uuid))
        return CancelResponse.ACCEPT

    async def _finish(self, handle: ServerGoalHandle) -> PlaceBox.Result:
        """Wait for the report of a goal and end it; its status is EXECUTING meanwhile.

        A callback that blocked here would hold up the heartbeat and every request to cancel.
        """
        goal_id = bytes(handle.goal_id.uuid)
        result: PlaceBox.Result = await self._results[goal_id]
        del self._results[goal_id]
        code = ErrorCode(result.error_code)
        if code.box_is_in_bin:
            handle.succeed()
        elif code is ErrorCode.CANCELED and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return result

    # -- belt -----------------------------------------------------------------------------------

    def _on_scan(self, msg: BoxScan) -> None:
        try:
            scan, errors = conversions.scan_from_ros(msg)
            scan = self._frames.in_cell(scan)
        except ValueError as error:
            self.get_logger().warning(f'box_scan ignored: {error}', throttle_duration_sec=5.0)
            return
        for text in errors:
            self.get_logger().warning(text, throttle_duration_sec=5.0)
        self._core.on_scan(scan)
        self._views.scan(scan)

    def _on_truth(self, msg: BoxScan) -> None:
        try:
            self._truth.update(true_boxes_from_ros(msg))
        except ValueError as error:
            self.get_logger().warning(
                f'{qos.TRUE_BOXES} ignored: {error}', throttle_duration_sec=5.0
            )

    def _on_alarms(self, msg: AlarmArray) -> None:
        """What stands in other nodes; the arm does not move for their alarms either."""
        if msg.node == self.get_fully_qualified_name():
            return
        try:
            self._core.panel.hear(*conversions.alarms_from_ros(msg))
        except ValueError as error:
            self.get_logger().warning(f'alarms ignored: {error}', throttle_duration_sec=5.0)

    # -- what the core says ---------------------------------------------------------------------

    def _emit(self, output: Output) -> None:
        """From any thread: queue ``output`` and wake the executor, so that it goes out at once."""
        self._outputs.put(output)
        self._wake.trigger()

    def _drain(self) -> None:
        while True:
            try:
                output = self._outputs.get_nowait()
            except queue.Empty:
                break
            self._tell(output)
        if self._core.status().mode is not self._mode:
            self._beat()

    def _tell(self, output: Output) -> None:
        match output:
            case Happened():
                self._publish.event(output)
                self._views.happened(output.event)
            case BinsChanged():
                self._publish.bins(output)
                self._views.bins(output.state)
            case BinClosed():
                self._publish.closed(output)
            case Progress():
                handle = self._handles.get(output.goal_id)
                if handle is not None:
                    handle.publish_feedback(feedback_to_ros(output))
            case Finished():
                self._end_goal(output.report)
                self._served.goal_ended()
            case Replied():
                output.ticket.set_result(output.answer)
            case AlarmsChanged():
                self._publish.alarms(output.alarms)
            case Said():
                self._log(output)
            case Failed():
                raise ExecutorFailed(output.text)

    def _log(self, said: Said) -> None:
        # One call per severity: rclpy remembers it per line and raises when it changes.
        logger = self.get_logger()
        if said.level == 'info':
            logger.info(said.text)
        elif said.level == 'warning':
            logger.warning(said.text)
        else:
            logger.error(said.text)

    def _end_goal(self, report: Report) -> None:
        """Report, then result: rclpy goes on with :meth:`_finish` after this callback."""
        if report.code is ErrorCode.NONE:
            self.get_logger().info(
                f'box {report.box_id!r} placed in {report.bin_id}: {report.motion_s:.2f} s motion, '
                f'{report.slack_s:.2f} s to spare'
            )
        else:
            self.get_logger().warning(f'{report.code.name}: {report.message}')
        msg = self._publish.report(report)
        del self._handles[report.goal_id]
        self._results[report.goal_id].set_result(
            PlaceBox.Result(error_code=msg.error_code, error_msg=msg.error_msg, report=msg)
        )

    # -- regularly ------------------------------------------------------------------------------

    def _beat(self) -> None:
        self._core.tick()
        self._mind_second_source()
        status = self._core.status()
        self._mode = status.mode
        self._publish.heartbeat(status)

    def _mind_second_source(self) -> None:
        """Raise the alarm once for as long as somebody else speaks for a part of the cell."""
        second, before = self._sources.second(), self._second
        self._second = second
        alarm = raised('SECOND_SOURCE', second, self._now_s())
        if second and not before and alarm is not None:
            try:
                self._core.panel.raise_alarm(alarm)
            except JournalError as error:
                self.get_logger().error(f'{second}; and {error}')

    def _operated(self) -> None:
        """An operator has changed something: all see it at once."""
        self._beat()
        self._publish_diagnostics()

    def _publish_diagnostics(self) -> None:
        self._publish.diagnostics(self._core.status(), self._book.state, self._journal.health)


class ExecutorFailed(Exception):
    """The executor could not start."""


def main(args: list[str] | None = None) -> None:
    """Run the node until SIGINT or SIGTERM; code 2 for bad parameters or journal, 1 for no arm."""
    run_node(
        'arm_executor',
        ArmExecutor,
        args=args,
        cannot_start=(ValueError, JournalError),
        failed=(ExecutorFailed,),
        stop=ArmExecutor.stop_motion,
    )


if __name__ == '__main__':
    main()
