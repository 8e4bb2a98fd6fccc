"""A whole placement as trajectories."""

from __future__ import annotations

from dataclasses import dataclass, field

from arm_executor.motion.path import JointPath
from arm_executor.motion.stances import GRIP_S, RELEASE_S, Stance
from arm_executor.motion.timing import Trajectory


@dataclass(frozen=True)
class PlannedMotion:
    """Three trajectories from rest to rest, and when the second one starts to lower the box.

    ``stance`` is how the arm stands, where the tool points down all the way.
    """

    approach: Trajectory
    carry: Trajectory
    retreat: Trajectory
    lowering_s: float
    carry_path: JointPath = field(repr=False)
    stance: Stance | None = None

    @property
    def duration(self) -> float:
        """Robot time of all of it, grip and release included."""
        moving = self.approach.duration + self.carry.duration + self.retreat.duration
        return moving + GRIP_S + RELEASE_S

    @property
    def duration_after_pick(self) -> float:
        """Robot time from the grasp on."""
        return self.carry.duration + RELEASE_S + self.retreat.duration
