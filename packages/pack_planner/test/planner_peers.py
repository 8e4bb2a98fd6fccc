"""A scripted belt and arm that talk to the planner node over ROS, for tests in one process."""

from __future__ import annotations

import threading
from contextlib import contextmanager, suppress
from dataclasses import replace

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.node import Node

from pack_msgs.action import PlaceBox
from pack_msgs.msg import (
    BinStateArray,
    BoxEvent,
    BoxScan,
    ExecutorState,
    PlacementCheck,
    PlacementDecision,
    PlacementReport,
)
from pack_msgs.srv import CheckPlacements, SwapBin
from pack_msgs_py.cell_values import BinSnapshot, Report, Scan, ScannedBox
from pack_msgs_py.cell_values import BoxEvent as Event
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Mode
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.orientation import QUATERNIONS, oriented_size
from pack_msgs_py.ros import qos
from pack_msgs_py.ros.conversions import (
    bins_to_ros,
    duration_to_ros,
    event_to_ros,
    placement_from_ros,
    report_to_ros,
    scan_to_ros,
)
from pack_msgs_py.ros.testing import Spinner
from pack_msgs_py.values import Bin
from pack_planner.decision.planner import expected_bins

#: Nothing takes that long, also on a busy machine.
TIMEOUT_S = 30.0


def rests(placed):
    """The pose of a box that stands in the middle of its place, as it was turned."""
    (x, y, z), (length, breadth, _) = placed.corner_mm, placed.size_mm
    height = oriented_size(placed.box.size_mm, placed.orientation)[2]
    middle = (x + length / 2, y + breadth / 2, z + height / 2)
    return Pose(tuple(part / 1000 for part in middle), QUATERNIONS[placed.orientation])


class Mailbox:
    """Things that arrived, to wait for."""

    def __init__(self):
        self._changed = threading.Condition()
        self.items = []

    def put(self, item):
        with self._changed:
            self.items.append(item)
            self._changed.notify_all()

    def has(self, wanted, timeout):
        """Whether an item that is ``wanted`` is there within ``timeout`` seconds."""
        with self._changed:
            return self._changed.wait_for(lambda: any(map(wanted, self.items)), timeout)

    def wait(self, count, timeout=TIMEOUT_S):
        """The item number ``count``, from 1."""
        with self._changed:
            arrived = self._changed.wait_for(lambda: len(self.items) >= count, timeout)
            assert arrived, f'{len(self.items)} of {count} arrived: {self.items}'
            return self.items[count - 1]


class Peers(Node):
    """The belt and the arm. ``script`` holds an error code per goal; then all goals succeed.

    A goal of the script with a code below 120 is refused, one with ``None`` is accepted and never
    ended. Goals end only while :attr:`release` is set. With ``answers``, codes for candidates, the
    arm can be asked first.
    """

    def __init__(self, context, boxes, bins, *, script=(), remaining=0, look_ahead=5, answers=None):
        super().__init__('peers', context=context)
        self.stream, self.bins = list(boxes), tuple(bins)
        self.belt = [self.stream.pop(0) for _ in range(min(look_ahead, len(self.stream)))]
        self.script = list(script)
        self.look_ahead, self.remaining = look_ahead, remaining
        self.mode, self.active = Mode.IDLE, ''
        self.beating = True
        self.sequence = 0
        self.announced, self.goals, self.swapped = Mailbox(), Mailbox(), Mailbox()
        self.release = threading.Event()
        self.release.set()

        def publisher(kind, name):
            return self.create_publisher(kind, name, qos.TOPICS[name])

        self._scan = publisher(BoxScan, 'box_scan')
        self._bins = publisher(BinStateArray, 'bin_state')
        self._events = publisher(BoxEvent, 'box_event')
        self._reports = publisher(PlacementReport, 'placement_report')
        self._beat = publisher(ExecutorState, 'executor_state')
        self.create_subscription(
            PlacementDecision,
            'placements',
            lambda msg: self.announced.put((msg, self.now_s())),
            qos.TOPICS['placements'],
        )
        self.create_timer(0.1, self._heartbeat)
        self.create_service(SwapBin, 'swap_bin', self._swap)
        self.answers, self.asked = answers, Mailbox()
        if answers is not None:
            self.create_service(CheckPlacements, 'check_placements', self._check)
        self._server = ActionServer(
            self, PlaceBox, 'place_box', self._carry_out, goal_callback=self._admit,
            handle_accepted_callback=self._accepted,
            cancel_callback=lambda _handle: CancelResponse.ACCEPT,
        )  # fmt: skip

    def destroy_node(self):
        # The server holds the node, which would stay in its domain when a next test has that.
        self._server.destroy()
        super().destroy_node()

    def now_s(self):
        return self.get_clock().now().nanoseconds * 1e-9

    def send_scan(self, spoil=None):
        """Publish the belt; ``spoil`` changes the message first."""
        self.sequence += 1
        items = tuple(ScannedBox(box, Pose()) for box in self.belt)
        msg = scan_to_ros(
            Scan(self.sequence, self.now_s(), items, remaining=len(self.stream) + self.remaining)
        )
        if spoil is not None:
            spoil(msg)
        self._scan.publish(msg)

    def send_bins(self):
        poses = {placed.box.id: rests(placed) for target in self.bins for placed in target.boxes}
        self._bins.publish(bins_to_ros(BinSnapshot(1, self.now_s(), self.bins), poses))

    def send_all(self):
        self.send_bins()
        self.send_scan()

    def _heartbeat(self):
        if self.beating:
            self.beat()

    def beat(self):
        msg = ExecutorState(mode=int(self.mode), active_box_id=self.active)
        msg.header.stamp = self.get_clock().now().to_msg()
        self._beat.publish(msg)
        self._beat.assert_liveliness()

    def _swap(self, request, response):
        self.swapped.put(request.bin_id)
        serial = max(target.serial for target in self.bins) + 1
        closed = next(target for target in self.bins if target.id == request.bin_id)
        others = [target for target in self.bins if target is not closed]
        self.bins = (*others, Bin(f'bin-{serial}', serial, closed.spec))
        response.success = True
        self.send_bins()
        return response

    def _check(self, request, response):
        """Each candidate gets the next of the scripted codes; then all can be done."""
        self.asked.put(request)
        for _ in request.candidates:
            code = self.answers.pop(0) if self.answers else ErrorCode.NONE
            motion_time = duration_to_ros(0.0 if code else 3.0)
            response.checks.append(PlacementCheck(error_code=int(code), motion_time=motion_time))
        return response

    def _report(self, decision, code, goal_id=bytes(16)):
        report = Report(
            decision.box.id, decision.bin_id, decision.bin_serial, decision.bin_revision,
            code, 'as scripted' if code else '', goal_id=goal_id, stamp_s=self.now_s(),
        )  # fmt: skip
        return report_to_ros(report)

    def _admit(self, goal):
        decision = placement_from_ros(goal.placement)
        code = self.script[0] if self.script else ErrorCode.NONE
        if code is not None and 0 < code < ErrorCode.GRASP_FAILED:
            self.script.pop(0)
            self._reports.publish(self._report(decision, code))
            self.goals.put((goal, decision))
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _accepted(self, handle):
        decision = placement_from_ros(handle.request.placement)
        self.mode, self.active = Mode.EXECUTING, decision.box.id
        code = self.script.pop(0) if self.script else ErrorCode.NONE
        self.goals.put((handle.request, decision))
        if code is None:
            return
        handle.code = code
        threading.Thread(target=self._move, args=(handle, decision), daemon=True).start()

    def _move(self, handle, decision):
        """Pick, refill the belt, and end once released."""
        self._event(decision, BoxEventKind.PICKED)
        self.belt = [box for box in self.belt if box.id != decision.box.id]
        if self.stream and len(self.belt) < self.look_ahead:
            self.belt.append(self.stream.pop(0))
        self.send_scan()
        if self.release.wait(TIMEOUT_S):
            # when the test is over, so is the executor
            with suppress(AttributeError):
                handle.execute()

    def _event(self, decision, kind):
        self._events.publish(event_to_ros(Event(decision.box.id, kind, stamp_s=self.now_s())))

    def _carry_out(self, handle):
        decision, code = placement_from_ros(handle.request.placement), handle.code
        if code.box_is_in_bin:
            self._event(decision, BoxEventKind.PLACED)
            self.bins = expected_bins(self.bins, replace(decision))
            self.send_bins()
        else:
            self._event(decision, BoxEventKind.RETURNED)
            self.belt.insert(0, decision.box)
            self.send_scan()
        self.mode, self.active = Mode.IDLE, ''
        msg = self._report(decision, code, bytes(handle.goal_id.uuid))
        self._reports.publish(msg)
        handle.succeed() if code == ErrorCode.NONE else handle.abort()
        return PlaceBox.Result(error_code=int(code), report=msg)


@contextmanager
def spinning(node, context):
    """Spin ``node`` in a thread of its own."""
    with Spinner(context) as spinner:
        yield spinner.add(node)
