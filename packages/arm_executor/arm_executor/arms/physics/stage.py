"""A cell that is only looked at: robot, blocks and boxes wherever they are put; nothing falls."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import pybullet
from numpy.typing import NDArray

from arm_executor.arms.physics.render import Camera, take_picture
from arm_executor.model import bullet, colours
from arm_executor.model.layout import Block
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Vec3


class Stage:
    """Owns a physics client; metres, radians, frame `cell`.

    Parameters
    ----------
    urdf : the robot; empty for none.
    blocks : what stands still, each with its colour.
    """

    def __init__(self, urdf: str, blocks: Iterable[tuple[Block, colours.Colour]]) -> None:
        self._client = bullet.connect()
        self._robot = bullet.load_robot(self._client, urdf) if urdf else None
        self._links: dict[str, int] = {}
        self._joints: dict[str, int] = {}
        if self._robot is not None:
            self._links = {
                name: link for link, name in bullet.link_names(self._client, self._robot).items()
            }
            self._joints = {
                name: joint for joint, name in bullet.joint_names(self._client, self._robot).items()
            }
        self._boxes: dict[str, tuple[Vec3, int]] = {}
        self._parts: dict[str, list[int]] = {}
        for block, colour in blocks:
            bullet.add_block(self._client, block, colour)

    def put_joints(self, positions: Mapping[str, float]) -> None:
        """Set joints by their names; unknown ones are passed over."""
        for name, value in positions.items():
            if name in self._joints:
                pybullet.resetJointState(
                    self._robot, self._joints[name], value, physicsClientId=self._client
                )

    def link_pose(self, name: str) -> Pose | None:
        """Where a link of the robot is; ``None`` when it has none of that name."""
        if name not in self._links:
            return None
        state = pybullet.getLinkState(
            self._robot,
            self._links[name],
            computeForwardKinematics=1,
            physicsClientId=self._client,
        )
        return Pose(tuple(state[4]), tuple(state[5]))

    def put_boxes(self, boxes: Mapping[str, tuple[Vec3, Pose]]) -> None:
        """Show exactly these boxes, by id with edges and the pose of the centre."""
        for box_id in [known for known in self._boxes if known not in boxes]:
            self._remove(self._boxes.pop(box_id)[1])
        for box_id, (size, pose) in boxes.items():
            known = self._boxes.get(box_id)
            if known is not None and known[0] != size:
                self._remove(known[1])
                known = None
            if known is None:
                shade = colours.carton(box_id)
                number = bullet.add_box(self._client, size, pose, colour=shade, collides=False)
                self._boxes[box_id] = (size, number)
            else:
                bullet.move_box(self._client, known[1], pose)

    def put_parts(self, parts: Mapping[str, Iterable[tuple[Block, colours.Colour]]]) -> None:
        """Show exactly these groups of blocks, by name; one that is there already stays."""
        for name in [known for known in self._parts if known not in parts]:
            for number in self._parts.pop(name):
                self._remove(number)
        for name, blocks in parts.items():
            if name not in self._parts:
                self._parts[name] = [
                    bullet.add_block(self._client, block, colour) for block, colour in blocks
                ]

    def picture(self, width: int, height: int, camera: Camera) -> NDArray[np.uint8]:
        """What is to be seen, (height, width, 3)."""
        return take_picture(self._client, width, height, camera)

    def close(self) -> None:
        """End the client."""
        pybullet.disconnect(physicsClientId=self._client)

    def _remove(self, number: int) -> None:
        pybullet.removeBody(number, physicsClientId=self._client)
