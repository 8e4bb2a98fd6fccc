"""Which combination to take, in words."""

from __future__ import annotations

from collections.abc import Sequence

from pack_cell.what_if.outcomes import Outcome, told
from pack_msgs_py.values import BinSpec, Walls

#: Points of fill that are worth neither another open bin nor a longer look-ahead.
ALIKE = 0.5
#: Points of fill; an interval that reaches farther to either side tells little.
WIDE = 5.0

_CALLED = {Walls.CLOSED: 'bins', Walls.OPEN_FRONT: 'roller cages', Walls.NONE: 'pallets'}


def called(spec: BinSpec) -> str:
    """A kind of bin for people, such as ``roller cages (RC)``."""
    return f'{_CALLED[spec.walls]} ({spec.name})'


def chosen(outcomes: Sequence[Outcome], most_by_hand: float) -> Outcome | None:
    """The combination to take for one kind of bin; ``None`` where no bin was ever closed.

    Of those that leave no more for people than ``most_by_hand`` percent (or, where all leave more,
    than the best of them) and miss fewest deadlines, the fullest; unless one with fewer open bins
    or a shorter look-ahead is as full to :data:`ALIKE` points.
    """
    known = [outcome for outcome in outcomes if outcome.fill is not None]
    if not known:
        return None
    limit = max(most_by_hand, min(outcome.by_hand for outcome in known))
    known = [outcome for outcome in known if outcome.by_hand <= limit]
    misses = min(outcome.deadline_misses or 0 for outcome in known)
    known = [outcome for outcome in known if (outcome.deadline_misses or 0) == misses]
    best = fullest(known)
    alike = [o for o in known if (o.fill or 0.0) >= (best.fill or 0.0) - ALIKE]
    return min(
        alike, key=lambda o: (o.combination.open_bins, o.combination.look_ahead, -(o.fill or 0.0))
    )


def fullest(outcomes: Sequence[Outcome]) -> Outcome:
    """The one with the fullest closed bins."""
    return max(outcomes, key=lambda outcome: outcome.fill or 0.0)


def by_bins(outcomes: Sequence[Outcome]) -> dict[str, list[Outcome]]:
    """Outcomes by the name of their kind of bin."""
    groups: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        groups.setdefault(outcome.combination.spec.name, []).append(outcome)
    return groups


def recommendations(outcomes: Sequence[Outcome], most_by_hand: float) -> list[str]:
    """A sentence or two for each kind of bin, the fullest kind first."""
    picked: list[tuple[float, str]] = []
    for group in by_bins(outcomes).values():
        best = chosen(group, most_by_hand)
        if best is None:
            name = called(group[0].combination.spec)
            picked.append((-1.0, f'{name}: too few boxes to fill one; give more of them.'))
        else:
            picked.append((best.fill or 0.0, f'{_figures(best)} {_why(best, group)}'.strip()))
    sentences = [text for _, text in sorted(picked, key=lambda pair: -pair[0])]
    return [sentence[0].upper() + sentence[1:] for sentence in sentences]


def _figures(best: Outcome) -> str:
    combination = best.combination
    spread = '' if best.fill_ci is None else f' (± {best.fill_ci:.1f})'
    rate = '' if best.boxes_per_hour is None else f', {best.boxes_per_hour:,.0f} boxes an hour'
    what = told(combination).partition(', ')[2]
    return (
        f'{called(combination.spec)}: {what}: {best.fill:.1f} % full{spread}{rate}, '
        f'{best.by_hand:.1f} % to be packed by hand.'
    )


def _why(best: Outcome, group: Sequence[Outcome]) -> str:
    """What speaks against the others, where something does."""
    known = [outcome for outcome in group if outcome.fill is not None]
    top = fullest(known)
    texts = []
    gain = (top.fill or 0.0) - (best.fill or 0.0)
    if top is not best:
        what = told(top.combination).partition(', ')[2]
        if top.by_hand > best.by_hand and gain > ALIKE:
            texts.append(
                f'{what} would be {gain:.1f} points fuller and leave {top.by_hand:.1f} % by hand.'
            )
        else:
            texts.append(f'{what} would be {gain:.1f} points fuller.')
    if best.deadline_misses:
        texts.append(f'{best.deadline_misses} deadlines were missed.')
    if best.fill_ci is not None and best.fill_ci > WIDE:
        texts.append('That interval is wide: more boxes or --orders make it narrower.')
    return ' '.join(text[0].upper() + text[1:] for text in texts)
