"""What the journal writes down about one placement."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

from pack_msgs_py.cell_values import Decision
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.geometry.resting import with_measured
from pack_msgs_py.profiles import Profile
from pack_msgs_py.values import BinSpec, PlacedBox


class Step(str, Enum):
    """How far a placement has come. The journal holds the step before the arm acts on it."""

    PLANNED = 'planned'
    PICKED = 'picked'
    RELEASING = 'releasing'
    PLACED = 'placed'
    VERIFIED = 'verified'
    FORGOTTEN = 'forgotten'
    RETURNED = 'returned'
    LOST = 'lost'
    UNKNOWN = 'unknown'
    REMOVED = 'removed'

    @property
    def in_bin(self) -> bool:
        """Whether the box counts as being in its bin."""
        return self in (Step.RELEASING, Step.PLACED, Step.VERIFIED)

    @property
    def pending(self) -> bool:
        """Whether the placement is still under way."""
        return self in (Step.PLANNED, Step.PICKED, Step.RELEASING, Step.PLACED)


@dataclass(frozen=True)
class Attempt:
    """One placement that was begun: which box, into which bin, how far it came.

    Attributes
    ----------
    id : number of the attempt in the journal; 0 before it is written there.
    placed, bin_serial : the box as it was planned, and the serial of the bin it is for.
    target, measured : poses of the box's centre, bin frame: commanded, and as it came to rest.
    step : how far the placement has come.
    goal_id : of the action's goal.
    """

    id: int
    placed: PlacedBox
    bin_serial: int
    target: Pose
    step: Step = Step.PLANNED
    measured: Pose | None = None
    goal_id: bytes = bytes(16)

    @property
    def pose(self) -> Pose:
        """Where the box is in the bin, as far as is known: measured, else commanded."""
        return self.measured or self.target

    @property
    def in_bin(self) -> PlacedBox:
        """The box as the bin holds it, with its measured centre in millimetres."""
        if self.measured is None:
            return self.placed
        return with_measured(self.placed, self.measured)


def placed_of(decision: Decision) -> PlacedBox:
    """What ``decision`` would put into its bin."""
    return PlacedBox(decision.box, decision.corner_mm, decision.size_mm, decision.orientation)


def configuration(spec: BinSpec, profile: Profile) -> dict[str, Any]:
    """What a journal is bound to: the kind of bin, and the rules its content was judged by."""
    values = {'bin_type': spec.name, 'bin_size_mm': list(spec.size_mm)}
    return values | {f'profile.{key}': value for key, value in asdict(profile).items()}
