"""The robot in a viser scene: a shape for each of its URDF, a frame for each joint."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import viser

from arm_executor.model.robot_shapes import LinkShape, RobotShapes
from pack_msgs_py.geometry.pose import Pose

#: Below which the joints of the robot hang.
ROOT = '/robot'


class DrawnRobot:
    """``robot`` in the scene of ``server``; :meth:`move` sends only joints that have moved."""

    def __init__(self, server: viser.ViserServer, robot: RobotShapes) -> None:
        self._robot = robot
        self._frames: dict[str, viser.FrameHandle] = {}
        self._shown: dict[str, float] = {}
        for joint in robot.joints:
            self._frames[joint.name] = server.scene.add_frame(
                self.node(joint.child),
                show_axes=False,
                position=joint.origin.position,
                wxyz=wxyz(joint.origin),
            )
        for number, shape in enumerate(robot.shapes):
            _draw(server.scene, f'{self.node(shape.link)}/shape{number}', shape)

    def node(self, link: str) -> str:
        """Name of the scene's node for ``link``."""
        return ROOT + self._robot.path(link)

    def move(self, positions: Mapping[str, float]) -> None:
        """Put the joints there; radians, and metres along the rail."""
        for joint in self._robot.joints:
            position = positions.get(joint.name)
            if position is None or self._shown.get(joint.name) == position:
                continue
            self._shown[joint.name] = position
            pose, frame = joint.transform(position), self._frames[joint.name]
            if joint.kind == 'prismatic':
                frame.position = np.array(pose.position)
            else:
                frame.wxyz = np.array(wxyz(pose))


def wxyz(pose: Pose) -> tuple[float, float, float, float]:
    """The turn of ``pose`` as viser writes it."""
    x, y, z, w = pose.quaternion
    return (w, x, y, z)


def _draw(scene: viser.SceneApi, name: str, shape: LinkShape) -> None:
    position, turn = shape.pose.position, wxyz(shape.pose)
    if shape.kind == 'box':
        x, y, z = shape.sizes
        scene.add_box(name, shape.colour, (x, y, z), position=position, wxyz=turn)
    elif shape.kind == 'cylinder':
        radius, length = shape.sizes
        scene.add_cylinder(name, radius, length, shape.colour, position=position, wxyz=turn)
    else:
        scene.add_icosphere(name, shape.sizes[0], shape.colour, position=position, wxyz=turn)
