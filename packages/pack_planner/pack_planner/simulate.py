"""A cell without arm or belt: feed boxes, decide, place at once, close bins. For benchmarks."""

from __future__ import annotations

import random
from collections.abc import Iterable
from dataclasses import dataclass, field

from pack_msgs_py.values import Bin, BinSpec, Box, Int3, PlacedBox
from pack_planner.decide import Close, Place, Planner, Reject, Situation
from pack_planner.refusals import Forbidden


@dataclass
class Run:
    """What came of a stream.

    ``seconds`` holds the planning time of each placement, ``rejected`` pairs of box id and reason.
    """

    closed: list[Bin] = field(default_factory=list)
    still_open: list[Bin] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    rejected: list[tuple[str, str]] = field(default_factory=list)


def pack_stream(
    planner: Planner, boxes: Iterable[Box], spec: BinSpec, *, look_ahead: int, open_bins: int
) -> Run:
    """Pack ``boxes`` into bins of kind ``spec``; as many bins stay open all the time."""
    stream = iter(boxes)
    belt: list[Box] = []
    serial = open_bins
    bins = [Bin(f'{spec.name}-{i}', i, spec) for i in range(1, open_bins + 1)]
    run = Run()
    while True:
        while len(belt) < look_ahead:
            following = next(stream, None)
            if following is None:
                break
            belt.append(following)
        if not belt:
            run.still_open = bins
            return run
        outcome = planner.decide(Situation(tuple(belt), tuple(bins), Forbidden()))
        if isinstance(outcome, Place):
            decision = outcome.decision
            run.seconds.append(decision.planning_s)
            placed = PlacedBox(
                decision.box, decision.corner_mm, decision.size_mm, decision.orientation
            )
            index = next(i for i, one in enumerate(bins) if one.id == decision.bin_id)
            old = bins[index]
            bins[index] = Bin(
                old.id, old.serial, spec, (*old.boxes, placed), old.station, old.revision + 1
            )
            belt.remove(decision.box)
        elif isinstance(outcome, Close):
            run.closed.append(outcome.target)
            serial += 1
            bins = [one for one in bins if one.id != outcome.target.id]
            bins.append(Bin(f'{spec.name}-{serial}', serial, spec))
        elif isinstance(outcome, Reject):
            run.rejected.append((outcome.decision.box.id, outcome.decision.reason))
            belt.remove(outcome.decision.box)
        else:
            msg = f'nothing to do with {len(belt)} boxes on the belt: {outcome.reason}'
            raise RuntimeError(msg)


def cut_bin(
    spec: BinSpec, rng: random.Random, *, pieces: int = 23, least_mm: int = 50
) -> list[Int3]:
    """Cut one bin into boxes of whole centimetres that fill it exactly (the paper's SYN data).

    While a piece has an edge above 45 cm it is cut along it; then pieces are taken with
    probability proportional to volume and cut along a random axis, until there are ``pieces``.
    """
    limit_mm = 450
    found: list[Int3] = [spec.size_mm]
    while True:
        large = [i for i, piece in enumerate(found) if max(piece) > limit_mm]
        if large:
            index = large[0]
            axis = max(range(3), key=lambda a: found[index][a])
        elif len(found) >= pieces or all(max(piece) < 2 * least_mm for piece in found):
            return found
        else:
            volumes = [piece[0] * piece[1] * piece[2] for piece in found]
            index = rng.choices(range(len(found)), volumes)[0]
            axis = rng.randrange(3)
        edge = found[index][axis]
        if edge < 2 * least_mm:
            continue
        cut = rng.randrange(least_mm, edge - least_mm + 1, 10)
        one, other = list(found[index]), list(found[index])
        one[axis], other[axis] = cut, edge - cut
        found[index] = (one[0], one[1], one[2])
        found.append((other[0], other[1], other[2]))
