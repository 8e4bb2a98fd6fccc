"""What the journal writes down about one placement, and how it is spelt in JSON."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from enum import Enum
from typing import Any

from pack_msgs_py.cell_values import Decision
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.geometry.resting import with_measured
from pack_msgs_py.profiles import Profile
from pack_msgs_py.values import BinSpec, Box, PlacedBox


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

    ``target`` and ``measured`` are poses of the box's centre in the bin frame.
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


def placed_to_json(placed: PlacedBox) -> str:
    """Everything that is needed to rebuild ``placed``; the measured pose is kept apart."""
    return json.dumps(asdict(replace(placed, measured_mm=None)))


def placed_from_json(text: str) -> PlacedBox:
    """Inverse of :func:`placed_to_json`."""
    data: dict[str, Any] = json.loads(text)
    box = data['box']
    return PlacedBox(
        box=Box(
            id=box['id'],
            size_mm=tuple(box['size_mm']),
            weight_kg=box['weight_kg'],
            com_offset_mm=tuple(box['com_offset_mm']),
            allowed_up=box['allowed_up'],
            max_top_load_n=box['max_top_load_n'],
            destination=box['destination'],
            size_stddev_mm=tuple(box['size_stddev_mm']),
            extra=tuple((key, value) for key, value in box['extra']),
        ),
        corner_mm=tuple(data['corner_mm']),
        size_mm=tuple(data['size_mm']),
        orientation=data['orientation'],
    )


def pose_to_json(pose: Pose) -> str:
    """A pose as two lists, position in metres and quaternion (x, y, z, w)."""
    return json.dumps([pose.position, pose.quaternion])


def pose_from_json(text: str) -> Pose:
    """Inverse of :func:`pose_to_json`."""
    position, quaternion = json.loads(text)
    return Pose(tuple(position), tuple(quaternion))


def configuration(spec: BinSpec, profile: Profile) -> dict[str, Any]:
    """What a journal is bound to: the kind of bin, and the rules its content was judged by."""
    values = {'bin_type': spec.name, 'bin_size_mm': list(spec.size_mm)}
    return values | {f'profile.{key}': value for key, value in asdict(profile).items()}
