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
    serving = [
        target for target in bins if any(may_enter(box, target.destination) for box in boxes)
    ]
    empty = next((target for target in bins if not target.boxes), None)
    if not serving and not any(box.destination for box in boxes):
        return None
    if not serving and empty is not None:
        return empty
    used = [target for target in serving or bins if target.boxes]
    if not used:
        return None
    if rule == 'oldest':
        return min(used, key=lambda target: target.serial)
    if rule == 'least_useful':
        sample = [placed.box for target in bins for placed in target.boxes[-_SAMPLE:]]
        return min(
            used,
            key=lambda target: (
                _still_fits(engine, sample, target),
                -target.fill_rate,
                target.serial,
            ),
        )
    return max(used, key=lambda target: (target.fill_rate, -target.serial))


def next_destination(closed: Bin, boxes: Sequence[Box], left: Sequence[Bin]) -> str:
    """Whom the bin that takes the place of ``closed`` serves; ``left`` are the other open ones.

    The first of ``boxes``, in the order of the belt, that may enter none of ``left``; without such
    a box the same as before. A bin for any destination stays one.
    """
    if not closed.destination:
        return ''
    for box in boxes:
        if box.destination and not any(may_enter(box, other.destination) for other in left):
            return box.destination
    return closed.destination


def _still_fits(engine: Engine, sample: Sequence[Box], target: Bin) -> float:
    """Volume of those of ``sample`` that ``target`` would take, each on its own, mm3."""
    model = engine.model(target)
    return sum(box.volume_mm3 for box in sample if engine.best_placement(box, [model]) is not None)
