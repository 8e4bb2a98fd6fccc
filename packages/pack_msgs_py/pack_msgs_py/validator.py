"""The slow validator: replays what was placed, box by box, and lists every broken rule.

It is the oracle of the tests, the benchmark and the run summary, and knows nothing of the
planner's engine.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from pack_msgs_py.geometry.taken_up import taken_up
from pack_msgs_py.profiles import Profile
from pack_msgs_py.rules import Rule, Violation, violations
from pack_msgs_py.values import Bin, BinSpec, PlacedBox


def broken_rules(
    placed: PlacedBox,
    others: Sequence[PlacedBox],
    bin_spec: BinSpec,
    profile: Profile,
    destination: str = '',
) -> list[Violation]:
    """Rules that ``placed`` breaks among ``others`` both by their places and as measured.

    What is right by either is right: a box may be decided before the one below it is measured.
    """
    broken = list(violations(placed, others, bin_spec, profile, destination))
    measured = taken_up(others, bin_spec, profile.resolution_mm)
    if broken and not any(violations(placed, measured, bin_spec, profile, destination)):
        return []
    return broken


def validate_sequence(
    placements: Sequence[PlacedBox], bin_spec: BinSpec, profile: Profile, destination: str = ''
) -> list[Violation]:
    """Replay ``placements`` into an empty bin in order; return every violation.

    ``destination`` is what the bin serves, empty for any box.
    """
    broken: list[Violation] = []
    for index, placed in enumerate(placements):
        others = placements[:index]
        broken.extend(broken_rules(placed, others, bin_spec, profile, destination))
    return broken


def validate_bins(bins: Iterable[Bin], profile: Profile) -> list[Violation]:
    """Validate each bin, and that no box is in two of them."""
    broken: list[Violation] = []
    where: dict[str, str] = {}
    for bin_ in bins:
        broken.extend(validate_sequence(bin_.boxes, bin_.spec, profile, bin_.destination))
        for placed in bin_.boxes:
            first = where.setdefault(placed.box.id, bin_.id)
            if first != bin_.id:
                message = f'is in bin {first!r} and in bin {bin_.id!r}'
                broken.append(Violation(placed.box.id, Rule.DUPLICATE_BOX, message))
    return broken


def with_box(target: Bin, placed: PlacedBox) -> Bin:
    """``target`` with ``placed`` added and its revision grown by one; rules are not checked."""
    return replace(target, boxes=(*target.boxes, placed), revision=target.revision + 1)
