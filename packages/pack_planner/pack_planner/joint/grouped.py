"""A joint solution better than a known one, or a proof that there is none, bin by bin.

First it is listed which bin, face up and base each box may have (:mod:`.options`, :mod:`.assign`);
then the cheapest arrangement of each group of boxes with given faces and bases in one bin is
searched (:mod:`.relations`), of those first that the cheapest assignment is made of. Groups are
shared by assignments. What may cost less than a goal is listed and searched at a time, the goal
first near the bound and last at the known solution: a better one found on the way saves the rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.values import Box, PlacedBox
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import Forbidden
from pack_planner.engine.height_map import GRAVITY
from pack_planner.joint.alone import weak_places
from pack_planner.joint.assign import (
    assignments,
    group_bounds,
    least_open,
    next_open,
)
from pack_planner.joint.bounds import UNBOUNDED, Reach
from pack_planner.joint.domains import paint
from pack_planner.joint.groups import Group, Ints, Nodes, empty_nodes
from pack_planner.joint.listing import Listing
from pack_planner.joint.narrowing import alike
from pack_planner.joint.options import bin_places
from pack_planner.joint.solution import JointResult, all_touch, joint_violations
from pack_planner.joint.solve import turns_of

#: Assignments that are listed at most, and options looked at for that.
_MOST_ASSIGNMENTS, _MOST_VISITS = 200_000, 100_000_000
#: The same where no solution is known.
_FEWER_ASSIGNMENTS, _FEWER_VISITS = 50_000, 20_000_000
#: Goals, as shares of the way from the bound to the known solution.
_GOALS = (0.25, 0.5, 1.0)
#: Goals where none is known, as multiples of the bound; the last one is anything.
_GOALS_UNKNOWN = (1.1, 1.2, 1.4, math.inf)
_EPS = 1e-6


class GroupedSearch:
    """Search for one joint problem."""

    def __init__(
        self, engine: Engine, boxes: Sequence[Box], bins: Sequence[BinModel], forbidden: Forbidden,
        known: Sequence[Candidate] | None, reach: Reach, at_least: float, *, cep: bool = False,
    ) -> None:  # fmt: skip
        """``reach`` are bounds for ``known`` or worse, ``at_least`` is one on the objective.

        Without a known solution only as much is listed as will do in a bin that is nearly full;
        elsewhere one is found soon by other means.
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

    def run(self, out_of_time: Callable[[], bool]) -> JointResult:
        """Search until it is proven, time is out, or there is too much to list."""
        least = self._reach.cheapest
        if np.isfinite(least).all():
            listing = self._list(self._upper - least.sum() + least)
            self._lower = max(self._lower, min(float(least.sum()), self._upper))
            is_known, bound = self._best is not None, self._lower
            for share in _GOALS if is_known else _GOALS_UNKNOWN:
                if self._lower >= self._upper - _EPS or out_of_time():
                    break
                goal = self._upper if share == math.inf else share * bound
                if is_known:
                    goal = self._lower + share * (self._upper - self._lower)
                if not self._search_below(listing, goal, out_of_time):
                    break
        else:
            self._lower = self._upper
        lower = min(self._lower, self._upper) / 10.0
        if self._best is None:
            proven = self._lower >= self._upper - _EPS
            return JointResult(None, math.inf, math.inf if proven else lower, self._taken)
        objective = sum(one.objective for one in self._best)
        return JointResult(self._best, objective, lower, self._taken)

    # -- what there is to choose from

    def _list(self, caps: NDArray[np.float64]) -> Listing:
        profile, least = self._engine.profile, self._reach.cheapest
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

    def _search_below(self, listing: Listing, goal: float, out_of_time: Callable[[], bool]) -> bool:
        """Search all that may cost less than ``goal``; False if that was not possible."""
        if (np.diff(listing.starts) == 0).any():
            self._lower = self._upper
            return True
        if listing.too_many:
            return False
        most, visits = _MOST_ASSIGNMENTS, _MOST_VISITS
        if self._best is None:
            most, visits = _FEWER_ASSIGNMENTS, _FEWER_VISITS
        picks = assignments(
            listing.starts, listing.cost, listing.extra, listing.behind, listing.rank, self._twins,
            listing.leans, listing.holds, listing.held, listing.needed, min(goal, self._upper),
            most, visits,
        )  # fmt: skip
        if len(picks) > most:
            return False
        rows, parts = _split(picks, listing.bin_of, len(self._bins))
        bounds = group_bounds(rows, listing.cost, listing.extra, listing.behind)
        for g, row in enumerate(rows):
            known = self._groups.get(row.tobytes())
            bounds[g] = max(bounds[g], known.bound if known else 0.0)
        order = np.argsort(bounds[parts].sum(axis=1), kind='stable')
        parts = parts[order]
        at, done = 0, True
        while done:
            at = int(next_open(parts, bounds, at, min(goal, self._upper)))
            if at < 0:
                break
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
