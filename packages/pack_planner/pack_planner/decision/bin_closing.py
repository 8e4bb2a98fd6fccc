"""Which bin is closed when nothing on offer fits into the open ones."""

from __future__ import annotations

from collections.abc import Sequence

from pack_msgs_py.rules import may_enter
from pack_msgs_py.values import Bin, Box
from pack_planner.engine import Engine

#: Boxes of each open bin that stand for those to come.
_SAMPLE = 8


def bin_to_close(
    rule: str, engine: Engine, boxes: Sequence[Box], bins: Sequence[Bin]
) -> Bin | None:
    """The bin to close for ``boxes``, or ``None`` when all that they may enter are empty.

    When no bin serves any of their destinations, the one that goes makes room for one that does: an
    empty one first, so that nothing is closed for it. Boxes without a destination have no claim.

    ``fullest`` : highest fill rate (Ojha et al., section III-A.2).
    ``oldest`` : the one that was opened first.
    ``least_useful`` : where the least volume of the boxes to come would still fit, one by one. The
    last boxes that were placed, up to eight of each open bin, stand for these: they come from the
    same stream, and every planner that sees the same bins sees the same sample.

    Equal ones go by fill rate, then the older first. Else an empty bin is never closed, nor one
    that serves another destination than any of ``boxes``.
    """
    serving = [one for one in bins if any(may_enter(box, one.destination) for box in boxes)]
    empty = next((one for one in bins if not one.boxes), None)
    if not serving and not any(box.destination for box in boxes):
        return None
    if not serving and empty is not None:
        return empty
    used = [one for one in serving or bins if one.boxes]
    if not used:
        return None
    if rule == 'oldest':
        return min(used, key=lambda one: one.serial)
    if rule == 'least_useful':
        sample = [placed.box for one in bins for placed in one.boxes[-_SAMPLE:]]
        return min(
            used,
            key=lambda one: (_still_fits(engine, sample, one), -one.fill_rate, one.serial),
        )
    return max(used, key=lambda one: (one.fill_rate, -one.serial))


def next_destination(closed: Bin, boxes: Sequence[Box], left: Sequence[Bin]) -> str:
    """Whom the bin that takes the place of ``closed`` serves; ``left`` are the other open ones.

    The first of ``boxes``, in the order of the belt, that may enter none of ``left``; without such
    a box the same as before. A bin for any destination stays one.
    """
    if not closed.destination:
        return ''
    for box in boxes:
        if box.destination and not any(may_enter(box, one.destination) for one in left):
            return box.destination
    return closed.destination


def _still_fits(engine: Engine, sample: Sequence[Box], target: Bin) -> float:
    """Volume of those of ``sample`` that ``target`` would take, each on its own, mm3."""
    model = engine.model(target)
    return sum(box.volume_mm3 for box in sample if engine.best_placement(box, [model]) is not None)
