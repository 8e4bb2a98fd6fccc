"""What is written down of a box comes back, whoever wrote it; what is no box is refused."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pack_msgs_py.box_codec import (
    box_from_data,
    box_from_json,
    box_to_data,
    box_to_json,
    placed_from_json,
    placed_to_json,
    pose_from_json,
    pose_to_json,
)
from pack_msgs_py.checks import InvalidValue
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.values import Box, PlacedBox

FULL = Box(
    'ö "1"', (300.5, 200.25, 100.0), 2.5, (0.1, 0.2, -0.3), 16, 12.5, 'Oslo', (2.0, 1.5, 0.5),
    (('row', '7'),),
)  # fmt: skip
#: As release 0.1 wrote the same box into its ledger, its journal and its list of true boxes.
FULL_BY_0_1 = (
    '{"id": "\\u00f6 \\"1\\"", "size_mm": [300.5, 200.25, 100.0], "weight_kg": 2.5, '
    '"com_offset_mm": [0.1, 0.2, -0.3], "allowed_up": 16, "max_top_load_n": 12.5, '
    '"destination": "Oslo", "size_stddev_mm": [2.0, 1.5, 0.5], "extra": [["row", "7"]]}'
)
PLACED_BY_0_1 = (
    f'{{"box": {FULL_BY_0_1}, "corner_mm": [0, 0, 0], "size_mm": [210, 310, 100], '
    '"orientation": "yxz", "measured_mm": null}'
)

edges = st.floats(1.0, 2000.0)
boxes = st.builds(
    Box,
    id=st.text(st.characters(codec='utf-8', categories=('L', 'N', 'P')), min_size=1, max_size=20),
    size_mm=st.tuples(edges, edges, edges),
    weight_kg=st.floats(0.01, 100.0),
    com_offset_mm=st.tuples(*[st.floats(-0.4, 0.4)] * 3),
    allowed_up=st.integers(1, 63),
    max_top_load_n=st.none() | st.floats(0.0, 1e4),
    destination=st.sampled_from(['', 'north', 'süd']),
    size_stddev_mm=st.tuples(*[st.floats(0.0, 5.0)] * 3),
    yaw_stddev_rad=st.floats(0.0, 0.2),
    extra=st.lists(st.tuples(st.text(max_size=5), st.text(max_size=5)), max_size=2).map(tuple),
)
millimetres = st.integers(0, 2000)


@given(boxes)
def test_every_box_comes_back_with_all_its_columns(box):
    again = box_from_json(box_to_json(box))
    assert again == box
    assert again.extra == box.extra


@given(boxes, st.tuples(*[millimetres] * 3), st.sampled_from(ORIENTATIONS))
def test_every_placed_box_comes_back_as_it_was_planned(box, corner, orientation):
    placed = PlacedBox(box, corner, (300, 200, 100), orientation, (1.0, 2.0, 3.0))
    assert placed_from_json(placed_to_json(placed)) == replace(placed, measured_mm=None)


@given(st.tuples(*[st.floats(-10.0, 10.0)] * 3), st.tuples(*[st.floats(-1.0, 1.0)] * 4))
def test_every_pose_comes_back(position, quaternion):
    pose = Pose(position, quaternion)
    assert pose_from_json(pose_to_json(pose)) == pose


def test_boxes_and_placed_boxes_of_release_0_1_are_read_and_written_with_what_is_new_behind():
    assert box_from_json(FULL_BY_0_1) == FULL
    assert box_from_json(FULL_BY_0_1).extra == FULL.extra
    written = FULL_BY_0_1[:-1] + ', "yaw_stddev_rad": 0.0}'
    assert box_to_json(FULL) == written
    placed = PlacedBox(FULL, (0, 0, 0), (210, 310, 100), 'yxz')
    assert placed_from_json(PLACED_BY_0_1) == placed
    assert placed_to_json(placed) == PLACED_BY_0_1.replace(FULL_BY_0_1, written)


def test_both_forms_of_a_pose_in_release_0_1_are_read():
    pose = Pose((0.1, 0.2, 0.3), (0.0, 0.0, 0.6, 0.8))
    assert pose_from_json('[[0.1, 0.2, 0.3], [0.0, 0.0, 0.6, 0.8]]') == pose
    as_object = '{"position": [0.1, 0.2, 0.3], "quaternion": [0.0, 0.0, 0.6, 0.8]}'
    assert pose_from_json(as_object) == pose
    assert pose_to_json(pose) == as_object


def test_what_is_optional_may_be_missing():
    assert box_from_json('{"id": "a", "size_mm": [3, 2, 1]}') == Box('a', (3.0, 2.0, 1.0))


def changed(**changes):
    return {key: value for key, value in {**box_to_data(FULL), **changes}.items() if value != ...}


@pytest.mark.parametrize(
    ('data', 'words'),
    [
        (changed(id=...), 'lacks id'),
        (changed(fragile=True), 'has fragile, which is not known here'),
        (changed(size_mm=[1.0, 2.0]), 'size_mm is [1.0, 2.0]; it must be three numbers'),
        (changed(size_mm=['a', 2.0, 3.0]), 'box record cannot be used'),
        (changed(size_mm=[300.0, -1.0, 100.0]), 'size y is -1 mm'),
        (changed(weight_kg=float('nan')), 'weight is nan'),
        (changed(weight_kg='heavy'), 'box record cannot be used'),
        (changed(allowed_up=0), 'allowed_up is 0'),
        (changed(extra=[1]), 'box record cannot be used'),
        ([1, 2], 'must be an object'),
    ],
)
def test_what_is_no_box_is_refused_with_the_reason(data, words):
    with pytest.raises(InvalidValue) as error:
        box_from_data(data)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ('changes', 'words'),
    [
        ({'corner_mm': [0, 0]}, 'corner_mm is [0, 0]; it must be three whole numbers'),
        ({'size_mm': [1.5, 2, 3]}, 'size_mm is [1.5, 2, 3]; it must be three whole numbers'),
        ({'orientation': 'xxy'}, 'xxy'),
        ({'box': None}, 'must be an object'),
    ],
)
def test_what_is_no_placed_box_is_refused_with_the_reason(changes, words):
    text = json.dumps({**json.loads(PLACED_BY_0_1), **changes})
    with pytest.raises(InvalidValue) as error:
        placed_from_json(text)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('{"position": [0, 0, 0]', 'is not JSON'),
        ('[[0, 0], [0, 0, 0, 1]]', 'pose position is [0, 0]; it must be three numbers'),
        ('[[0, 0, 0], [0, 0, 1]]', 'pose record cannot be used'),
        ('[[0, 0, 0], [0, 0, NaN, 1]]', 'pose quaternion is nan; it must be finite'),
        ('7', 'must be an object'),
    ],
)
def test_what_is_no_pose_is_refused_with_the_reason(text, words):
    with pytest.raises(InvalidValue) as error:
        pose_from_json(text)
    assert words in str(error.value)
