"""Scans in frame `cell`, whatever frame the scanner gives them in (imports ROS)."""

from __future__ import annotations

from dataclasses import replace

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

from pack_msgs_py.cell_values import Scan
from pack_msgs_py.geometry.frames import FrameTree, composed
from pack_msgs_py.geometry.pose import Pose, rotated
from pack_msgs_py.ros.conversions.basic import time_from_ros

#: The frame in which the cell reckons.
CELL_FRAME = 'cell'
#: As tf2 listens.
MOVING_FRAMES = QoSProfile(depth=100)
STATIC_FRAMES = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class ScanFrames:
    """Brings scans into frame `cell`, by what ``node`` hears on `/tf` and `/tf_static`.

    It listens there only once a scan has come in another frame. Where several cells share one tree
    of frames that one is called `cell` with ``frame_prefix`` before it.
    """

    def __init__(self, node: Node, frame_prefix: str = '') -> None:
        self._node = node
        self._cell = frame_prefix + CELL_FRAME
        self._tree = FrameTree()
        self._listens = False

    def in_cell(self, scan: Scan) -> Scan:
        """``scan`` with its poses, and the belt's velocity, in frame `cell`.

        Raises
        ------
        UnknownTransform
            Nobody has told yet where the frame of the scan is; the message says how to.
        """
        if scan.frame_id == CELL_FRAME:
            return scan
        if scan.frame_id == self._cell:
            return replace(scan, frame_id=CELL_FRAME)
        frame = self.pose_in_cell(scan.frame_id, scan.stamp_s)
        boxes = tuple(replace(item, pose=composed(frame, item.pose)) for item in scan.boxes)
        velocity = rotated(frame.quaternion, scan.belt_velocity)
        return replace(scan, frame_id=CELL_FRAME, boxes=boxes, belt_velocity=velocity)

    def pose_in_cell(self, frame_id: str, stamp_s: float) -> Pose:
        """Pose of a frame in `cell` at ``stamp_s``; raises as :meth:`in_cell` does."""
        if frame_id in (CELL_FRAME, self._cell):
            return Pose()
        self._listen()
        return self._tree.pose_of(frame_id, self._cell, stamp_s)

    def _listen(self) -> None:
        if self._listens:
            return
        self._listens = True
        for topic, profile, static in (
            ('/tf', MOVING_FRAMES, False),
            ('/tf_static', STATIC_FRAMES, True),
        ):

            def hear(msg: TFMessage, static: bool = static) -> None:
                self._hear(msg, static)

            self._node.create_subscription(TFMessage, topic, hear, profile)

    def _hear(self, msg: TFMessage, static: bool) -> None:
        for item in msg.transforms:
            shift, turn = item.transform.translation, item.transform.rotation
            pose = Pose((shift.x, shift.y, shift.z), (turn.x, turn.y, turn.z, turn.w))
            self._tree.add(
                item.child_frame_id,
                item.header.frame_id,
                pose,
                time_from_ros(item.header.stamp),
                is_static=static,
            )
