"""Bounds of many groups in one go, and the first solution where none is known."""

from __future__ import annotations

import numpy as np
import pytest
from joint_cases import tiny_problem
from planner_cases import coarse, engine_of

from pack_planner.algorithms.incumbent import greedy
from pack_planner.joint.bin_by_bin.assignments import group_bounds
from pack_planner.joint.bin_by_bin.group_bounds import Closing
from pack_planner.joint.bin_by_bin.group_problem import search_room
from pack_planner.joint.bin_by_bin.search import JointSearch, split
from pack_planner.joint.bin_by_bin.who_goes_behind import room_for
from pack_planner.joint.budget import Budget

PROFILE = coarse('paper', 10)


def search_of(problem, start):
    return JointSearch(engine_of(PROFILE), problem.boxes, problem.bins, problem.forbidden, start)


def listed(problem):
    """The search, its listing and all groups, of boxes that were placed from small to large."""
    start = greedy(problem, sorted(problem.boxes, key=lambda box: box.volume_mm3))
    search = search_of(problem, start)
    listing = search._begin(Budget())
    if listing is None:
        return None
    listing.compare()
    goal = 10.0 * sum(candidate.objective for candidate in start)
    picks = listing.assignments(search._twins, goal, 10**6, 10**9)
    return listing, goal, *split(picks, listing.bin_of, len(problem.bins), [])[:2]


def around(problem):
    return room_for(len(problem.boxes)), Budget().stop


def with_a_start(count, seeds):
    for seed in seeds:
        problem = tiny_problem(engine_of(PROFILE), seed, count)
        if greedy(problem, sorted(problem.boxes, key=lambda box: box.volume_mm3)):
            yield problem


def test_no_bound_is_above_what_the_group_costs_also_by_some_of_its_boxes():
    possible, raised, by_part = 0, 0, 0
    for problem in with_a_start(5, range(12)):
        listing, goal, rows, parts = listed(problem)
        bounds = group_bounds(rows, listing.cost, listing.extra, listing.behind, *around(problem))
        before = bounds.copy()
        largest_first = np.argsort([-box.volume_mm3 for box in problem.boxes])
        closing = Closing(listing, largest_first, search_room, Budget())
        closing.begin(rows)
        closing.close(parts, bounds, goal)
        by_part += len(closing._parts)
        higher = np.flatnonzero(bounds > before + 1e-6)
        raised += len(higher)
        assert (bounds >= before).all()
        for g in higher[:: 1 + len(higher) // 100]:
            own = rows[g][rows[g] >= 0]
            group = listing.group(own, 0.0)
            group.improve(1.2 * goal, lambda places: True, Budget(), search_room(len(own)))
            assert bounds[g] <= group.cost + 1e-6
            possible += np.isfinite(group.cost)
    assert possible > 100
    assert raised > 1000
    assert by_part > 10


def test_a_group_is_closed_once():
    problem = next(with_a_start(4, range(12)))
    listing, goal, rows, parts = listed(problem)
    bounds = group_bounds(rows, listing.cost, listing.extra, listing.behind, *around(problem))
    budget = Budget()
    closing = Closing(listing, np.arange(4), search_room, budget)
    closing.begin(rows)
    closing.close(parts, bounds, goal)
    taken = budget.taken
    assert taken > 0
    closing.close(parts, bounds, goal)
    assert budget.taken == taken


@pytest.mark.parametrize('elsewhere', [0, 1, 3])
def test_corners_that_others_may_hold_need_no_hold_here(elsewhere):
    """Without help a group that leans costs the most; what others hold makes it no dearer."""
    leaning = 0
    for problem in with_a_start(3, range(8)):
        listing, goal, rows, _ = listed(problem)
        for row in rows[(rows >= 0).sum(axis=1) == 3][:30]:
            exact, helped = (
                listing.group(row, 0.0, corners) for corners in (None, np.full(3, elsewhere))
            )
            for group in (exact, helped):
                group.improve(goal, lambda places: True, Budget(), search_room(3))
            assert helped.bound <= exact.bound + 1e-6
            assert elsewhere or helped.bound == exact.bound
            leaning += listing.leans[row].any()
    assert leaning > 20


def test_a_large_box_that_lies_on_small_ones_of_the_look_ahead_alone_is_found():
    leaning = 0
    for seed in range(100):
        problem = tiny_problem(engine_of(PROFILE), seed, 4)
        if greedy(problem, problem.boxes) is None:
            result = search_of(problem, None).run(Budget())
            leaning += result.candidates is not None and any(
                not engine_of(PROFILE).stands(candidate.placed, problem.bins[candidate.bin_index])
                for candidate in result.candidates
            )
    assert leaning > 2
