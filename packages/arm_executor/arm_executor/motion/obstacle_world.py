"""What planning asks of a world, and how near arm and carried box may come to what stands there.

There are two: :class:`arm_executor.motion.collision.PlanningWorld` says what is so, and
:class:`arm_executor.motion.quick_world.QuickWorld` predicts it. Metres, frame `cell`.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from arm_executor.model.layout import Block
from arm_executor.motion.path import JointPath
from arm_executor.motion.swing import Obstacles
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Vec3

Array = NDArray[np.float64]

#: Least distances, metres: of the arm's round links, of the pad, of the carried box. The last two
#: are no more than half of the least clearance, which is what a wall has (1 mm), and pad and box
#: are checked that much larger: PyBullet reports two boxes only once they overlap, round shapes
#: already before.
ARM_MARGIN, PAD_MARGIN, BOX_MARGIN = 0.005, 0.001, 0.001
#: The same while the box goes across, and how far from its ends that begins, seen from above:
#: only straight up and down does it pass its neighbours closely.
WIDE_MARGIN, WIDE_FROM = 0.012, 0.02
#: The carried box is checked without this much at its bottom and top, so that what it stands on
#: and the pad are no collisions.
BOX_SKIN = 0.004


class ObstacleWorld(Protocol):
    """Obstacles by name, the arm, and one carried box; ``held_size`` is that of the box."""

    held_size: Vec3

    def set_block(self, block: Block) -> None:
        """Add a fixed obstacle under its own name."""

    def set_box(self, name: str, size: Vec3, pose: Pose) -> None:
        """Add an obstacle called ``name``, or move it."""

    def remove(self, name: str) -> None:
        """Take an obstacle away; one that is not there is fine."""

    def obstacles(self, without: Collection[str] = ()) -> Obstacles:
        """Extents of all obstacles but those called one of ``without``."""

    def hold(self, size: Vec3, name: str) -> None:
        """Hang a box of ``size`` under the pad for the coming checks."""

    def drop(self) -> None:
        """Take the carried box away."""

    def first_hit(self, path: JointPath, box_turn: float | None = None) -> str | None:
        """What touches what along ``path``, or ``None`` when nothing does.

        ``box_turn`` is the carried box's yaw relative to the pad's; ``None`` when the pad is empty.
        """

    def first_hit_tilted(self, q: Array, tool: Array) -> str | None:
        """Like :meth:`first_hit` for a box held in front of a tool that tilts on its way.

        ``tool`` (n, 4, 4) is the pose of the pad's face at ``q`` (n, 7). The box's own z points
        out of the pad, turned about its x by half a turn.
        """
