"""The work order of a bin: layers from the floor up, and pictures that fit the bin."""

import re
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_folders import ROW, stacked, write_folder

from pack_cell.report_page.run_folder import InBin, RunBox, read_run
from pack_cell.report_page.work_order import layers_of, packing_layers, packing_steps
from pack_msgs_py.orientation import ORIENTATIONS, way_up


def placed(step, corner, size):
    return InBin(step, RunBox(str(step), 'placed'), corner, size, corner)


def test_what_stands_on_the_floor_is_layer_1_and_what_lies_on_it_2(tmp_path):
    [first, _] = read_run(write_folder(tmp_path, stacked(20))).bins
    steps = packing_steps(first)
    assert [step.layer for step in steps] == [1] * 4 + [2] * 4 + [3] * 4 + [4] * 4
    layers = packing_layers(first, steps)
    assert [layer.steps for layer in layers] == [
        (1, 2, 3, 4), (5, 6, 7, 8), (9, 10, 11, 12), (13, 14, 15, 16),
    ]  # fmt: skip


def test_a_bridge_is_above_the_higher_of_its_piers():
    boxes = [
        placed(1, (0, 0, 0), (200, 200, 100)),
        placed(2, (0, 0, 100), (200, 200, 100)),
        placed(3, (300, 0, 0), (200, 200, 195)),
        placed(4, (0, 0, 200), (500, 200, 100)),
        placed(5, (600, 0, 0), (200, 200, 300)),
    ]
    assert layers_of(boxes) == [1, 2, 1, 3, 1]


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3), st.integers(1, 2)), max_size=25))
def test_a_box_is_in_a_higher_layer_than_all_that_it_stands_on(columns):
    heights = dict.fromkeys(product(range(5), range(4)), 0)
    boxes = []
    for step, (x, y, wide) in enumerate(columns, start=1):
        under = [(x + n, y) for n in range(wide)]
        z = max(heights[cell] for cell in under)
        boxes.append(placed(step, (100 * x, 100 * y, z), (100 * wide, 100, 60)))
        heights.update(dict.fromkeys(under, z + 60))
    layers = layers_of(boxes)
    for at, box in enumerate(boxes):
        z = box.corner_mm[2]
        assert layers[at] == 1 + z // 60


def test_every_way_that_a_box_may_lie_has_words_of_its_own():
    assert len({way_up(orientation) for orientation in ORIENTATIONS}) == 6
    assert way_up('xyz') == 'upright'


@pytest.mark.parametrize(('kind', 'corner'), [('LDC', 'bottom left'), ('RC', 'top right')])
def test_a_picture_shows_the_side_that_one_packs_from_at_the_bottom(tmp_path, kind, corner):
    row = ROW | {'bin_type': kind}
    [of_run] = read_run(write_folder(tmp_path, [row], bin=kind)).bins
    [layer] = packing_layers(of_run, packing_steps(of_run))
    x, y = map(float, re.search(r'class="box" x="([\d.]+)" y="([\d.]+)"', layer.picture).groups())
    assert corner == ('top right' if (x > 100 and y == 0) else 'bottom left' if x == 0 else '')
    assert layer.picture.count('>1</text>') == 1
