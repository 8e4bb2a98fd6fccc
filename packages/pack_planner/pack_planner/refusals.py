"""What the arm refused, and what is not offered again because of it."""

from __future__ import annotations

from dataclasses import dataclass, field

from pack_msgs_py.values import Bin, Box, Int3
from pack_planner.engine import Zone

#: After so many refusals of one box in one revision of a bin, the box is not offered there again.
REFUSALS_UNTIL_BARRED = 3


@dataclass
class Refusals:
    """Refused placements by bin, content of the bin, and box.

    A refusal holds as long as the content of the bin stays the same. Around a refused position
    the box is not offered again within 10 cm at the same height and turn, and after three refusals
    not at all.
    """

    _zones: dict[str, dict[str, tuple[Zone, ...]]] = field(default_factory=dict)
    _revisions: dict[str, int] = field(default_factory=dict)

    def add(self, target: Bin, box_id: str, orientation: str, corner_mm: Int3) -> None:
        """Remember that the arm refused this placement into ``target`` as it is now."""
        self.forget_old((target,))
        per_box = self._zones.setdefault(target.id, {})
        per_box[box_id] = (*per_box.get(box_id, ()), Zone(orientation, corner_mm))
        self._revisions[target.id] = target.revision

    def forget_old(self, bins: tuple[Bin, ...]) -> None:
        """Drop what was refused in an earlier content of any of ``bins``."""
        for one in bins:
            if self._revisions.get(one.id) != one.revision:
                self._zones.pop(one.id, None)
                self._revisions.pop(one.id, None)

    def snapshot(self) -> Forbidden:
        """What is refused now, as a value that a worker thread may keep."""
        return Forbidden(
            {
                (bin_id, box_id): (self._revisions[bin_id], found)
                for bin_id, per_box in self._zones.items()
                for box_id, found in per_box.items()
            }
        )


@dataclass(frozen=True)
class Forbidden:
    """Refusals as the engine takes them; call with a box and a bin.

    ``zones`` holds, by bin id and box id, the revision of the bin at which the arm refused, and
    what it refused. They also hold for later revisions, since a bin that is packed virtually
    counts its revisions on while in truth it is still the one that was refused.
    """

    zones: dict[tuple[str, str], tuple[int, tuple[Zone, ...]]] = field(default_factory=dict)

    def refused(self, box: Box, target: Bin) -> tuple[Zone, ...]:
        """Placements of ``box`` that the arm refused in ``target`` as it is."""
        revision, found = self.zones.get((target.id, box.id), (0, ()))
        return found if target.revision >= revision else ()

    def __call__(self, box: Box, target: Bin) -> tuple[Zone, ...] | None:
        """Refused zones, or ``None`` when the box may not go into that bin at all."""
        zones = self.refused(box, target)
        return None if len(zones) >= REFUSALS_UNTIL_BARRED else zones
