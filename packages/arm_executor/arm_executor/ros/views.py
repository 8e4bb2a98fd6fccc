"""What viewers need: joints, transforms, the robot's description, markers (imports ROS).

- `joint_states` (sensor_msgs/JointState), with velocities: 20 Hz while the arm moves, else 10 Hz
- `/tf` (tf2_msgs/TFMessage): the moving joints, together with `joint_states`
- `robot_time` (rosgraph_msgs/Clock): robot time from the start of the node on, with each of these
  where it passes faster than on the wall, else 10 Hz
- `/tf_static`: fixed parts of the arm, `belt` (head of the belt) and the frames of the bins
- `robot_description` (std_msgs/String): the URDF
- `~/markers` (visualization_msgs/MarkerArray): bins, belt, boxes; on change, at most 5 Hz

Times are wall-clock: a fast simulation is shown as fast as it goes, and watching does not slow it.
What costs is made only for subscribers. Positions are told to a micrometre or a microradian.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from arm_executor.bins.book import BookState
from arm_executor.model.layout import Layout, bin_frame
from arm_executor.model.robot_data import find_robot
from arm_executor.model.tree import ROOT, Joint, cell_joints, described_joints
from arm_executor.model.urdf import cell_urdf
from arm_executor.ros.markers import MarkerNumbers, Scene, markers
from arm_executor.ros.robot_time import RobotTime
from pack_msgs_py.cell_values import BoxEvent, Scan
from pack_msgs_py.codes import BoxEventKind
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.ros import qos
from pack_msgs_py.values import STATIONS, BinSpec, frame_name

JOINTS_PERIOD_S, MARKERS_PERIOD_S = 0.05, 0.2
#: An arm at rest says where it is less often, but often enough for who looks up a transform of now.
REST_PERIOD_S = 0.1
_AT_REST = round(REST_PERIOD_S / JOINTS_PERIOD_S)

#: What is told of positions, metres and radians: a whole number of these. Digits below that are
#: noise which no viewer shows, and were a third of what a recording of joints and transforms took.
_GRAIN = 2.0**-20

Joints = tuple[tuple[str, ...], tuple[float, ...]]


def coarse(values: Iterable[float]) -> tuple[float, ...]:
    """``values`` to the nearest micro of their unit, as numbers with few bits.

    >>> coarse((0.1234567890123,))
    (0.12345695495605469,)
    """
    return tuple((_GRAIN * np.rint(np.array([*values]) / _GRAIN)).tolist())


def velocities(before: Joints, now: Joints, seconds: float) -> list[float]:
    """By how much each joint has moved a second since ``before``: m/s, rad/s; 0 for a first look.

    Of robot time, whatever the speed on the wall: so they can be held against the joints' limits.
    """
    if before[0] != now[0] or seconds <= 0:
        return [0.0] * len(now[1])
    return [(b - a) / seconds for a, b in zip(before[1], now[1], strict=True)]


class Views:
    """The publishers above, with their timers.

    Parameters
    ----------
    node : whose publishers they are.
    layout : where everything stands.
    spec : kind of every bin.
    joints : names and positions of the joints now; both empty for an arm without any.
    shows_robot : whether there is a robot to show.
    robot_time : what tells it.
    frame_prefix : stands before the name of every frame in transforms and markers.
    """

    def __init__(
        self,
        node: Node,
        layout: Layout,
        spec: BinSpec,
        joints: Callable[[], Joints],
        shows_robot: bool,
        robot_time: RobotTime,
        frame_prefix: str = '',
    ) -> None:
        self._node, self._layout, self._joints = node, layout, joints
        self._prefix = frame_prefix
        self._time = robot_time
        robot = find_robot(layout.robot)
        self._tree = described_joints(robot, layout) if shows_robot else ()
        self._last: Joints = ((), ())
        self._last_s = 0.0
        self._rested = 0
        self._scene = Scene(layout, cell_joints(robot, layout) if shows_robot else ())
        self._numbers = MarkerNumbers()
        self._changed = True
        self._watchers = 0
        self._states = node.create_publisher(JointState, 'joint_states', 10)
        self._tf = node.create_publisher(TFMessage, '/tf', 100)
        self._static = node.create_publisher(TFMessage, '/tf_static', qos.STATE)
        self._description = node.create_publisher(String, 'robot_description', qos.STATE)
        self._markers = node.create_publisher(MarkerArray, '~/markers', qos.STATE)
        if shows_robot:
            self._description.publish(String(data=cell_urdf(robot, layout, described=True)))
        self._static.publish(TFMessage(transforms=self._fixed(spec)))
        node.create_timer(JOINTS_PERIOD_S, self._show_joints)
        node.create_timer(MARKERS_PERIOD_S, self._show_markers)

    # -- what happens in the cell ----------------------------------------------------------------

    def bins(self, state: BookState) -> None:
        """The bins are now like this."""
        self._scene.bins = state
        self._changed = True

    def scan(self, scan: Scan) -> None:
        """The belt is now like this."""
        self._scene.scan = scan
        self._changed = True

    def happened(self, event: BoxEvent) -> None:
        """A box went into the gripper, or out of it."""
        if event.event is BoxEventKind.PICKED:
            self._scene.pick(event.box_id, self._joints()[1])
        elif self._scene.held is not None and self._scene.held.box.id == event.box_id:
            self._scene.held = None
        self._changed = True

    # -- regularly -------------------------------------------------------------------------------

    def _show_joints(self) -> None:
        names, positions = self._joints()
        now = names, coarse(positions)
        robot_s = self._time.tell()
        self._rested = 0 if now != self._last else self._rested + 1
        if not now[0] or self._rested % _AT_REST:
            return
        stamp = self._node.get_clock().now().to_msg()
        msg = JointState(name=list(now[0]), position=list(now[1]))
        msg.velocity = coarse(velocities(self._last, now, robot_s - self._last_s))
        msg.header.stamp = stamp
        self._last, self._last_s = now, robot_s
        self._states.publish(msg)
        if self._tf.get_subscription_count():
            moving = (joint for joint in self._tree if joint.index is not None)
            transforms = [
                self._transform(joint, joint.transform(now[1]), stamp) for joint in moving
            ]
            self._tf.publish(TFMessage(transforms=transforms))

    def _show_markers(self) -> None:
        watchers = self._markers.get_subscription_count()
        # A new watcher gets the kept message only if one was ever made.
        wanted = watchers and (self._changed or watchers > self._watchers)
        self._watchers = watchers
        if wanted:
            self._changed = False
            stamp = self._node.get_clock().now().to_msg()
            shown = markers(self._scene, self._numbers, stamp)
            for marker in shown.markers:
                marker.header.frame_id = self._prefix + marker.header.frame_id
                where, turn = marker.pose.position, marker.pose.orientation
                where.x, where.y, where.z = coarse((where.x, where.y, where.z))
                turn.x, turn.y, turn.z, turn.w = coarse((turn.x, turn.y, turn.z, turn.w))
            self._markers.publish(shown)

    # -- transforms ------------------------------------------------------------------------------

    def _fixed(self, spec: BinSpec) -> list[TransformStamped]:
        stamp = self._node.get_clock().now().to_msg()
        belt = self._layout.conveyor
        head = Joint('', ROOT, 'belt', (0.0, belt.front_y, belt.top_z))
        fixed = [
            self._transform(joint, joint.transform(()), stamp)
            for joint in (*self._tree, head)
            if joint.index is None
        ]
        for station in STATIONS:
            frame = bin_frame(self._layout, station, spec)
            pose = frame.to_cell(Pose())
            fixed.append(self._transform(Joint('', ROOT, frame_name(station)), pose, stamp))
        return fixed

    def _transform(self, joint: Joint, pose: Pose, stamp: object) -> TransformStamped:
        msg = TransformStamped(child_frame_id=self._prefix + joint.child)
        msg.header.frame_id, msg.header.stamp = self._prefix + joint.parent, stamp
        shift, turn = msg.transform.translation, msg.transform.rotation
        shift.x, shift.y, shift.z = coarse(pose.position)
        turn.x, turn.y, turn.z, turn.w = coarse(pose.quaternion)
        return msg
