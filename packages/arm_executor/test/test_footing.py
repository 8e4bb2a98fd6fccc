"""A box that would tip over is refused, although the space that was reserved for it is carried."""

from __future__ import annotations

from dataclasses import replace

from arm_executor.goals.placement_errors import footing_errors
from pack_msgs_py.geometry.footprint import measured_footprint
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.rules import violations
from pack_msgs_py.values import Box, PlacedBox, parse_bin

CELL = replace(PROFILES['cell'], size_sigmas=2.0)
SIGMA = (4.0, 4.0, 4.0)


def placed(name, size, corner, reserved, measured=None, orientation='xyz'):
    box = Box(name, size, 3.0, size_stddev_mm=SIGMA)
    return PlacedBox(box, corner, reserved, orientation, measured)


# As met in physics, sigma 4 mm: the third corner stood on a strip of 10 mm that was not there.
STRIP = placed('strip', (596.1, 193.5, 198.9), (0, 350, 0), (610, 210, 199), (305.0, 455.8, 100.0))
SIDE = placed(
    'side', (443.8, 353.5, 200.2), (780, 0, 0), (370, 460, 201), (963.3, 230.0, 100.0), 'yxz'
)
TIPS = placed('tips', (454.3, 314.4, 92.7), (550, 30, 201), (470, 330, 93))


def test_a_box_on_a_strip_of_reserved_air_tips_over():
    by_plan = replace(CELL, stability_margin_mm=None)
    assert list(violations(TIPS, [STRIP, SIDE], parse_bin('LDC'), by_plan)) == []
    [error] = footing_errors(TIPS, [STRIP, SIDE], CELL)
    assert "'tips' would tip over on 'side'" in error


def test_a_box_on_more_than_that_stands():
    farther = replace(TIPS, corner_mm=(550, 60, 201))
    assert footing_errors(farther, [STRIP, SIDE], CELL) == []
    assert footing_errors(replace(TIPS, corner_mm=(550, 30, 0)), [], CELL) == []


def test_where_a_box_was_measured_counts_and_not_where_it_was_planned():
    assert measured_footprint(STRIP)[1] > 358.0 > measured_footprint(TIPS)[3]
    moved = replace(STRIP, measured_mm=(305.0, 425.8, 100.0))
    assert footing_errors(TIPS, [moved, SIDE], CELL) == []


def test_a_box_does_not_stand_on_tops_that_turned_out_lower():
    # As met in physics: one of two equal tops was 5 mm lower, and the box leant over to it.
    lower = placed(
        'low', (395.9, 296.7, 150.0), (0, 0, 478), (410, 310, 150), (204.6, 153.9, 546.0)
    )
    higher = placed(
        'high', (302.1, 220.1, 267.7), (0, 410, 360), (320, 230, 268), (160.2, 524.6, 492.5)
    )
    posts = [
        placed('a', (395.9, 296.7, 478.0), (0, 0, 0), (410, 310, 478), (204.6, 153.9, 239.0)),
        placed('b', (302.1, 220.1, 360.0), (0, 410, 0), (320, 230, 360), (160.2, 524.6, 180.0)),
    ]
    leans = placed('leans', (308.6, 308.6, 151.6), (0, 200, 628), (320, 320, 152))
    assert len(footing_errors(leans, [*posts, lower, higher], CELL)) == 1
    level = replace(lower, measured_mm=(204.6, 153.9, 551.0))
    assert footing_errors(leans, [*posts, level, higher], CELL) == []


def test_a_narrow_box_does_not_stand_on_tops_that_a_wide_one_would_stand_on():
    # As found by benchmarks/tipping.py: tops 3.5 mm apart, and the narrow box leant by 5 degrees.
    dense = replace(PROFILES['dense'], size_sigmas=2.0)
    low = placed(
        'low', (549.0, 70.0, 141.0), (40, 0, 0), (560, 80, 141), (319.3, 37.0, 69.0), 'xyz'
    )
    high = placed(
        'high', (150.0, 442.0, 141.0), (310, 80, 0), (160, 450, 141), (393.0, 306.0, 72.5)
    )
    narrow = placed('narrow', (561.0, 120.0, 68.0), (0, 0, 141), (580, 130, 68))
    [error] = footing_errors(narrow, [low, high], dense)
    assert "would tip over on 'high'" in error
    level = replace(high, measured_mm=(393.0, 306.0, 70.5))
    assert footing_errors(narrow, [low, level], dense) == []


def test_rules_that_know_no_centre_of_mass_ask_for_nothing():
    assert footing_errors(TIPS, [STRIP, SIDE], PROFILES['paper']) == []


def test_a_box_does_not_stand_on_the_free_corner_of_a_lighter_one():
    """Each of the two rests well by itself; what they stand on is followed down to the floor."""
    posts = [
        placed('a', (100.0, 300.0, 100.0), (0, 0, 0), (100, 300, 100)),
        placed('b', (200.0, 100.0, 100.0), (100, 0, 0), (200, 100, 100)),
    ]
    light = placed('light', (300.0, 300.0, 100.0), (0, 0, 100), (300, 300, 100))
    heavy = placed('heavy', (100.0, 100.0, 100.0), (200, 200, 200), (100, 100, 100))
    assert footing_errors(light, posts, CELL) == []
    [error] = footing_errors(heavy, [*posts, light], CELL)
    assert "'heavy' would tip over on 'light'" in error
