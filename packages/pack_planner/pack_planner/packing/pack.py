"""The library in one call: pack a stream of boxes, placement by placement."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from pack_msgs_py.metrics import fill_metrics, time_summary
from pack_msgs_py.profiles import Profile, find_profile
from pack_msgs_py.rules import Violation
from pack_msgs_py.validator import validate_bins
from pack_msgs_py.values import Bin, BinSpec, Box, check_box, parse_bin
from pack_msgs_py.wording import how_many
from pack_planner.algorithms import Algorithm, find_algorithm
from pack_planner.algorithms.tuned_tables import check_table, read_table
from pack_planner.algorithms.tuned_weights import TunedTable
from pack_planner.decision.options import DecisionOptions
from pack_planner.decision.policy import PolicySettings
from pack_planner.decision.weights import WeightTable
from pack_planner.engine import Weights
from pack_planner.packing.arrays import PlacementArrays, placement_arrays
from pack_planner.packing.loop import ClosedBin, PackedBox, PackingLoop, PackingTask, UnplacedBox


def pack(
    stream: Iterable[Box],
    bin_spec: BinSpec | str,
    algorithm: str | Algorithm = 'mpack_lite',
    look_ahead: int = 5,
    open_bins: int = 3,
    profile: Profile | str = 'paper',
    *,
    weights: Weights | None = None,
    options: DecisionOptions | None = None,
    backend: str = 'search',
    budget_s: float = 5.0,
    node_limit: int | None = None,
    tuned: TunedTable | str | Path | None = None,
) -> Packing:
    """Pack boxes as they come, by the closed-bin protocol of Ojha et al., section III-A.

    Nothing is decided before the result is iterated over. The defaults are the paper's.

    Parameters
    ----------
    stream : boxes in the order of their arrival; taken as the look-ahead needs them, so that a
        generator may go on for ever.
    bin_spec : kind of the bins, or its name as :func:`parse_bin` takes it.
    algorithm : what :func:`find_algorithm` takes: a name, ``FILE.py:FUNCTION``, or a function.
    look_ahead : boxes that the algorithm may choose from, 1 or more.
    open_bins : bins that stand open at a time, 1 or more.
    profile : packing rules, or their name.
    weights : of eq. (1), w1, w2 and w3; 1, 1 and 100 by default.
    options : sorting, selection, closing and so on.
    backend : who minimises eq. (1) for algorithms that leave that open; see :class:`Problem`.
    budget_s : seconds that a decision may take.
    node_limit : search nodes that a decision may take, the same on every machine; ``None`` for any
        number.
    tuned : weights of the algorithm, or the file of ``cell tune`` that has them, instead of the
        shipped ones.

    Returns
    -------
    Packing
        Iterate over it for the placements; then it has the figures, bins and arrays.

    Raises
    ------
    ValueError
        There is no such bin, profile or algorithm, a number is too small, or ``tuned`` is not for
        this algorithm. While packing: a box
        is no box, or has the id of another one.
    EngineMismatch
        While packing: the algorithm chose a placement that the rules forbid.
    AlgorithmError
        While packing: an algorithm of your own failed.
    """
    for name, number in (('look_ahead', look_ahead), ('open_bins', open_bins)):
        if number < 1:
            msg = f'{name} is {number}; it must be 1 or more'
            raise ValueError(msg)
    spec = parse_bin(bin_spec) if isinstance(bin_spec, str) else bin_spec
    rules = find_profile(profile) if isinstance(profile, str) else profile
    how = find_algorithm(algorithm)
    table = tuned if tuned is None or isinstance(tuned, TunedTable) else read_table(tuned)
    if table is not None:
        check_table(table, how.name, how.weights)
    settings = PolicySettings(
        how, rules, WeightTable(weights or Weights()), budget_s, node_limit, backend,
        options or DecisionOptions(), table,
    )  # fmt: skip
    return Packing(stream, PackingTask(spec, settings, look_ahead, ('',) * open_bins))


@dataclass(frozen=True)
class PackingFigures:
    """What came of a stream; ``print`` shows it in a few lines.

    Attributes
    ----------
    boxes : how many were placed.
    unplaced : how many fit no empty bin.
    bins : how many hold a box.
    fill_closed : mean fill rate of the closed bins, percent; ``None`` without one (the paper's).
    fill_all : mean over all bins that hold a box.
    fill_first_failure : fill of the bin that was closed first.
    decision_s : mean, p50, p95, p99 and max of the seconds that a decision took.
    statuses : how many placements are proven optimal, and so on, by name.
    """

    boxes: int
    unplaced: int
    bins: int
    fill_closed: float | None
    fill_all: float | None
    fill_first_failure: float | None
    decision_s: dict[str, float | None]
    statuses: dict[str, int]

    def __str__(self) -> str:
        mean, most = self.decision_s['mean'], self.decision_s['max']
        packed = f'{how_many(self.boxes, "box")} in {how_many(self.bins, "bin")}'
        lines = [
            f'{packed}, {self.unplaced} unplaced',
            f'fill: {_percent(self.fill_closed)} of closed bins, {_percent(self.fill_all)} of all',
        ]
        if mean is not None and most is not None:
            lines.append(f'decision: {1e3 * mean:.1f} ms on average, {1e3 * most:.1f} ms at most')
        return '\n'.join(lines)


def _percent(fill: float | None) -> str:
    return 'none' if fill is None else f'{fill:.1f} %'


class Packing:
    """A stream being packed: an iterator over its placements.

    Attributes
    ----------
    placements : those made so far, in their order.
    closings : the bins closed so far, in their order.
    unplaced : boxes that no empty bin takes, so far.
    """

    def __init__(self, stream: Iterable[Box], task: PackingTask) -> None:
        self._task = task
        self._loop = PackingLoop(_each_once(stream), task)
        self._events = iter(self._loop)
        self.placements: list[PackedBox] = []
        self.closings: list[ClosedBin] = []
        self.unplaced: list[UnplacedBox] = []

    def __iter__(self) -> Iterator[PackedBox]:
        return self

    def __next__(self) -> PackedBox:
        for event in self._events:
            if isinstance(event, PackedBox):
                self.placements.append(event)
                return event
            if isinstance(event, ClosedBin):
                self.closings.append(event)
            else:
                self.unplaced.append(event)
        raise StopIteration

    def finish(self) -> PackingFigures:
        """Place what is left; the figures of it all."""
        for _ in self:
            pass
        return self.figures

    @property
    def figures(self) -> PackingFigures:
        """What came of it so far."""
        seconds = [packed.seconds for packed in self.placements]
        seconds += [closed.seconds for closed in self.closings]
        statuses = Counter(packed.choice.status.name.lower() for packed in self.placements)
        fills = fill_metrics(self._loop.closed_bins, self._loop.open_bins)
        return PackingFigures(
            boxes=len(self.placements),
            unplaced=len(self.unplaced),
            bins=len(self.bins),
            fill_closed=fills['fill_closed'],
            fill_all=fills['fill_all'],
            fill_first_failure=fills['fill_first_failure'],
            decision_s=time_summary(seconds),
            statuses=dict(sorted(statuses.items())),
        )

    @property
    def bins(self) -> tuple[Bin, ...]:
        """The bins that hold a box, as they are now, in the order in which they were opened."""
        bins = (*self._loop.closed_bins, *self._loop.open_bins)
        return tuple(sorted((used for used in bins if used.boxes), key=lambda used: used.serial))

    def arrays(self) -> PlacementArrays:
        """The placements so far, in their order, as arrays."""
        return placement_arrays((packed.placed, packed.target) for packed in self.placements)

    def violations(self) -> list[Violation]:
        """Every packing rule that is broken, by the slow rules that share nothing with an engine.

        It is empty: each placement is checked when it is made, and a broken rule raises.
        """
        return validate_bins(self.bins, self._task.settings.profile)


def _each_once(stream: Iterable[Box]) -> Iterator[Box]:
    seen = set()
    for box in stream:
        if box.id in seen:
            msg = f'box id {box.id!r} comes twice; each box needs an id of its own'
            raise ValueError(msg)
        seen.add(check_box(box).id)
        yield box
