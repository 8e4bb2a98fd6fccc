"""Streams by name: recipes, containers, earlier runs, lotteries; destinations."""

import json
import math
import random

import pytest

from conveyor_sim.streams import (
    BOXES_FILE,
    BoxFileError,
    RejectedRow,
    Stream,
    load_boxes,
    read_entries,
    write_boxes,
)
from conveyor_sim.streams.mpv import boxes_of_class
from conveyor_sim.streams.syn import LEAST_PIECES, cut
from pack_msgs_py.codes import Reason
from pack_msgs_py.values import UP_ANY, UP_NEG_Z, UP_POS_Z, Box, parse_bin

BR = """ 2
 1 2502505
 587 233 220
 2
 1 108 0 76 0 30 1 3
 2 110 1 43 1 25 1 2
 2 2502605
 587 233 220
 1
 1 91 0 54 0 45 1 4
"""


@pytest.fixture
def br(tmp_path):
    path = tmp_path / 'BR1.txt'
    path.write_text(BR)
    return path


# SYN


@pytest.mark.parametrize('pieces', [2, LEAST_PIECES, 23, 37])
def test_a_cut_bin_is_filled_exactly_by_boxes_that_obey_the_cutting_rule(pieces):
    for seed in range(20):
        cut_up = cut((80, 45, 45), pieces, random.Random(seed))
        assert sum(x * y * z for x, y, z in cut_up) == 80 * 45 * 45
        assert len(cut_up) >= pieces
        assert all(5 <= edge <= 45 for piece in cut_up for edge in piece)
        if pieces >= LEAST_PIECES:
            assert len(cut_up) == pieces


def test_a_bin_that_cannot_be_cut_so_often_is_refused():
    with pytest.raises(ValueError, match=r'8x8x8 cm cannot be cut into 3 boxes'):
        cut((8, 8, 8), 3, random.Random(1))


def test_each_round_of_syn_is_ten_bins_cut_anew():
    stream = Stream.open('syn:seed=3', count=460)
    rounds = [[stream[n] for n in range(first, first + 230)] for first in (0, 230)]
    for boxes in rounds:
        assert sum(box.volume_mm3 for box in boxes) == 10 * parse_bin('SYN').volume_mm3
    assert [box.size_mm for box in rounds[0]] != [box.size_mm for box in rounds[1]]


# Martello, Pisinger and Vigo


@pytest.mark.parametrize(
    ('number', 'short', 'long'), [(1, 0, (1, 2)), (2, 1, (0, 2)), (3, 2, (0, 1))]
)
def test_classes_1_to_3_are_mostly_short_along_one_axis_and_long_along_the_others(
    number, short, long
):
    boxes = boxes_of_class(number, 2000, 1.0, random.Random(1))
    own = [b for b in boxes if b[short] <= 50 and all(3 * b[axis] >= 200 for axis in long)]
    assert 0.55 < len(own) / len(boxes) < 0.65
    assert all(1 <= edge <= 100 for box in boxes for edge in box)


@pytest.mark.parametrize(('number', 'low', 'high'), [(4, 50, 100), (5, 1, 50)])
def test_class_4_is_mostly_large_and_class_5_small(number, low, high):
    boxes = boxes_of_class(number, 2000, 1.0, random.Random(1))
    own = [box for box in boxes if all(low <= edge <= high for edge in box)]
    assert 0.55 < len(own) / len(boxes) < 0.65


@pytest.mark.parametrize(('number', 'longest'), [(6, 10), (7, 35), (8, 100)])
def test_classes_6_to_8_are_uniform(number, longest):
    edges = [e for box in boxes_of_class(number, 3000, 1.0, random.Random(2)) for e in box]
    assert (min(edges), max(edges)) == (1, longest)
    assert math.isclose(sum(edges) / len(edges), (1 + longest) / 2, rel_tol=0.03)


@pytest.mark.parametrize('count', [3, 15, 17, 50, 200])
def test_class_9_fills_three_bins_exactly(count):
    boxes = boxes_of_class(9, count, 1.0, random.Random(count))
    assert len(boxes) == count
    assert sum(math.prod(box) for box in boxes) == 3 * 100**3
    assert min(min(box) for box in boxes) >= 1


def test_the_edge_of_the_bin_sets_the_scale():
    small, large = (load_boxes(f'mpv:class=7,seed=2,edge={edge}')[0] for edge in (400, 800))
    assert max(max(box.size_mm) for box in small) <= 350
    assert [tuple(2 * e for e in box.size_mm) for box in small] == [b.size_mm for b in large]


# Bischoff and Ratcliff


def test_a_container_problem_gives_its_boxes_with_their_uprights(br):
    boxes, rejected = load_boxes(f'br:{br}#1')
    assert rejected == []
    assert [box.id for box in boxes] == [f'BR1-1-1-{n}' for n in (1, 2, 3)] + [
        'BR1-1-2-1', 'BR1-1-2-2'
    ]  # fmt: skip
    assert boxes[0].size_mm == (1080.0, 760.0, 300.0)
    assert (boxes[0].allowed_up, boxes[3].allowed_up) == (UP_POS_Z | UP_NEG_Z, UP_ANY)
    (small, *_), _ = load_boxes(f'br:{br}#2,scale=0.25')
    assert small.size_mm == (227.5, 135.0, 112.5)


def test_container_problems_without_seeds_are_read_the_same(br, tmp_path):
    seedless = tmp_path / 'BR1' / 'BR1.txt'
    seedless.parent.mkdir()
    seedless.write_text(BR.replace(' 2502505', '').replace(' 2502605', ''))
    for problem in (1, 2):
        assert load_boxes(f'br:{seedless}#{problem}') == load_boxes(f'br:{br}#{problem}')


def test_a_container_file_that_is_given_as_a_list_says_how_to_name_a_problem(br):
    with pytest.raises(BoxFileError, match='thpack file: name a problem of it'):
        load_boxes(br)


@pytest.mark.parametrize(
    ('content', 'problem', 'words'),
    [
        (BR, 3, 'problems 1 to 2, not 3'),
        (BR, 0, 'problems 1 to 2, not 0'),
        (BR[:60], 1, 'ends within a problem'),
        (BR.replace('108', 'abc'), 1, "line 5: 'abc'"),
        (BR.replace('108 0', '108 7'), 1, 'each with 0 or 1'),
        (BR.replace('\n 2\n 1 108', '\n 0\n 1 108'), 1, '0 types'),
        ('', 1, 'ends within a problem'),
        (f'{BR}7\n', 1, 'more than 2 problems'),
        (BR.replace(' 1 2502505', ' 3 2502505'), 1, 'line 2: problem 1 is expected, 3 is there'),
    ],
)
def test_a_damaged_container_file_gives_one_clear_error(br, content, problem, words):
    br.write_text(content)
    with pytest.raises(BoxFileError, match=words):
        load_boxes(f'br:{br}#{problem}')


# earlier runs


def test_a_run_is_replayed_with_its_true_boxes_in_the_order_of_the_feed(tmp_path):
    boxes = [
        Box('b, "2"', (300.25, 200.0, 100.0), 1.5, allowed_up=16, max_top_load_n=0.0),
        Box('a', (100.0, 90.1, 80.0), 0.3, destination='D2'),
    ]
    bad = RejectedRow('c', 'x.csv', 3, 'id', '', Reason.INVALID_DATA, 'bad')
    write_boxes(tmp_path / BOXES_FILE, [boxes[0], bad, boxes[1]])
    assert load_boxes(f'run:{tmp_path}') == (boxes, [])


def test_a_run_without_its_boxes_is_replayed_from_its_placements(tmp_path):
    rows = [
        {'box_id': 'a', 'size_mm': [300, 200, 100], 'weight_kg': 2.5},
        {'box_id': 'unread', 'size_mm': None, 'weight_kg': None},
    ]
    (tmp_path / 'placements.jsonl').write_text('\n'.join([*map(json.dumps, rows), '{"x": ']) + '\n')
    boxes, (bad,) = load_boxes(f'run:{tmp_path}')
    assert boxes == [Box('a', (300.0, 200.0, 100.0), 2.5)]
    assert 'placements.jsonl, line 3' in bad.text
    with pytest.raises(BoxFileError, match='no folder of a run'):
        load_boxes(f'run:{tmp_path / "nothing"}')


# choosing


@pytest.mark.parametrize(
    ('choice', 'words'),
    [
        ('mpv', 'class=0 is not a whole number from 1 to 9'),
        ('mpv:class=10', '1 to 9'),
        ('mpv:class=4,class=5', 'class=5'),
        ('mpv:class=4,edge=nan', 'edge=nan'),
        ('mpv:class=4,colour=red', "'colour=red' is not one of"),
        ('syn:boxes=1', 'from 8 to 100'),
        ('syn:seed=-1', 'seed=-1'),
        ('br:BR1.txt', 'which problem'),
        ('br:BR1.txt#x', 'which problem'),
        ('cartons:3', 'no options'),
        ('draw:nothing.csv', 'No such file'),
        ('nothing.csv', 'No such file'),
    ],
)
def test_a_choice_that_cannot_be_used_is_refused_with_the_reason(choice, words):
    with pytest.raises(BoxFileError, match=words):
        Stream.open(choice)


@pytest.mark.parametrize(
    'choice', ['cartons', 'syn', 'mpv:class=9,boxes=15', 'draw:cartons', 'draw:syn:seed=4', 'br']
)
def test_every_stream_goes_on_as_long_as_asked_and_can_be_replayed(choice, br):
    choice = f'br:{br}#1' if choice == 'br' else choice
    stream, again = (Stream.open(choice, count=700, seed=5) for _ in range(2))
    boxes = list(stream)
    assert len({box.id for box in boxes}) == 700
    assert all(box.id in stream for box in boxes)
    assert 'stranger' not in stream and f'{boxes[0].id}#99999' not in stream
    assert stream.fingerprint == again.fingerprint
    assert [again[n] for n in (699, 0, 350)] == [boxes[n] for n in (699, 0, 350)]
    other = Stream.open(choice, count=700, seed=6)
    if 'seed=4' not in choice:
        assert other.fingerprint != stream.fingerprint
    assert list(other) != boxes


def test_boxes_are_drawn_with_replacement(tmp_path):
    drawn = [box.id.rpartition('#')[0] for box in Stream.open('draw:cartons', count=40, seed=1)]
    assert set(drawn) < {entry.id for entry in read_entries()}
    assert len(set(drawn)) < 40


def test_destinations_are_given_to_boxes_that_have_none_the_same_way_each_time():
    rows = (Box('a', (3, 2, 1), destination='Oslo'), *(Box(f'b{n}', (3, 2, 1)) for n in range(60)))
    stream = Stream(rows, seed=2, destinations=3)
    bound_for = {box.id: box.destination for box in stream}
    assert bound_for.pop('a') == 'Oslo'
    assert set(bound_for.values()) == {'D1', 'D2', 'D3'}
    assert list(stream) == list(Stream(rows, seed=2, destinations=3))
    assert {box.destination for box in Stream(rows[1:])} == {''}
