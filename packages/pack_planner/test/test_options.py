"""Sorting, box selection, closing and weights: what each option changes."""

from __future__ import annotations

import pytest
from planner_cases import SMALL

from pack_msgs_py.codes import Reason
from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Bin, BinSpec, Box, PlacedBox, parse_bin
from pack_planner.algorithms import Problem, find_algorithm
from pack_planner.algorithms.opack import sorted_boxes
from pack_planner.decision.bin_closing import bin_to_close
from pack_planner.decision.options import DecisionOptions
from pack_planner.decision.planner import CloseStep, PlaceStep, Planner, RejectStep
from pack_planner.decision.policy import DecisionState, PolicySettings, next_step
from pack_planner.decision.weights import parse_weights
from pack_planner.engine import Engine, Weights, Zone
from pack_planner.engine.contact import touches
from pack_planner.parameters import PlannerParameters, settings


def block(height, name='block', size=(600, 400)):
    true = (float(size[0]), float(size[1]), float(height))
    return PlacedBox(Box(name, true), (0, 0, 0), (*size, height))


SMALL_BOX, MIDDLE, LARGE = (
    Box(name, (edge, edge, edge))
    for name, edge in (('small', 100.0), ('middle', 150.0), ('large', 200.0))
)


@pytest.mark.parametrize(('rule', 'expected'), [
    ('volume', ['cube', 'flat', 'tower', 'stick']),
    ('area', ['flat', 'cube', 'tower', 'stick']),
    ('height', ['tower', 'cube', 'stick', 'flat']),
    ('arrival', ['stick', 'tower', 'flat', 'cube']),
])  # fmt: skip
def test_sort_rules(rule, expected):
    boxes = [
        Box('stick', (50, 50, 200)),
        Box('tower', (100, 100, 400)),
        Box('flat', (400, 300, 50)),
        Box('cube', (200, 200, 200)),
    ]
    assert [box.id for box in sorted_boxes(boxes, rule)] == expected


def test_equal_volumes_go_by_height_and_equal_heights_by_area():
    flat, tall = Box('flat', (200, 200, 100)), Box('tall', (200, 100, 200))
    assert [b.id for b in sorted_boxes([flat, tall], 'volume')] == ['tall', 'flat']
    wide, slim = Box('wide', (300, 200, 100)), Box('slim', (100, 100, 100))
    assert [b.id for b in sorted_boxes([slim, wide], 'height')] == ['wide', 'slim']


def selected(engine, rule, boxes, *bins, algorithm='mpack_lite', **more):
    models = tuple(engine.model(target) for target in bins or (Bin('b', 1, SMALL),))
    problem = Problem(engine, tuple(boxes), models, selection=rule, **more)
    return find_algorithm(algorithm)(problem).candidate.placed.box.id


@pytest.mark.parametrize('algorithm', ['mpack_lite', 'o_first_fit', 'o_best_fit', 'mpack'])
@pytest.mark.parametrize(('rule', 'expected'), [('largest', 'large'), ('nearest', 'middle')])
def test_the_largest_or_the_nearest_box_is_taken(paper, algorithm, rule, expected):
    boxes = [MIDDLE, SMALL_BOX, LARGE]
    target = Bin('b', 1, SMALL, (block(50, size=(400, 400)),))
    assert selected(paper, rule, boxes, target, algorithm=algorithm) == expected


def test_nearest_takes_the_next_box_when_the_first_fits_nowhere(paper):
    low_room = Bin('b', 1, SMALL, (block(220),))
    assert selected(paper, 'nearest', [LARGE, MIDDLE, SMALL_BOX], low_room) == 'middle'


@pytest.mark.parametrize(('height', 'limit', 'expected'), [
    (100, 0.5, 'large'), (200, 0.5, 'small'), (200, 0.6, 'large'), (100, 0.2, 'small'),
])  # fmt: skip
def test_large_boxes_first_and_small_ones_once_the_bin_is_full(paper, height, limit, expected):
    target = Bin('b', 1, SMALL, (block(height),))
    boxes = [MIDDLE, SMALL_BOX, LARGE]
    assert selected(paper, 'large_when_empty', boxes, target, large_until=limit) == expected


@pytest.mark.parametrize(('rule', 'algorithm', 'expected'), [
    ('least_growth', 'mpack_lite', 'a'), ('least_growth', 'mpack', 'a'),
    ('least_increase', 'mpack_lite', 'b'), ('least_increase', 'mpack', 'b'),
    ('auto', 'mpack_lite', 'b'), ('auto', 'o_first_fit', 'b'), ('auto', 'mpack', 'a'),
])  # fmt: skip
def test_least_growth_takes_what_stays_within_the_boxes_that_are_there(
    paper, rule, algorithm, expected
):
    wall = PlacedBox(Box('wall', (200.0, 400.0, 100.0)), (400, 0, 0), (200, 400, 100))
    begun = Bin('old', 1, SMALL, (block(250, 'tower', (100, 400)), wall))
    # a stands between both, x + top is 34 cm; b only fits into the new bin, 31 cm high
    boxes = [Box('a', (240.0, 240.0, 240.0)), Box('b', (310.0, 310.0, 310.0))]
    new = Bin('new', 2, SMALL)
    assert selected(paper, rule, boxes, begun, new, algorithm=algorithm) == expected


@pytest.mark.parametrize('algorithm', ['mpack_lite', 'mpack'])
def test_of_boxes_that_grow_a_bin_equally_least_growth_takes_the_largest(paper, algorithm):
    # all three stay within what the towers and the plate take up
    target = Bin('b', 1, SMALL, (
        block(300, 'tower', (100, 200)),
        PlacedBox(Box('other', (100.0, 200.0, 300.0)), (0, 200, 0), (100, 200, 300)),
        PlacedBox(Box('plate', (100.0, 400.0, 10.0)), (500, 0, 0), (100, 400, 10)),
    ))  # fmt: skip
    boxes = [MIDDLE, LARGE, SMALL_BOX]
    options = {'algorithm': algorithm, 'sort': 'arrival'}
    assert selected(paper, 'least_growth', boxes, target, **options) == 'large'
    assert selected(paper, 'least_increase', boxes, target, **options) != 'large'


def test_large_when_empty_looks_at_the_oldest_bin_that_takes_a_box(paper):
    full = Bin('old', 1, SMALL, (block(280),))
    assert selected(paper, 'large_when_empty', [LARGE, SMALL_BOX], full, Bin('n', 2, SMALL)) == (
        'small'
    )


def test_a_box_that_would_stand_on_a_virtual_one_is_never_selected(paper):
    # the largest goes first by the rule `height`: the plate can only lie across it later
    tower, plate = Box('tower', (300, 400, 300)), Box('plate', (600, 400, 80))
    half = PlacedBox(Box('half', (300.0, 400.0, 300.0)), (0, 0, 0), (300, 400, 300))
    target = Bin('b', 1, SMALL, (half,))
    options = {'sort': 'height', 'algorithm': 'mpack_lite'}
    assert selected(paper, 'nearest', [plate, tower], target, **options) == 'tower'


CLOSE_ME = {
    # 76 % full, 300 mm of room above half of it
    'fullest': Bin('fullest', 2, SMALL, (
        block(280, 'f'),
        PlacedBox(Box('g', (200.0, 400.0, 60.0)), (0, 0, 280), (200, 400, 60)),
    )),
    'oldest': Bin('oldest', 1, SMALL, (block(260, 'o'),)),
    # between its teeth there is room for nothing that came so far
    'least_useful': Bin('least_useful', 3, SMALL, (
        block(150, 'l'),
        *(PlacedBox(Box(f'p{x}', (100.0, 400.0, 200.0)), (x, 0, 150), (100, 400, 200))
          for x in (50, 200, 350, 500)),
    )),
}  # fmt: skip


@pytest.mark.parametrize('rule', CLOSE_ME)
def test_closing_rules(paper, rule):
    bins = (*CLOSE_ME.values(), Bin('empty', 4, SMALL))
    assert bin_to_close(rule, paper, [LARGE], bins) == CLOSE_ME[rule]
    planner = Planner(
        PolicySettings('mpack_lite', PROFILES['paper'], options=DecisionOptions(closing=rule)),
        float,
    )
    step = planner.decide(DecisionState((LARGE,), tuple(CLOSE_ME.values())))
    assert isinstance(step, CloseStep)
    assert (step.target, step.destination) == (CLOSE_ME[rule], '')


@pytest.mark.parametrize('rule', CLOSE_ME)
def test_no_empty_bin_is_closed_nor_one_for_boxes_bound_elsewhere(paper, rule):
    other = Bin('other', 1, SMALL, (block(380),), destination='Rome')
    target = Bin('target', 2, SMALL, (block(350),))
    assert bin_to_close(rule, paper, [LARGE], (other, target, Bin('e', 3, SMALL))) == target
    assert bin_to_close(rule, paper, [LARGE], (other,)) is None


def test_weights_for_all_and_for_single_kinds_of_bins():
    table = parse_weights('1,2,50 RC:2,1,100 100x60x60:3,1,9')
    assert table.of(parse_bin('LDC')) == Weights(1, 2, 50)
    assert table.of(parse_bin('RC')) == Weights(2, 1, 100)
    assert table.of(parse_bin('100x60x60')) == Weights(3, 1, 9)
    assert parse_weights('RC:2,1,100').of(parse_bin('SYN')) == Weights(1, 1, 100)
    pallet = '120x80x150:pallet'
    assert parse_weights(f'{pallet}:2,1,9').of(parse_bin(pallet)) == Weights(2, 1, 9)


@pytest.mark.parametrize(('text', 'said'), [
    ('', 'empty'), ('1,2', 'not w1,w2,w3'), ('1,2,x', "'1,2,x'"), ('1,nan,100', 'w2 is nan'),
    ('1,1,inf', 'w3 is inf'), ('-1,1,100', 'w1 is -1'), ('1e7,1,100', 'w1 is 10000000'),
    ('BOX:1,1,100', 'unknown bin'), ('1,1,100 2,1,100', 'twice'), ('RC:1,1,1 rc:1,1,1', 'RC bins'),
])  # fmt: skip
def test_weights_that_make_no_sense_are_refused_with_the_reason(text, said):
    with pytest.raises(ValueError, match=r'weight|bin') as error:
        parse_weights(text)
    assert said in str(error.value)


def test_the_weights_of_the_bins_kind_decide():
    spec = BinSpec('LDC', (600, 400, 400))
    target = Bin('b', 1, spec, (PlacedBox(Box('s', (200.0, 400.0, 250.0)), (0, 0, 0),
                                          (200, 400, 250)),))  # fmt: skip
    box = Box('new', (100.0, 100.0, 100.0))
    corners = {}
    for text in ('1,1,100', 'LDC:1,0,100', 'RC:1,0,100'):
        planner = Planner(
            PolicySettings('mpack_lite', PROFILES['paper'], parse_weights(text)), float
        )
        outcome = planner.decide(DecisionState((box,), (target,)))
        assert isinstance(outcome, PlaceStep)
        corners[text] = outcome.decision.corner_mm
    assert corners['1,1,100'] == corners['RC:1,0,100'] != corners['LDC:1,0,100'] == (0, 0, 250)


@pytest.mark.parametrize('bad', [
    {'sort': 'colour'}, {'selection': 'best'}, {'closing': 'newest'}, {'large_until': 1.5},
    {'large_until': float('nan')}, {'max_passed_over': -1}, {'max_passed_over': 10**9},
])  # fmt: skip
def test_options_that_make_no_sense_are_refused_with_the_reason(bad):
    ((name, value),) = bad.items()
    with pytest.raises(ValueError, match=name) as error:
        DecisionOptions(**bad)
    assert str(value) in str(error.value)


def test_without_contact_anywhere_a_box_is_placed_all_the_same():
    """The arm refused what touches: in an empty bin the constraints give way, nothing stops."""
    empty, box = Bin('b', 1, BinSpec('45x45x40', (450, 450, 400))), Box('new', (150.0,) * 3)
    corners = [(x, y, 0) for x in (0, 300) for y in (0, 300)]
    zones = tuple(Zone(turn, corner) for corner in corners for turn in ORIENTATIONS)
    settings = PolicySettings('mpack_lite', PROFILES['paper'], options=DecisionOptions(cep=True))
    state = DecisionState((box,), (empty,), lambda _box, _bin: zones)
    step = next_step(settings, Engine(PROFILES['paper']), state)
    corner = step.candidate.placed.corner_mm
    assert not all(touches(step.candidate.placed, (), empty.spec.size_mm, 10)), corner


@pytest.mark.parametrize(
    ('payload', 'outcome'),
    [(0.0, PlaceStep), (32.0, PlaceStep), (12.0, PlaceStep), (9.5, RejectStep)],
)
def test_box_heavier_than_this_robot_lifts_is_rejected_at_once(payload, outcome):
    box = Box('heavy', (300.0, 200.0, 200.0), 12.0)
    planner = Planner(settings(PlannerParameters(max_payload_kg=payload)), float)
    step = planner.decide(DecisionState((box,), (Bin('b', 1, parse_bin('EQ')),)))
    assert isinstance(step, outcome)
    assert outcome is PlaceStep or step.decision.reject_reason is Reason.OVERWEIGHT
