"""A joint solution better than a known one, or a proof that there is none, bin by bin.

First it is listed which bin and which face up each box may have (:mod:`.assign`); then the cheapest
arrangement of each group of boxes with given faces in one bin is searched (:mod:`.relations`), of
those first that the cheapest assignment is made of. Groups are shared by assignments, so that a few
hundred of them settle thousands. That is quick where the boxes spread over bins; many boxes in one
nearly empty bin are better left to CP-SAT, which learns from its mistakes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.values import Box, PlacedBox
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import REFUSED_RADIUS_MM, Forbidden
from pack_planner.engine.height_map import GRAVITY
from pack_planner.joint.alone import weak_places
from pack_planner.joint.assign import (
    assignments,
    extent,
    group_bounds,
    least_open,
    next_open,
    pair_costs,
)
from pack_planner.joint.bounds import NEVER, Reach
from pack_planner.joint.domains import paint
from pack_planner.joint.groups import Group, Ints, empty_nodes, levels_of
from pack_planner.joint.narrowing import alike
from pack_planner.joint.solution import JointResult, all_touch, joint_violations
from pack_planner.joint.solve import turns_of

#: Assignments that are listed at most; where there are more, nothing is searched.
_MOST_ASSIGNMENTS = 200_000
#: Nodes that a group gets in the first round; in each later round ten times as many.
_FIRST_ROUND = 300
_EPS = 1e-6


@dataclass(frozen=True)
class _Option:
    """A bin and a face up of one box; ``shapes`` are the rows of its turns, one or two."""

    box: int
    bin_index: int
    shapes: tuple[int, ...]
    size: tuple[int, int, int]


class GroupedSearch:
    """Search for one joint problem of which a solution is known."""

    def __init__(
        self, engine: Engine, boxes: Sequence[Box], bins: Sequence[BinModel], forbidden: Forbidden,
        known: Sequence[Candidate], reach: Reach, at_least: float, *, cep: bool = False,
    ) -> None:  # fmt: skip
        """``reach`` are bounds for ``known`` or worse, ``at_least`` is one on the objective."""
        self._engine, self._boxes, self._bins = engine, tuple(boxes), tuple(bins)
        self._best = tuple(known)
        self._reach, self._cep = reach, cep
        self._upper = 10.0 * sum(one.objective for one in known)
        self._lower = 10.0 * at_least
        # for each box the last one before it that differs in nothing but its id, -1 for none
        self._twins = np.full(len(boxes), -1, np.int64)
        for i, k in alike(boxes, bins, forbidden):
            self._twins[k] = i
        self._zones = [[forbidden(box, model.source) for model in bins] for box in boxes]
        self._tops = [np.unique(one.height).astype(np.int64) for one in reach.grounds]
        self._weak: dict[int, NDArray[np.int32]] = {}
        self._beside: dict[tuple[int, int, int], NDArray[np.bool_]] = {}
        self._nodes: dict[int, tuple[NDArray[Any], ...]] = {}
        self._groups: dict[int, Group] = {}
        self._rows = np.zeros((0, len(boxes)), np.int64)
        self._group_bounds = np.zeros(0)
        self._parts: Ints | None = None
        self._kept: list[_Option] = []
        self._hard = 0
        self._taken = 0
        self._list()

    def run(self, most_hard: int, out_of_time: Callable[[], bool]) -> JointResult:
        """Search until it is proven, time is out, or ``most_hard`` groups took many nodes."""
        limit = _FIRST_ROUND
        while (
            self._parts is not None
            and self._lower < self._upper - _EPS
            and self._round(limit, most_hard, out_of_time)
        ):
            limit = min(10 * limit, 1 << 40)
        lower = min(self._lower, self._upper) / 10.0
        objective = sum(one.objective for one in self._best)
        return JointResult(self._best, objective, lower, self._taken)

    # -- assignments

    def _options(self) -> list[_Option]:
        """Bins and faces up of all boxes, those that differ in the turn alone as one."""
        found: list[_Option] = []
        for j, ground in enumerate(self._reach.grounds):
            same_face: dict[tuple[int, ...], list[int]] = {}
            for s, (i, number, dx, dy, dz) in enumerate(ground.shapes.tolist()):
                plain = not any(self._boxes[i].com_offset_mm) and not self._zones[i][j]
                # the same space in another orientation is no other place
                key = (i, min(dx, dy), max(dx, dy), dz) if plain else (i, dx, dy, dz, number)
                rows = same_face.setdefault(key, [])
                if all(ground.shapes[o, 2] != dx for o in rows):
                    rows.append(s)
            for rows in same_face.values():
                i, _, dx, dy, dz = ground.shapes[rows[0]].tolist()
                found.append(_Option(i, j, tuple(rows), (min(dx, dy), max(dx, dy), dz)))
        return sorted(found, key=lambda o: (o.box, o.bin_index, o.size, o.shapes))

    def _list(self) -> None:
        """List the assignments that may cost less than the known solution, and their groups."""
        least = self._reach.cheapest
        if not np.isfinite(least).all():
            self._lower = self._upper
            return
        options = self._options()
        costs, extra = self._least_costs(options, self._upper - least.sum() + least)
        keep = [o for o in range(len(options)) if costs[o] < 1e17]
        self._kept = [options[o] for o in keep]
        costs, extra = costs[keep], extra[np.ix_(keep, keep)]
        box_of = np.array([option.box for option in self._kept], np.int64)
        starts = np.searchsorted(box_of, np.arange(len(self._boxes) + 1))
        if (np.diff(starts) == 0).any():
            self._lower = self._upper
            return
        kinds = sorted({(option.bin_index, option.size) for option in self._kept})
        rank = np.array([kinds.index((o.bin_index, o.size)) for o in self._kept], np.int64)
        picks = assignments(starts, costs, extra, rank, self._twins, self._upper, _MOST_ASSIGNMENTS)
        if len(picks) <= _MOST_ASSIGNMENTS:
            self._gather(picks, costs, extra)

    def _least_costs(
        self, options: Sequence[_Option], caps: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The least cost of each option below the caps of boxes, and what pairs must add to it."""
        step, least = self._engine.profile.resolution_mm, self._reach.cheapest
        costs, extra = np.full(len(options), np.inf), np.zeros((len(options), len(options)))
        limits = self._upper - least.sum() + least[:, None] + least[None, :]
        for j, ground in enumerate(self._reach.grounds):
            own = [o for o, option in enumerate(options) if option.bin_index == j]
            if not own:
                continue
            w1, w2, w3 = ground.weights
            shapes, low = ground.shapes, self._reach.low[j]
            flat = w2 * shapes[:, 4] + w3
            areas = np.zeros((len(shapes), 6), np.int64)
            cheapest = np.array([
                extent(low[s], w1 * step, w2, flat[s], caps[shapes[s, 0]], areas[s])
                for s in range(len(shapes))
            ])  # fmt: skip
            sizes = shapes[:, 2:5] // np.array([step, step, 1])
            pairs = pair_costs(
                low, sizes, areas, flat, shapes[:, 0].copy(), (w1 * step, w2), limits
            )
            for o in own:
                costs[o] = min(cheapest[s] for s in options[o].shapes)
            for a in own:
                for b in own:
                    if options[a].box != options[b].box:
                        both = pairs[np.ix_(options[a].shapes, options[b].shapes)].min()
                        extra[a, b] = max(0.0, both - costs[a] - costs[b])
        return costs, extra

    def _gather(self, picks: Ints, costs: NDArray[np.float64], extra: NDArray[np.float64]) -> None:
        """The groups of all assignments; each assignment as the numbers of its groups."""
        in_bin = np.array([option.bin_index for option in self._kept], np.int64)
        parts = np.zeros((len(picks), len(self._bins)), np.int64)
        rows = []
        total = 0
        for j in range(len(self._bins)):
            own = np.where(in_bin[picks] == j, picks, -1)
            distinct, inverse = np.unique(own, axis=0, return_inverse=True)
            parts[:, j] = inverse.ravel() + total
            rows.append(distinct)
            total += len(distinct)
        self._rows = np.concatenate(rows)
        self._group_bounds = group_bounds(self._rows, costs, extra)
        bound = self._group_bounds[parts].sum(axis=1)
        order = np.argsort(bound, kind='stable')
        self._parts = parts[order][bound[order] < self._upper - _EPS]
        self._raise_lower()

    # -- the search

    def _round(self, node_limit: int, most_hard: int, out_of_time: Callable[[], bool]) -> bool:
        """Go through the assignments once; False if there is no more to do now."""
        assert self._parts is not None
        at, done = 0, True
        while done:
            at = int(next_open(self._parts, self._group_bounds, at, self._upper))
            if at < 0:
                break
            for g in self._by_size(self._parts[at]):
                others = float(self._group_bounds[self._parts[at]].sum() - self._group_bounds[g])
                group = self._group(g)
                wanted = self._upper - others
                if group.bound >= min(wanted, group.cost) - _EPS:
                    continue
                if self._hard >= most_hard or out_of_time():
                    done = False
                    break
                self._taken += group.improve(
                    wanted, node_limit, partial(self._valid, g), out_of_time, self._room(g)
                )
                self._group_bounds[g] = group.bound
                self._hard += int(group.bound < min(wanted, group.cost) - _EPS)
            self._take(self._parts[at])
            at += 1
        self._raise_lower()
        return done and node_limit < 1 << 40

    def _raise_lower(self) -> None:
        assert self._parts is not None
        open_ones = float(least_open(self._parts, self._group_bounds))
        self._lower = max(self._lower, min(open_ones, self._upper))

    def _by_size(self, parts: Ints) -> list[int]:
        """Groups of an assignment, those of most boxes first."""
        sizes = (self._rows[parts] >= 0).sum(axis=1)
        return [int(parts[k]) for k in np.argsort(-sizes, kind='stable') if sizes[k] > 0]

    def _room(self, g: int) -> tuple[NDArray[Any], ...]:
        count = len(self._members(g))
        if count not in self._nodes:
            self._nodes[count] = empty_nodes(count)
        return self._nodes[count]

    def _members(self, g: int) -> list[_Option]:
        return [self._kept[o] for o in self._rows[g] if o >= 0]

    def _group(self, g: int) -> Group:
        if g not in self._groups:
            self._groups[g] = self._make_group(g)
        return self._groups[g]

    def _make_group(self, g: int) -> Group:
        members = self._members(g)
        j = members[0].bin_index
        ground, profile = self._reach.grounds[j], self._engine.profile
        step = profile.resolution_mm
        w1, w2, w3 = ground.weights
        rows = np.array([[m.shapes[0], m.shapes[-1]] for m in members])
        sizes = ground.shapes[rows][:, :, 2:5] // np.array([step, step, 1])
        low = self._reach.low[j][rows]
        heights = sizes[:, 0, 2].copy()
        inside = (low < NEVER).any(axis=1)
        columns, lines = inside.any(axis=2), inside.any(axis=1)
        first = (columns.argmax(axis=1), lines.argmax(axis=1), low.min(axis=(1, 2, 3)))
        final = (
            columns.shape[1] - 1 - columns[:, ::-1].argmax(axis=1),
            lines.shape[1] - 1 - lines[:, ::-1].argmax(axis=1), ground.size[2] - heights,
        )  # fmt: skip
        weak = self._weak_in(j)
        problem = (
            low, w2 * heights + w3, sizes,
            np.array([len(m.shapes) for m in members], np.int64), ground.height,
            levels_of(self._tops[j], heights, ground.size[2]), self._zones_of(members),
            self._walls(j, sizes), self._cep,
            (profile.support_tolerance_mm, profile.min_vertices), (w1 * step, w2),
            (REFUSED_RADIUS_MM, step),
            weak[rows] if len(weak) else np.zeros((0, 2, 1, 1), np.int32),
        )  # fmt: skip
        return Group(
            problem, np.stack(first, axis=1).astype(np.int64),
            np.stack(final, axis=1).astype(np.int64), float(self._group_bounds[g]),
        )  # fmt: skip

    def _zones_of(self, members: Sequence[_Option]) -> Ints:
        """Refused positions as rows (box of the group, turn, x, y, z)."""
        shapes = self._reach.grounds[members[0].bin_index].shapes
        rows = [
            (place, turn, *zone.corner_mm)
            for place, m in enumerate(members)
            for turn, s in enumerate(m.shapes)
            for zone in self._zones[m.box][m.bin_index] or ()
            if ORIENTATIONS.index(zone.orientation) == shapes[s, 1]
        ]
        return np.array(rows, np.int64).reshape(-1, 5)

    def _weak_in(self, j: int) -> NDArray[np.int32]:
        """See :func:`.alone.weak_places`; empty where enough corners are all that is asked for."""
        profile, model, ground = self._engine.profile, self._bins[j], self._reach.grounds[j]
        margin = -math.inf if profile.com_margin_mm is None else float(profile.com_margin_mm)
        share, step = float(profile.min_support_share), profile.resolution_mm
        if margin == -math.inf and share <= 0.0 and len(model.slack) == 0:
            return np.zeros((0, 1, 1), np.int32)
        if j not in self._weak:
            centres = np.zeros((len(self._boxes), len(ORIENTATIONS), 2))
            for i, box in enumerate(self._boxes):
                turns = turns_of(box, self._engine)
                centres[i, turns.numbers] = turns.centres
            height, owner = paint(model.boxes, *ground.height.shape, step)
            self._weak[j] = weak_places(
                ground.size, model.boxes, height, owner, model.slack, model.passed_on,
                (step, profile.support_tolerance_mm, margin, share), profile.min_vertices,
                ground.shapes, centres[ground.shapes[:, 0], ground.shapes[:, 1]],
                np.array([box.weight_kg * GRAVITY for box in self._boxes]),
            )  # fmt: skip
        return self._weak[j]

    def _walls(self, j: int, sizes: Ints) -> NDArray[np.bool_]:
        """Where each box is beside a wall or placed box, (boxes, turns, axes, cells)."""
        cells = max(self._reach.grounds[j].height.shape)
        found = np.zeros((*sizes.shape[:2], 2, cells), np.bool_)
        if self._cep:
            step = self._engine.profile.resolution_mm
            for i, t in np.ndindex(*sizes.shape[:2]):
                for axis in (0, 1):
                    wide = int(sizes[i, t, axis]) * step
                    found[i, t, axis] = self._beside_along(j, axis, wide, cells)
        return found

    def _beside_along(self, j: int, axis: int, wide: int, cells: int) -> NDArray[np.bool_]:
        key = (j, axis, wide)
        if key not in self._beside:
            source, step = self._bins[j].source, self._engine.profile.resolution_mm
            low = np.arange(cells) * step
            high = low + wide
            found = (low < step) | (source.spec.size_mm[axis] - high < step)
            for one in source.boxes:
                after, before = low - one.far_mm[axis], one.corner_mm[axis] - high
                found |= ((after >= 0) & (after < step)) | ((before >= 0) & (before < step))
            self._beside[key] = found
        return self._beside[key]

    # -- solutions

    def _candidates(self, g: int, places: Ints) -> list[Candidate]:
        """What a group places where, lowest first."""
        step = self._engine.profile.resolution_mm
        found = []
        for option, (x, y, z, turn) in zip(self._members(g), places.tolist(), strict=True):
            shape = self._reach.grounds[option.bin_index].shapes[option.shapes[turn]].tolist()
            corner, size = (x * step, y * step, z), (shape[2], shape[3], shape[4])
            placed = PlacedBox(self._boxes[option.box], corner, size, ORIENTATIONS[shape[1]])
            cost = self._engine.objective(placed, option.bin_index)
            found.append(Candidate(placed, option.bin_index, cost))
        return sorted(found, key=lambda one: one.placed.corner_mm[2])

    def _valid(self, g: int, places: Ints) -> bool:
        candidates = self._candidates(g, places)
        if joint_violations(candidates, self._bins, self._engine):
            return False
        return not self._cep or all_touch(candidates, self._bins, self._engine)

    def _take(self, parts: Ints) -> None:
        """Keep an assignment whose groups all have an arrangement, if it is better."""
        groups = [(g, self._groups.get(g)) for g in self._by_size(parts)]
        if sum(group.cost if group else math.inf for _, group in groups) >= self._upper - _EPS:
            return
        found = [one for g, group in groups if group for one in self._candidates(g, group.places)]
        self._best = tuple(sorted(found, key=lambda one: one.placed.corner_mm[2]))
        self._upper = 10.0 * sum(one.objective for one in self._best)
