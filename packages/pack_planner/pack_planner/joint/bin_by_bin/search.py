"""The search: a joint solution better than a known one, or a proof that there is none, bin by bin.

First it is bounded where each box can be (:mod:`pack_planner.joint.reach`). Then it is listed which
bin, face up and base each box may have (:mod:`.options`, :mod:`.assignments`), and the cheapest
arrangement of each group of boxes with given faces and bases in one bin is searched
(:mod:`.arrangement`), of those first that the cheapest assignment is made of. Groups are shared by
assignments; most of them are closed in one go (:mod:`.group_bounds`). What may cost less than a
goal is listed and searched at a time, the goal first near the bound and last at the known solution:
a better one found on the way saves the rest. Where none is known, one is searched first
(:mod:`.fitting`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, repeat

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.values import Box, PlacedBox
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import Forbidden
from pack_planner.engine.height_map import GRAVITY
from pack_planner.engine.turns import support_rule, turns_of
from pack_planner.joint.bin_by_bin.assignments import group_bounds, least_open, next_open
from pack_planner.joint.bin_by_bin.fitting import Fitting
from pack_planner.joint.bin_by_bin.group import Group
from pack_planner.joint.bin_by_bin.group_bounds import Closing
from pack_planner.joint.bin_by_bin.group_problem import Ints, SearchRoom, search_room
from pack_planner.joint.bin_by_bin.listing import Listing
from pack_planner.joint.bin_by_bin.options import bin_places
from pack_planner.joint.bin_by_bin.weak_places import weak_places
from pack_planner.joint.bin_by_bin.who_goes_behind import room_for
from pack_planner.joint.bounds import UNBOUNDED, SupportRule
from pack_planner.joint.budget import Budget
from pack_planner.joint.reach import Reach, find_reach
from pack_planner.joint.solution import JointResult, all_touch, joint_violations

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


class JointSearch:
    """Search for one joint problem."""

    def __init__(
        self, engine: Engine, boxes: Sequence[Box], bins: Sequence[BinModel], forbidden: Forbidden,
        known: Sequence[Candidate] | None = None, *, cep: bool = False,
    ) -> None:  # fmt: skip
        """Nothing is searched before :meth:`find` or :meth:`run`.

        Parameters
        ----------
        engine : rules and weights.
        boxes, bins : of the joint problem, see :class:`pack_planner.algorithms.base.Problem`.
        forbidden : placements that the arm refused.
        known : one placement of every box, in an order that the rules allow; without one it is
            searched first.
        cep : each box touches something along x and along y, in ``known`` too.
        """
        self._engine, self._boxes, self._bins = engine, tuple(boxes), tuple(bins)
        self._forbidden, self._cep = forbidden, cep
        self._best = None if known is None else tuple(known)
        self._upper = UNBOUNDED
        if known is not None:
            self._upper = 10.0 * sum(candidate.objective for candidate in known)
        self._lower = 0.0
        # for each box the last one before it that differs in nothing but its id, -1 for none
        self._twins = np.full(len(boxes), -1, np.int64)
        for i, k in twins(boxes, bins, forbidden):
            self._twins[k] = i
        self._zones = [[forbidden(box, model.source) for box in boxes] for model in bins]
        self._reach: Reach | None = None
        self._rooms: dict[int, SearchRoom] = {}
        self._groups: dict[bytes, Group] = {}
        self._taken = 0

    @property
    def found(self) -> bool:
        """Whether a solution is known."""
        return self._best is not None

    @property
    def reach(self) -> Reach | None:
        """Where each box can be in a solution better than the one given; None before a search."""
        return self._reach

    def find(self, budget: Budget) -> JointResult:
        """Search any solution, or a proof that there is none, unless one is known."""
        before = budget.taken
        listing = None if self.found else self._begin(budget)
        if listing is not None:
            self._first(listing, budget)
        self._taken += budget.taken - before
        return self.result()

    def run(self, budget: Budget) -> JointResult:
        """Search until it is proven, the budget is out, or there is too much to list."""
        self.find(budget)
        before = budget.taken
        if self.found:
            listing = self._begin(budget)
            if listing is not None:
                self._search(listing, budget)
        self._taken += budget.taken - before
        return self.result()

    def result(self) -> JointResult:
        """What is known so far."""
        lower = min(self._lower, self._upper) / 10.0
        if self._best is None:
            proven = self._lower >= self._upper - _EPS
            return JointResult(None, math.inf, math.inf if proven else lower, self._taken)
        objective = sum(candidate.objective for candidate in self._best)
        return JointResult(self._best, objective, lower, self._taken)

    # -- what there is to choose from

    def _begin(self, budget: Budget) -> Listing | None:
        """What there is for less than the best known solution; None when that is the end of it."""
        self._groups.clear()  # by numbers of options, which change
        if self._lower >= self._upper - _EPS or budget.is_out():
            return None
        if self._reach is None:
            self._reach = find_reach(
                self._engine, self._boxes, self._bins, self._forbidden, self._best, budget
            )
            if self._reach is None:
                return None
            least = self._reach.cheapest
            if not np.isfinite(least).all():
                self._lower = self._upper
                return None
            self._lower = min(float(least.sum()), self._upper)
        listing = self._list(self._reach, budget)
        if budget.is_out():
            return None
        if (np.diff(listing.starts) == 0).any():
            self._lower = self._upper
            return None
        return None if listing.too_many else listing

    def _list(self, reach: Reach, budget: Budget) -> Listing:
        profile, least = self._engine.profile, reach.cheapest
        caps = self._upper - least.sum() + least
        rule = SupportRule(
            int(profile.resolution_mm), int(profile.support_tolerance_mm), int(profile.min_vertices)
        )
        places = [
            bin_places(
                ground, reach.low[j], self._weak_in(j, reach, budget), self._zones[j], rule,
                budget.stop,
            )
            for j, ground in enumerate(reach.grounds)
        ]  # fmt: skip
        limits = self._upper - least.sum() + least[:, None] + least[None, :]
        return Listing(places, self._boxes, self._bins, caps, limits, budget.stop, cep=self._cep)

    def _weak_in(self, j: int, reach: Reach, budget: Budget) -> NDArray[np.int32]:
        """See :mod:`.weak_places`; no cells where enough corners are all that is asked."""
        profile, model, ground = self._engine.profile, self._bins[j], reach.grounds[j]
        rule = support_rule(profile)
        if max(rule[2], rule[4]) == -math.inf and rule[3] <= 0.0 and len(model.slack) == 0:
            return np.zeros((len(ground.shapes), 0, 0), np.int32)
        centres, sures = np.zeros((len(ground.shapes), 2)), np.zeros((len(ground.shapes), 4))
        for s, (which, number) in enumerate(ground.shapes[:, :2].tolist()):
            turns = turns_of(self._boxes[which], profile)
            row = int(np.flatnonzero(turns.numbers == number)[0])
            centres[s], sures[s] = turns.centres[row], turns.sures[row]
        weak: NDArray[np.int32] = weak_places(
            ground.size, model.boxes, ground.height, ground.owner, model.slack, model.passed_on,
            model.bearing, rule, profile.min_vertices, ground.shapes, centres, sures,
            np.array([box.weight_kg * GRAVITY for box in self._boxes]), budget.stop,
        )  # fmt: skip
        return weak

    # -- the search

    def _first(self, listing: Listing, budget: Budget) -> None:
        """Find a solution where none is known, or prove that there is none."""
        unsure = False

        def arrange(pick: Ints) -> bool:
            nonlocal unsure
            rows, parts, _ = split(pick[None, :], listing.bin_of, len(self._bins), [])
            bounds = np.zeros(len(rows))
            unsure |= not self._try(listing, rows, parts[0], bounds, math.inf, budget)
            return self.found

        Fitting(listing, self._twins, arrange, self._room, budget).run()
        if not self.found and not unsure and not budget.is_out():
            self._lower = self._upper

    def _search(self, listing: Listing, budget: Budget) -> None:
        """Search what may cost less than a goal, which goes up to the best known solution."""
        listing.compare()
        if budget.is_out():
            return
        largest_first = np.argsort([-box.volume_mm3 for box in self._boxes], kind='stable')
        closing = Closing(listing, largest_first, self._room, budget)
        too_much = math.inf
        for share in chain(_GOALS, repeat(1.0)):
            picks = None
            while picks is None and self._lower < self._upper - _EPS and not budget.is_out():
                goal = self._lower + share * (self._upper - self._lower)
                if goal >= too_much - _EPS:
                    goal = (self._lower + too_much) / 2
                    if goal < (1.0 + _LEAST_STEP) * self._lower:
                        return
                visits = int(min(_MOST_VISITS, budget.seconds_left * _VISITS_PER_S))
                picks = listing.assignments(self._twins, goal, _MOST_ASSIGNMENTS, visits)
                if picks is None:
                    too_much = goal
            if picks is None or not self._search_below(listing, picks, closing, goal, budget):
                return

    def _search_below(
        self, listing: Listing, picks: Ints, closing: Closing, goal: float, budget: Budget
    ) -> bool:
        """Search the assignments that may cost less than ``goal``; False when time is out."""
        known = list(self._groups.values())
        rows, parts, at_known = split(picks, listing.bin_of, len(self._bins), [*self._groups])
        bounds = group_bounds(rows, listing.cost, listing.extra, listing.behind,
                              room_for(len(self._boxes)), budget.stop)  # fmt: skip
        np.maximum.at(bounds, at_known, [group.bound for group in known])
        order = np.argsort(bounds[parts].sum(axis=1), kind='stable')
        parts = parts[order]
        closing.begin(rows)
        at, ahead, done = 0, 0, True
        while done:
            upper = min(goal, self._upper)
            at = int(next_open(parts, bounds, at, upper))
            if at < 0:
                break
            if budget.is_out():
                done = False
            elif at >= ahead:
                ahead = at + _BATCH
                closing.close(parts[at:ahead], bounds, upper)
            else:
                done = self._try(listing, rows, parts[at], bounds, goal, budget)
                at += 1
        self._lower = max(
            self._lower, min(float(least_open(parts, bounds)), min(goal, self._upper))
        )
        return done

    def _try(
        self, listing: Listing, rows: Ints, parts: Ints, bounds: NDArray[np.float64], goal: float,
        budget: Budget,
    ) -> bool:  # fmt: skip
        """Search the groups of one assignment, as far as it may still be below ``goal``.

        Parameters
        ----------
        listing : the options.
        rows, parts : all groups, and those of this assignment.
        bounds : of all groups; raised here.
        goal : nothing that costs so much is wanted.
        budget : what this may take; False when that is not enough.
        """
        sizes = (rows[parts] >= 0).sum(axis=1)
        members = [int(parts[k]) for k in np.argsort(-sizes, kind='stable') if sizes[k] > 0]
        for g in members:
            wanted = min(goal, self._upper) - float(bounds[parts].sum() - bounds[g])
            group = self._group(listing, rows[g], float(bounds[g]))
            if group.bound >= min(wanted, group.cost) - _EPS:
                continue
            if budget.is_out():
                return False
            valid = partial(self._valid, listing, rows[g])
            group.improve(wanted, valid, budget, self._room(int((rows[g] >= 0).sum())))
            bounds[g] = group.bound
            if group.bound < min(wanted, group.cost) - _EPS:
                return False
        groups = [self._groups[rows[g].tobytes()] for g in members]
        if sum(group.cost for group in groups) < self._upper - _EPS:
            self._take([
                candidate
                for g, group in zip(members, groups, strict=True)
                for candidate in self._candidates(listing, rows[g], group.places)
            ])  # fmt: skip
        return True

    def _group(self, listing: Listing, row: Ints, bound: float) -> Group:
        key = row.tobytes()
        if key not in self._groups:
            self._groups[key] = listing.group(row[row >= 0], bound)
        return self._groups[key]

    def _room(self, count: int) -> SearchRoom:
        if count not in self._rooms:
            self._rooms[count] = search_room(count)
        return self._rooms[count]

    # -- solutions

    def _candidates(self, listing: Listing, row: Ints, places: Ints) -> list[Candidate]:
        """What a group places where, lowest first."""
        step = self._engine.profile.resolution_mm
        assert self._reach is not None
        candidates = []
        for o, (x, y, turn) in zip(row[row >= 0].tolist(), places.tolist(), strict=True):
            j = int(listing.bin_of[o])
            shape = self._reach.grounds[j].shapes[listing.shape_of(o, turn)].tolist()
            corner = (x * step, y * step, int(listing.base[o]))
            size = (shape[2], shape[3], shape[4])
            placed = PlacedBox(self._boxes[shape[0]], corner, size, ORIENTATIONS[shape[1]])
            candidates.append(Candidate(placed, j, self._engine.objective(placed, j)))
        return sorted(candidates, key=lambda candidate: candidate.placed.corner_mm[2])

    def _valid(self, listing: Listing, row: Ints, places: Ints) -> bool:
        candidates = self._candidates(listing, row, places)
        if joint_violations(candidates, self._bins, self._engine):
            return False
        return not self._cep or all_touch(candidates, self._bins, self._engine)

    def _take(self, better: list[Candidate]) -> None:
        self._best = tuple(sorted(better, key=lambda candidate: candidate.placed.corner_mm[2]))
        self._upper = 10.0 * sum(candidate.objective for candidate in self._best)


def twins(
    boxes: Sequence[Box], bins: Sequence[BinModel], forbidden: Forbidden
) -> tuple[tuple[int, int], ...]:
    """Each box with the next that differs in nothing but its id, by their numbers."""
    zones = [[forbidden(box, model.source) for model in bins] for box in boxes]
    pairs = []
    for i, box in enumerate(boxes):
        for k in range(i + 1, len(boxes)):
            if replace(boxes[k], id=box.id) == box and zones[k] == zones[i]:
                pairs.append((i, k))
                break
    return tuple(pairs)


def split(picks: Ints, bin_of: Ints, bins: int, known: Sequence[bytes]) -> tuple[Ints, Ints, Ints]:
    """The groups that assignments are made of.

    Parameters
    ----------
    picks : an option for each box, (assignments, boxes).
    bin_of : the bin of each option.
    bins : how many there are.
    known : rows of groups as bytes, to be among the groups too.

    Returns
    -------
    rows : the groups, options by box, -1 for none, each once.
    parts : the numbers of the groups of each assignment, (assignments, bins).
    at_known : the numbers of the known ones.
    """
    count = picks.shape[1]
    parts = np.empty((len(picks), bins), np.int64)
    more = np.frombuffer(b''.join(known), np.int64).reshape(-1, count)
    at_known = np.empty(len(more), np.int64)
    in_bin = bin_of[more.max(axis=1, initial=0)]
    rows, total = [], 0
    for j in range(bins):
        own = np.concatenate([np.where(bin_of[picks] == j, picks, -1), more[in_bin == j]])
        # options are few enough for short numbers, which are sorted several times as fast
        order = np.lexsort(own.astype(np.int16).T[::-1])
        own = own[order]
        first = np.ones(len(own), np.bool_)
        first[1:] = (own[1:] != own[:-1]).any(axis=1)
        number = np.empty(len(own), np.int64)
        number[order] = np.cumsum(first) - 1 + total
        parts[:, j], at_known[in_bin == j] = number[: len(picks)], number[len(picks) :]
        rows.append(own[first])
        total += len(rows[-1])
    return np.concatenate(rows), parts, at_known
