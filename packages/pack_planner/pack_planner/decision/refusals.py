"""What the arm refused, and what is not offered again because of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from pack_msgs_py.cell_values import Decision
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.orientation import ORIENTATIONS, oriented_size
from pack_msgs_py.values import Bin, Box
from pack_planner.engine import Zone

#: After so many refusals of one box in one content of a bin, the box is not offered there until
#: the content changes: a refusal costs the arm about a tenth of a second. After so many places
#: where it would take too long, whatever the content, it is not offered to that bin any more.
TRIES_PER_BOX = 6
#: In an empty bin more is tried, since a box that an empty bin does not take is rejected.
TRIES_IN_EMPTY_BIN = 30
#: The same for all boxes together, in a bin that holds any.
TRIES_PER_CONTENT = 30
#: A refusal that is only predicted costs a tenth of that: it counts so much less.
PREDICTIONS_PER_TRY = 5
#: Before a bin is closed, or left for good, everything is tried, up to so many times as often.
TO_THE_LAST = 20

#: Refusals that hold as long as the bin stands: boxes only come, none ever leaves.
LASTING = frozenset(
    {
        ErrorCode.NO_IK_SOLUTION,
        ErrorCode.PATH_IN_COLLISION,
        ErrorCode.LIMITS_EXCEEDED,
    }
)


_SLOW = frozenset({ErrorCode.DEADLINE_UNREACHABLE})


@dataclass(frozen=True)
class Refused:
    """One refused placement.

    Attributes
    ----------
    box, zone : what was refused where.
    revision : of the bin at that moment.
    code : why. What no path led to is refused to every box at least as wide and long, what took
        too long to every box at least as heavy.
    lasting : whether later contents of the bin do not change it.
    predicted : whether the arm has not even tried to plan it.
    """

    box: Box
    zone: Zone
    revision: int
    code: ErrorCode = ErrorCode.UNKNOWN
    lasting: bool = False
    predicted: bool = False

    @property
    def tries(self) -> float:
        """What it counts."""
        return 1 / PREDICTIONS_PER_TRY if self.predicted else 1.0


class Refusals:
    """Refused placements by bin.

    Around a refused position the box is not offered again at the same height and turn, within
    :data:`pack_planner.engine.engine.REFUSED_RADIUS_MM`. How long that holds, and what it means for
    other boxes, follows from the code.
    """

    def __init__(self) -> None:
        self._by_bin: dict[str, tuple[Refused, ...]] = {}
        self._late: Refused | None = None

    def learn(
        self,
        target: Bin,
        decision: Decision,
        code: ErrorCode,
        *,
        lasting: bool = False,
        predicted: bool = False,
        lies_oddly: bool = False,
    ) -> None:
        """The arm refused ``decision`` with ``code``, or failed at it, in ``target`` as it is.

        Of a box that ``lies_oddly`` at the pick point that says nothing about others, nor about
        later: it may be for how it is to be taken rather than for where it is to go.
        When the arm had said before that it can do it in time, asking took too long: once more
        with the plan that it has by now, before that counts.
        """
        lasting = (lasting or code in LASTING) and not lies_oddly
        refused = _refused(target, decision, code, lasting=lasting, predicted=predicted)
        if (
            code in _SLOW
            and not refused.lasting
            and decision.candidates_checked
            and self._late != refused
        ):
            self._late = refused
            return
        self._by_bin[target.id] = (*self._by_bin.get(target.id, ()), refused)

    def forget_old(self, bins: tuple[Bin, ...]) -> None:
        """Drop what no longer holds now that the open bins are ``bins``."""
        self._by_bin = {
            target.id: tuple(
                refused
                for refused in self._by_bin[target.id]
                if refused.lasting or refused.revision >= target.revision
            )
            for target in bins
            if target.id in self._by_bin
        }

    def forget_expected(self, bins: tuple[Bin, ...]) -> None:
        """Drop what was refused for a content that the open ``bins`` will not have after all."""
        for target in bins:
            known = self._by_bin.get(target.id, ())
            self._by_bin[target.id] = tuple(
                refused for refused in known if refused.revision <= target.revision
            )

    def snapshot(self, bins: tuple[Bin, ...] = ()) -> Forbidden:
        """What is refused in ``bins``, as a value that a worker thread may keep."""
        refused = {bin_id: known for bin_id, known in self._by_bin.items() if known}
        return Forbidden(refused, {target.id: target.revision for target in bins})


@dataclass(frozen=True)
class Forbidden:
    """Refusals as the engine takes them; call with a box and a bin.

    ``by_bin`` holds what the arm refused by bin id, ``contents`` the revision of each bin that is
    decided about. A bin that is packed virtually counts its revision on while in truth it is still
    the one that was refused, so a refusal also holds for later revisions. ``thorough`` leaves out
    nothing but what was refused.
    """

    by_bin: Mapping[str, tuple[Refused, ...]] = field(default_factory=dict)
    contents: Mapping[str, int] = field(default_factory=dict)
    thorough: bool = False

    @property
    def leaves_out(self) -> bool:
        """Whether more may be left out than what was refused."""
        return bool(self.by_bin) and not self.thorough

    def to_the_last(self) -> Forbidden:
        """The same, but all is offered that was not refused itself."""
        return replace(self, thorough=True)

    def refused(self, box: Box, target: Bin) -> tuple[Zone, ...]:
        """Placements of ``box`` that the arm refused in ``target`` as it is."""
        return tuple(own.zone for own in self._own(box, target))

    def too_much_for_the_arm(self, box: Box, target: Bin) -> bool:
        """Whether the arm said of ``box`` what holds at any station: it cannot carry it."""
        return any(own.code is ErrorCode.LIMITS_EXCEEDED for own in self._own(box, target))

    def plus(self, target: Bin, decision: Decision) -> Forbidden:
        """The same with ``decision`` refused too."""
        refusal = _refused(target, decision)
        by_bin = {**self.by_bin, target.id: (*self.by_bin.get(target.id, ()), refusal)}
        return replace(self, by_bin=by_bin)

    def without(self, code: ErrorCode) -> Forbidden:
        """The same without what was refused with ``code``."""
        by_bin = {
            bin_id: tuple(refused for refused in known if refused.code is not code)
            for bin_id, known in self.by_bin.items()
        }
        return replace(self, by_bin={name: known for name, known in by_bin.items() if known})

    def __call__(self, box: Box, target: Bin) -> tuple[Zone, ...] | None:
        """Refused zones, or ``None`` when the box may not go into that bin at all."""
        known = self.by_bin.get(target.id)
        if known is None:
            return ()
        content = self.contents.get(target.id, max(refused.revision for refused in known))
        fresh = [refused for refused in known if refused.revision == content]
        tries = sum(refused.tries for refused in fresh if refused.box.id == box.id)
        slow = sum(
            refused.tries
            for refused in known
            if refused.box.id == box.id and refused.code in _SLOW and refused.lasting
        )
        more = TO_THE_LAST if self.thorough else 1
        hopeful = not target.boxes and not self.too_much_for_the_arm(box, target)
        limit = TRIES_IN_EMPTY_BIN if hopeful else TRIES_PER_BOX * more
        # with a little to spare for the sum of fractions
        if max(tries, slow) >= limit - 1e-6:
            return None
        content_tries = sum(refused.tries for refused in fresh)
        if target.boxes and content_tries >= TRIES_PER_CONTENT * more - 1e-6:
            return None
        own = self.refused(box, target)
        if self.thorough:
            return own
        return (*own, *(zone for refused in known for zone in _also_refused(refused, box, target)))

    def _own(self, box: Box, target: Bin) -> list[Refused]:
        known = self.by_bin.get(target.id, ())
        return [
            refused
            for refused in known
            if refused.box.id == box.id and refused.revision <= target.revision
        ]


def _refused(
    target: Bin,
    decision: Decision,
    code: ErrorCode = ErrorCode.UNKNOWN,
    *,
    lasting: bool = False,
    predicted: bool = False,
) -> Refused:
    zone = Zone(decision.orientation, decision.corner_mm)
    return Refused(decision.box, zone, target.revision, code, lasting, predicted)


def _also_refused(refused: Refused, box: Box, target: Bin) -> list[Zone]:
    """Where ``box`` would go down a hole too narrow, or a way too long, for another one."""
    other = refused.box
    if not refused.lasting or other.id == box.id or refused.revision > target.revision:
        return []
    hole = oriented_size(other.size_mm, refused.zone.orientation)
    x, y, z = refused.zone.corner_mm
    zones = []
    for orientation in ORIENTATIONS:
        size = oriented_size(box.size_mm, orientation)
        wider = size[0] >= hole[0] and size[1] >= hole[1]
        if (refused.code is ErrorCode.PATH_IN_COLLISION and wider) or (
            refused.code in _SLOW and box.weight_kg >= other.weight_kg
        ):
            corner = (round(x + (hole[0] - size[0]) / 2), round(y + (hole[1] - size[1]) / 2), z)
            zones.append(Zone(orientation, corner))
    return zones
