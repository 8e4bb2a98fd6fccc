"""The robot in a viser scene: a mesh for each link, a frame for each joint."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import trimesh
import viser
from numpy.typing import NDArray

from pack_cell.view.robot_shapes import LinkShape, RobotShapes
from pack_msgs_py.geometry.pose import Pose, rotation_matrix

Array = NDArray[np.float64]
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
        links = {shape.link: shape for shape in robot.shapes}
        for link in links:
            parts = [shape for shape in robot.shapes if shape.link == link]
            meshes = [_mesh(shape) for shape in parts]
            vertices, faces = trimesh.util.append_faces(
                [mesh.vertices for mesh in meshes], [mesh.faces for mesh in meshes]
            )
            server.scene.add_mesh_simple(
                f'{self.node(link)}/shape',
                vertices=vertices,
                faces=faces,
                color=parts[0].colour,
            )

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


def _mesh(shape: LinkShape) -> trimesh.Trimesh:
    mesh: trimesh.Trimesh
    if shape.kind == 'box':
        mesh = trimesh.creation.box(extents=shape.sizes)
    elif shape.kind == 'cylinder':
        radius, length = shape.sizes
        mesh = trimesh.creation.cylinder(radius=radius, height=length, sections=24)
    else:
        mesh = trimesh.creation.icosphere(subdivisions=2, radius=shape.sizes[0])
    place = np.eye(4)
    place[:3, :3] = rotation_matrix(shape.pose.quaternion)
    place[:3, 3] = shape.pose.position
    mesh.apply_transform(place)
    return mesh
