"""A joint solution better than a known one, or a proof that there is none, bin by bin.

First it is listed which bin, face up and base each box may have (:mod:`.options`, :mod:`.assign`);
then the cheapest arrangement of each group of boxes with given faces and bases in one bin is
searched (:mod:`.relations`), of those first that the cheapest assignment is made of. Groups are
shared by assignments; most of them are closed in one go (:mod:`.closing`). What may cost less than
a goal is listed and searched at a time, the goal first near the bound and last at the known
solution: a better one found on the way saves the rest. Where none is known, one is searched first
(:mod:`.fitting`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain, repeat

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.values import Box, PlacedBox
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import Forbidden
from pack_planner.engine.height_map import GRAVITY
from pack_planner.joint.bin_by_bin.assignments import (
    assignments,
    group_bounds,
    least_open,
    next_open,
)
from pack_planner.joint.bin_by_bin.fitting import Fitting
from pack_planner.joint.bin_by_bin.group import Group, Ints, Nodes, empty_nodes
from pack_planner.joint.bin_by_bin.group_bounds import Closing
from pack_planner.joint.bin_by_bin.listing import Listing
from pack_planner.joint.bin_by_bin.options import bin_places
from pack_planner.joint.bin_by_bin.weak_places import weak_places
from pack_planner.joint.bounds import UNBOUNDED, Reach
from pack_planner.joint.by_solver.narrowing import alike
from pack_planner.joint.domains import paint
from pack_planner.joint.solution import JointResult, all_touch, joint_violations
from pack_planner.joint.solve import turns_of

#: Assignments that are listed at most, and options looked at for that.
_MOST_ASSIGNMENTS, _MOST_VISITS = 200_000, 100_000_000
#: Options looked at in a second, on a fast machine.
_VISITS_PER_S = 60_000_000
#: Goals, as shares of the way from the bound to the known solution.
_GOALS = (0.25, 0.5)
#: The least step of the goal, as a share of the bound.
_LEAST_STEP = 0.003
#: Assignments whose groups are closed in one go.
_BATCH = 500
_EPS = 1e-6


class GroupedSearch:
    """Search for one joint problem."""

    def __init__(
        self, engine: Engine, boxes: Sequence[Box], bins: Sequence[BinModel], forbidden: Forbidden,
        known: Sequence[Candidate] | None, reach: Reach, at_least: float, *, cep: bool = False,
    ) -> None:  # fmt: skip
        """``reach`` are bounds for ``known`` or worse, ``at_least`` is one on the objective.

        Without a known solution one is searched first.
        """
        self._engine, self._boxes, self._bins = engine, tuple(boxes), tuple(bins)
        self._best = None if known is None else tuple(known)
        self._reach, self._cep = reach, cep
        self._upper = UNBOUNDED
        if known is not None:
            self._upper = 10.0 * sum(one.objective for one in known)
        self._lower = 10.0 * at_least
        # for each box the last one before it that differs in nothing but its id, -1 for none
        self._twins = np.full(len(boxes), -1, np.int64)
        for i, k in alike(boxes, bins, forbidden):
            self._twins[k] = i
        self._zones = [[forbidden(box, model.source) for box in boxes] for model in bins]
        self._nodes: dict[int, Nodes] = {}
        self._groups: dict[bytes, Group] = {}
        self._taken = 0
        self._seconds_left: Callable[[], float] = lambda: math.inf

    def run(
        self, out_of_time: Callable[[], bool], seconds_left: Callable[[], float] = lambda: math.inf
    ) -> JointResult:
        """Search until it is proven, time is out, or there is too much to list.

        Listing does not ask whether time is out; ``seconds_left`` limits how much it looks at.
        """
        self._seconds_left = seconds_left
        least = self._reach.cheapest
        if not np.isfinite(least).all():
            self._lower = self._upper
            return self._result()
        listing = self._list()
        self._lower = max(self._lower, min(float(least.sum()), self._upper))
        if self._best is None:
            if not self._first(listing, out_of_time):
                return self._result()
            listing = self._list()
        self._search(listing, out_of_time)
        return self._result()

    @property
    def found(self) -> bool:
        """Whether a solution is known."""
        return self._best is not None

    def _result(self) -> JointResult:
        lower = min(self._lower, self._upper) / 10.0
        if self._best is None:
            proven = self._lower >= self._upper - _EPS
            return JointResult(None, math.inf, math.inf if proven else lower, self._taken)
        objective = sum(one.objective for one in self._best)
        return JointResult(self._best, objective, lower, self._taken)

    # -- what there is to choose from

    def _list(self) -> Listing:
        """What there is for less than the best known solution."""
        profile, least = self._engine.profile, self._reach.cheapest
        caps = self._upper - least.sum() + least
        rule = (
            int(profile.resolution_mm), int(profile.support_tolerance_mm), int(profile.min_vertices)
        )  # fmt: skip
        places = [
            bin_places(ground, self._reach.low[j], self._weak_in(j), self._zones[j], rule)
            for j, ground in enumerate(self._reach.grounds)
        ]
        limits = self._upper - least.sum() + least[:, None] + least[None, :]
        return Listing(places, self._boxes, self._bins, caps, limits, cep=self._cep)

    def _weak_in(self, j: int) -> NDArray[np.int32]:
        """See :func:`.alone.weak_places`; no cells where enough corners are all that is asked."""
        profile, model, ground = self._engine.profile, self._bins[j], self._reach.grounds[j]
        margin = -math.inf if profile.com_margin_mm is None else float(profile.com_margin_mm)
        share, step = float(profile.min_support_share), profile.resolution_mm
        if margin == -math.inf and share <= 0.0 and len(model.slack) == 0:
            return np.zeros((len(ground.shapes), 0, 0), np.int32)
        centres = np.zeros((len(self._boxes), len(ORIENTATIONS), 2))
        for i, box in enumerate(self._boxes):
            turns = turns_of(box, self._engine)
            centres[i, turns.numbers] = turns.centres
        height, owner = paint(model.boxes, *ground.height.shape, step)
        found: NDArray[np.int32] = weak_places(
            ground.size, model.boxes, height, owner, model.slack, model.passed_on,
            (step, profile.support_tolerance_mm, margin, share), profile.min_vertices,
            ground.shapes, centres[ground.shapes[:, 0], ground.shapes[:, 1]],
            np.array([box.weight_kg * GRAVITY for box in self._boxes]),
        )  # fmt: skip
        return found

    # -- the search

    def _first(self, listing: Listing, out_of_time: Callable[[], bool]) -> bool:
        """Find a solution where none is known, or prove that there is none."""
        if listing.too_many:
            return False
        unsure = False

        def arrange(pick: Ints) -> bool:
            nonlocal unsure
            rows, parts = _split(pick[None, :], listing.bin_of, len(self._bins))
            bounds = np.zeros(len(rows))
            unsure |= not self._try(listing, rows, parts[0], bounds, math.inf, out_of_time)
            return self.found

        fitting = Fitting(listing, self._twins, arrange, self._room, out_of_time)
        fitting.run()
        self._taken += fitting.nodes
        self._groups.clear()  # by numbers of options, which change
        if not self.found and not unsure and not out_of_time():
            self._lower = self._upper
        return self.found

    def _search(self, listing: Listing, out_of_time: Callable[[], bool]) -> None:
        """Search what may cost less than a goal, which goes up to the best known solution."""
        if (np.diff(listing.starts) == 0).any():
            self._lower = self._upper
        if listing.too_many or self._lower >= self._upper - _EPS:
            return
        listing.compare()
        largest_first = np.argsort([-box.volume_mm3 for box in self._boxes], kind='stable')
        closing = Closing(listing, largest_first, self._room, out_of_time)
        too_much = math.inf
        for share in chain(_GOALS, repeat(1.0)):
            picks = None
            while picks is None and self._lower < self._upper - _EPS and not out_of_time():
                goal = self._lower + share * (self._upper - self._lower)
                if goal >= too_much - _EPS:
                    goal = (self._lower + too_much) / 2
                    if goal < (1.0 + _LEAST_STEP) * self._lower:
                        return
                picks = self._picks(listing, goal)
                if picks is None:
                    too_much = goal
            if picks is None or not self._search_below(listing, picks, closing, goal, out_of_time):
                return

    def _picks(self, listing: Listing, goal: float) -> Ints | None:
        """The assignments that may cost less than ``goal``, None for too many."""
        visits = int(min(_MOST_VISITS, max(self._seconds_left(), 0.0) * _VISITS_PER_S))
        picks: Ints = assignments(
            listing.starts, listing.cost, listing.extra, listing.behind, listing.rank, self._twins,
            listing.leans, listing.holds, listing.held, listing.needed, goal,
            _MOST_ASSIGNMENTS, visits,
        )  # fmt: skip
        return picks if len(picks) <= _MOST_ASSIGNMENTS else None

    def _search_below(
        self, listing: Listing, picks: Ints, closing: Closing, goal: float,
        out_of_time: Callable[[], bool],
    ) -> bool:  # fmt: skip
        """Search the assignments that may cost less than ``goal``; False when time is out."""
        rows, parts = _split(picks, listing.bin_of, len(self._bins))
        bounds = group_bounds(rows, listing.cost, listing.extra, listing.behind)
        for g, row in enumerate(rows):
            known = self._groups.get(row.tobytes())
            bounds[g] = max(bounds[g], known.bound if known else 0.0)
        order = np.argsort(bounds[parts].sum(axis=1), kind='stable')
        parts = parts[order]
        closing.begin(rows)
        at, ahead, done = 0, 0, True
        while done:
            upper = min(goal, self._upper)
            at = int(next_open(parts, bounds, at, upper))
            if at < 0:
                break
            if out_of_time():
                done = False
            elif at >= ahead:
                ahead = at + _BATCH
                self._taken += closing.close(parts[at:ahead], bounds, upper)
            else:
                done = self._try(listing, rows, parts[at], bounds, goal, out_of_time)
                at += 1
        self._lower = max(
            self._lower, min(float(least_open(parts, bounds)), min(goal, self._upper))
        )
        return done

    def _try(
        self, listing: Listing, rows: Ints, parts: Ints, bounds: NDArray[np.float64], goal: float,
        out_of_time: Callable[[], bool],
    ) -> bool:  # fmt: skip
        """Search the groups of one assignment, as far as it may still be below ``goal``."""
        sizes = (rows[parts] >= 0).sum(axis=1)
        members = [int(parts[k]) for k in np.argsort(-sizes, kind='stable') if sizes[k] > 0]
        for g in members:
            wanted = min(goal, self._upper) - float(bounds[parts].sum() - bounds[g])
            group = self._group(listing, rows[g], float(bounds[g]))
            if group.bound >= min(wanted, group.cost) - _EPS:
                continue
            if out_of_time():
                return False
            self._taken += group.improve(
                wanted, partial(self._valid, listing, rows[g]), out_of_time,
                self._room(int((rows[g] >= 0).sum())),
            )  # fmt: skip
            bounds[g] = group.bound
            if group.bound < min(wanted, group.cost) - _EPS:
                return False
        found = [self._groups[rows[g].tobytes()] for g in members]
        if sum(group.cost for group in found) < self._upper - _EPS:
            self._take([
                one
                for g, group in zip(members, found, strict=True)
                for one in self._candidates(listing, rows[g], group.places)
            ])  # fmt: skip
        return True

    def _group(self, listing: Listing, row: Ints, bound: float) -> Group:
        key = row.tobytes()
        if key not in self._groups:
            self._groups[key] = Group(*listing.problem_of(row[row >= 0]), bound)
        return self._groups[key]

    def _room(self, count: int) -> Nodes:
        if count not in self._nodes:
            self._nodes[count] = empty_nodes(count)
        return self._nodes[count]

    # -- solutions

    def _candidates(self, listing: Listing, row: Ints, places: Ints) -> list[Candidate]:
        """What a group places where, lowest first."""
        step = self._engine.profile.resolution_mm
        found = []
        for o, (x, y, turn) in zip(row[row >= 0].tolist(), places.tolist(), strict=True):
            j = int(listing.bin_of[o])
            shape = self._reach.grounds[j].shapes[listing.shape_of(o, turn)].tolist()
            corner = (x * step, y * step, int(listing.base[o]))
            size = (shape[2], shape[3], shape[4])
            placed = PlacedBox(self._boxes[shape[0]], corner, size, ORIENTATIONS[shape[1]])
            found.append(Candidate(placed, j, self._engine.objective(placed, j)))
        return sorted(found, key=lambda one: one.placed.corner_mm[2])

    def _valid(self, listing: Listing, row: Ints, places: Ints) -> bool:
        candidates = self._candidates(listing, row, places)
        if joint_violations(candidates, self._bins, self._engine):
            return False
        return not self._cep or all_touch(candidates, self._bins, self._engine)

    def _take(self, better: list[Candidate]) -> None:
        self._best = tuple(sorted(better, key=lambda one: one.placed.corner_mm[2]))
        self._upper = 10.0 * sum(one.objective for one in self._best)


def _split(picks: Ints, bin_of: Ints, bins: int) -> tuple[Ints, Ints]:
    """The groups of assignments, rows of options; each assignment as the numbers of its groups."""
    parts = np.zeros((len(picks), bins), np.int64)
    rows = []
    total = 0
    for j in range(bins):
        own = np.where(bin_of[picks] == j, picks, -1)
        distinct, inverse = np.unique(own, axis=0, return_inverse=True)
        parts[:, j] = inverse.ravel() + total
        rows.append(distinct)
        total += len(distinct)
    return np.concatenate(rows), parts
