"""Bins that serve one destination: who may go where, what is closed, what is opened instead."""

from __future__ import annotations

import time

import pytest
from planner_cases import SMALL, engine_of

from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.validator import with_box
from pack_msgs_py.values import Bin, Box
from pack_planner.algorithms import BUILT_IN, Choice, Problem, find_algorithm
from pack_planner.decision.bin_closing import bin_to_close, next_destination
from pack_planner.decision.options import DecisionOptions
from pack_planner.decision.planner import PlaceStep, Planner, RejectStep
from pack_planner.decision.policy import DecisionState, PolicySettings, by_wait, next_step

PAPER = PROFILES['paper']


def parcel(name, destination='', edge=100.0):
    return Box(name, (edge, edge, edge), destination=destination)


def bins(*destinations):
    return tuple(
        Bin(f'bin-{number}', number, SMALL, destination=destination)
        for number, destination in enumerate(destinations, start=1)
    )


def filled(target, *boxes):
    for box in boxes:
        candidate = engine_of(PAPER).best_placement(box, [engine_of(PAPER).model(target)])
        target = with_box(target, candidate.placed)
    return target


def step(algorithm, boxes, open_bins, **changes):
    settings = PolicySettings(algorithm, PAPER, **changes)
    return next_step(settings, engine_of(PAPER), DecisionState(tuple(boxes), open_bins))


@pytest.mark.parametrize('algorithm', BUILT_IN)
def test_every_algorithm_puts_a_box_only_into_a_bin_of_its_destination(algorithm):
    open_bins = bins('north', 'south')
    for destination, index in (('south', 1), ('north', 0)):
        choice = step(algorithm, [parcel('a', destination)], open_bins, node_limit=500)
        assert choice.candidate.bin_index == index
    models = tuple(engine_of(PAPER).model(target) for target in open_bins)
    problem = Problem(engine_of(PAPER), (parcel('a', 'east'),), models)
    assert find_algorithm(algorithm)(problem) is None


@pytest.mark.parametrize('backend', ['search', 'cp_sat', 'milp'])
@pytest.mark.parametrize('algorithm', ['mpack_lite', 'mpack'])
def test_every_backend_keeps_to_destinations(algorithm, backend):
    boxes = [parcel('a', 'south', 200.0), parcel('b', 'north'), parcel('c', 'south')]
    choice = step(algorithm, boxes, bins('north', 'south'), backend=backend, budget_s=30.0)
    wanted = {'north': 0, 'south': 1}[choice.candidate.placed.box.destination]
    assert choice.candidate.bin_index == wanted


@pytest.mark.parametrize('algorithm', ['first_fit', 'mpack_lite'])
def test_a_box_without_an_open_bin_does_not_block_the_others(algorithm):
    boxes = [parcel('waits', 'east'), parcel('goes', 'south')]
    choice = step(algorithm, boxes, bins('north', 'south'))
    assert isinstance(choice, Choice) and choice.candidate.placed.box.id == 'goes'


def test_when_no_box_has_an_open_bin_the_fullest_is_closed_for_the_first_of_them():
    north, south = bins('north', 'south')
    open_bins = (filled(north, parcel('n', 'north')), filled(south, parcel('s', 'south', 200.0)))
    waiting = [parcel('a', 'east'), parcel('b', 'west')]
    closed = step('first_fit', waiting, open_bins)
    assert closed.id == south.id
    assert next_destination(closed, waiting, open_bins[:1]) == 'east'


def test_an_empty_bin_changes_its_destination_before_a_used_one_is_closed():
    north, south = bins('north', 'south')
    open_bins = (filled(north, parcel('n', 'north')), south)
    assert step('first_fit', [parcel('a', 'east')], open_bins) == south


def test_only_a_bin_that_would_help_is_closed():
    north, south = bins('north', 'south')
    fuller = filled(south, parcel('s', 'south', 300.0))
    open_bins = (filled(north, parcel('n', 'north')), fuller)
    wanted = bin_to_close('fullest', engine_of(PAPER), [parcel('a', 'north')], open_bins)
    assert wanted == open_bins[0]
    assert next_destination(wanted, [parcel('a', 'north')], (fuller,)) == 'north'
    assert next_destination(wanted, [], (fuller,)) == 'north'


def test_a_bin_for_any_destination_takes_all_and_stays_one():
    (pool,) = bins('')
    choice = step('mpack_lite', [parcel('a', 'north'), parcel('b')], (pool,))
    assert isinstance(choice, Choice)
    assert next_destination(pool, [parcel('a', 'north')], ()) == ''


def test_a_box_without_a_destination_does_not_enter_a_dedicated_bin():
    north, pool = bins('north', '')
    used = filled(north, parcel('n', 'north'))
    assert step('mpack_lite', [parcel('a')], (used,)) is None
    assert step('mpack_lite', [parcel('a')], (used, pool)).candidate.bin_index == 1


def test_a_box_that_no_bin_serves_is_passed_over_only_so_often():
    north, south = bins('north', 'south')
    open_bins = (filled(north, parcel('n', 'north')), filled(south, parcel('s', 'south', 200.0)))
    boxes = (parcel('a', 'north'), parcel('b', 'east'), parcel('c', 'west'))
    settings = PolicySettings('mpack_lite', PAPER, options=DecisionOptions(max_passed_over=10))

    def at(*counts):
        state = DecisionState(boxes, open_bins, passed_over=counts)
        return next_step(settings, engine_of(PAPER), state), by_wait(state)

    assert isinstance(at(3, 9, 9)[0], Choice)
    closed, order = at(3, 9, 10)
    assert closed == open_bins[1]
    assert next_destination(closed, order, open_bins[:1]) == 'west'


def test_a_box_for_nowhere_is_rejected_where_every_bin_is_for_somewhere():
    planner = Planner(PolicySettings('first_fit', PAPER), clock=time.monotonic)
    rejected = planner.decide(DecisionState((parcel('a'),), bins('north', 'south')))
    assert isinstance(rejected, RejectStep) and 'no destination' in rejected.decision.reason
    assert isinstance(planner.decide(DecisionState((parcel('a'),), bins('north', ''))), PlaceStep)


def test_nothing_on_the_belt_closes_nothing():
    assert step('first_fit', [], bins('north')) is None
