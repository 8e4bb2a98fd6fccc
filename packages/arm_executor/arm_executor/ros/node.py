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

from arm_executor.arms.kind import ArmSetup
from arm_executor.arms.registry import ARMS, DEFAULT_ARM, find_arm
from arm_executor.arms.true_boxes import Truth
from arm_executor.bins.book import BinBook
from arm_executor.bins.journal import Journal, JournalError
from arm_executor.bins.records import configuration
from arm_executor.bins.start_bins import check_start_bins, read_start_bins
from arm_executor.goals.bin_work import BinWork
from arm_executor.goals.condition import STARTING
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
from arm_executor.model.arm_interface import Arm
from arm_executor.model.pick_area import PickArea
from arm_executor.model.robot_data import find_robot
from arm_executor.parameters import ExecutorParameters, destinations_from, settings_from
from arm_executor.reach.layout_file import layout_for
from arm_executor.ros.goal_server import GoalServer
from arm_executor.ros.heartbeat import SteadyHeartbeat
from arm_executor.ros.messages import true_boxes_from_ros
from arm_executor.ros.operating import OperatorServices
from arm_executor.ros.publishers import Publishers
from arm_executor.ros.resolving import ResolveService
from arm_executor.ros.robot_time import RobotTime
from arm_executor.ros.services import Services
from arm_executor.ros.views import Views
from pack_msgs.msg import BoxScan, ExecutorState
from pack_msgs_py.alarms import raised
from pack_msgs_py.cell_values import Report
from pack_msgs_py.codes import ErrorCode, Mode
from pack_msgs_py.one_source import new_session
from pack_msgs_py.ros import conversions, qos
from pack_msgs_py.ros.declare_parameters import declare_parameters, given_value
from pack_msgs_py.ros.graph import node_names
from pack_msgs_py.ros.managed_node import NOT_ACTIVE, ManagedNode
from pack_msgs_py.ros.own_alarms import OwnAlarms
from pack_msgs_py.ros.run_node import run_node
from pack_msgs_py.ros.sourced import ARM, Sources
from pack_msgs_py.ros.transforms import ScanFrames
from pack_msgs_py.values import STATIONS, parse_bin

if TYPE_CHECKING:
    from arm_executor.ros.robot_link import RosRobotLink

DIAGNOSTICS_PERIOD_S = 1.0
#: The process must be gone 3 s after a signal; a motion that does not stop is left behind.
STOP_TIMEOUT_S = 2.0


class ArmExecutor(ManagedNode):
    """See the module's docstring for its interfaces.

    While it is not active it takes no goals, and keeps the books all the same.

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
        self._make_arm = make_arm
        self._kind = kind = find_arm(str(given_value(self, 'arm', DEFAULT_ARM)))
        groups = {f'{one.name}.' for one in (*ARMS, kind) if one.parameters is not None}
        self._chosen = declare_parameters(self, ExecutorParameters, others=groups)
        self._of_kind: Any = None
        if kind.parameters is not None:
            self._of_kind = declare_parameters(self, kind.parameters, prefix=f'{kind.name}.')
        self.begin()

    def make(self) -> None:
        """Layout, journal and bins, the arm on its thread, and all that hears and tells."""
        kind, parameters = self._kind, self._chosen
        self._outputs: queue.SimpleQueue[Output] = queue.SimpleQueue()
        self._mode = Mode.INACTIVE
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
        self.at_release(self._journal.close)
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
            parameters=self._of_kind,
        )
        if kind.has_driver and self._make_arm is None:
            link = self._linked(setup)
            self.at_release(link.close)
            setup = replace(setup, link=link)
        self._core = ExecutorCore(
            self._book,
            settings,
            partial(self._make_arm or kind.make, setup),
            self._emit,
            wall=self._now_s,
        )
        session = new_session()
        self._publish = Publishers(self, session)
        self._heart = SteadyHeartbeat(self._publish.heartbeat_again, qos.HEARTBEAT_PERIOD_S)
        self.at_release(self._heart.end)
        self._sources = Sources(self, (ARM, session))
        self._second = ''
        self._time = RobotTime(
            self,
            self._core.robot_time,
            as_clock=parameters.publish_clock,
            paced=0 < parameters.speed <= 1,
        )
        self._views = Views(
            self,
            self._layout,
            spec,
            self._core.joints,
            kind.moves_robot and not kind.has_driver,
            self._time,
            parameters.frame_prefix,
        )
        self._wake = self.create_guard_condition(self._drain)
        self._make_interfaces()
        self._core.set_active(active=self.is_active)
        self._core.start()
        self.at_release(lambda: self._core.end(STOP_TIMEOUT_S))

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
        robot = find_robot(self._layout.robot)
        return RosRobotLink(self, setup.parameters, rail_at, setup.speed, robot)

    def _make_interfaces(self) -> None:
        for kind, topic, take in (
            (BoxScan, 'box_scan', self._on_scan),
            (BoxScan, qos.TRUE_BOXES, self._on_truth),
        ):
            checked = self._sources.checked(topic, take)
            self.create_subscription(kind, topic, checked, qos.heard(topic))
        others = self._sources.checked('executor_state', lambda msg: None)
        self.create_subscription(ExecutorState, 'executor_state', others, 10)
        bins = BinWork(self._core, self._book)
        self._served = Services(
            self, self._core, bins, self._layout, self._orientations, self._drain
        )
        ResolveService(self, self._core)
        OperatorServices(self, self._core, bins, self._drain, self._operated)
        # The arm does not move for the alarms of other nodes either.
        self._alarms = OwnAlarms(self, self._core.panel.hear)
        self._alarms.publish(self._core.panel.standing)
        self._goals = GoalServer(self, self._core, self._why_not, self._drain, self._now_s)
        self.create_timer(qos.HEARTBEAT_PERIOD_S, self._beat)
        self.create_timer(DIAGNOSTICS_PERIOD_S, self._publish_diagnostics)

    def _now_s(self) -> float:
        return 1e-9 * float(self.get_clock().now().nanoseconds)

    def set_active(self, *, active: bool) -> None:
        """Take goals, or no new ones; what is under way is brought to its end."""
        self._core.set_active(active=active)
        self._operated()

    def busy(self) -> str:
        """A box that is under way, or an arm that is not there yet."""
        status = self._core.status()
        if status.mode is Mode.INACTIVE and status.message == STARTING:
            return 'the arm is being made ready'
        return status.active_box and f'box {status.active_box!r} is under way'

    def stop_motion(self) -> bool:
        """Leave the arm still; ``False`` when its thread could not be ended in time."""
        return self.release()

    def _why_not(self, session: int) -> str:
        """Why no goal of this session of a planner is taken: it is the only one that speaks."""
        if not self.is_active:
            return NOT_ACTIVE
        return self._sources.goal(session, lambda: None) or self._sources.second()

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
        if isinstance(output, (Happened, Finished)):
            self._time.tell_at_once()
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
                self._goals.progress(output)
            case Finished():
                self._end_goal(output.report)
                self._served.goal_ended()
            case Replied():
                output.ticket.set_result(output.answer)
            case AlarmsChanged():
                self._alarms.publish(output.alarms)
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
        """Report, then result."""
        if report.code is ErrorCode.NONE:
            self.get_logger().info(
                f'box {report.box_id!r} placed in {report.bin_id}: {report.motion_s:.2f} s motion, '
                f'{report.slack_s:.2f} s to spare'
            )
        else:
            self.get_logger().warning(f'{report.code.name}: {report.message}')
        self._goals.end(report.goal_id, self._publish.report(report))

    # -- regularly ------------------------------------------------------------------------------

    def _beat(self) -> None:
        self._core.tick()
        self._mind_second_source()
        status = self._core.status()
        self._mode = status.mode
        self._heart.beat(lambda: self._publish.heartbeat(status))

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
        self._core.panel.forget_gone(node_names(self))
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
