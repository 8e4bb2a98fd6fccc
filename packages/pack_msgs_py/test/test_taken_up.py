"""What a measured box takes up beside what was reserved for it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from pack_msgs_py.geometry.taken_up import taken_up
from pack_msgs_py.profiles import PROFILES, planned_size
from pack_msgs_py.rules import violations
from pack_msgs_py.validator import validate_sequence
from pack_msgs_py.values import Box, PlacedBox, parse_bin

LDC, DENSE = parse_bin('LDC'), PROFILES['dense']


def placed(box_id, corner, orientation='xyz'):
    box = Box(box_id, (300.0, 200.0, 150.0))
    return PlacedBox(box, corner, planned_size(box, orientation, DENSE), orientation)


def measured(one, off_x, off_y):
    (x, y, z), (dx, dy, dz) = one.corner_mm, one.size_mm
    return replace(one, measured_mm=(x + dx / 2 + off_x, y + dy / 2 + off_y, z + dz / 2))


@pytest.mark.parametrize(
    ('off', 'corner', 'far'),
    [
        ((0.0, 0.0), (100, 100), (410, 310)),
        ((6.5, -6.5), (100, 100), (410, 310)),
        ((-8.4, 8.1), (90, 100), (410, 320)),
        ((-150.0, 0.0), (0, 100), (410, 310)),
    ],
)
def test_a_place_grows_on_the_grid_by_what_sticks_out_of_it(off, corner, far):
    one = placed('a', (100, 100, 0))
    (known,) = taken_up([measured(one, *off)], LDC, 10)
    assert known.corner_mm[:2] == corner
    assert known.far_mm[:2] == far
    assert known.top_mm == one.top_mm


def test_what_was_not_measured_keeps_its_place():
    one = placed('a', (100, 100, 0))
    assert taken_up([one], LDC, 10)[0] is one


def test_a_neighbour_that_was_there_before_breaks_no_rule_since():
    """A knock moves a box into the place of one that came before it: that was right then."""
    first, second = placed('a', (0, 0, 0)), placed('b', (310, 0, 0))
    knocked = measured(first, 12.0, 0.0)
    assert list(violations(second, taken_up([knocked], LDC, 10), LDC, DENSE))
    assert validate_sequence([knocked, second], LDC, DENSE) == []


def test_a_box_on_the_strip_that_another_sticks_out_by_breaks_no_rule():
    base = PlacedBox(Box('a', (300.0, 200.0, 150.0)), (0, 0, 0), (310, 210, 150), 'xyz')
    level = replace(base, box=replace(base.box, id='b'), corner_mm=(320, 0, 0))
    wide = Box('c', (300.0, 200.0, 100.0))
    across = PlacedBox(wide, (310, 0, 150), planned_size(wide, 'xyz', DENSE), 'xyz')
    assert validate_sequence([measured(base, 9.0, 0.0), level, across], LDC, DENSE) == []
