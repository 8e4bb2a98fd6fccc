"""Each packing rule, on a case that keeps it and a case that breaks it."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pack_msgs_py.geometry.polygon import hull_distance
from pack_msgs_py.geometry.pose import rotated
from pack_msgs_py.orientation import ORIENTATIONS, QUATERNIONS, oriented_size
from pack_msgs_py.profiles import PROFILES, Profile, find_profile, planned_size
from pack_msgs_py.rules import GRAVITY, Rule, centre_of_mass, top_loads, violations
from pack_msgs_py.validator import validate_bins, validate_sequence
from pack_msgs_py.values import UP_POS_Z, Bin, Box, PlacedBox, parse_bin

EQ = parse_bin('EQ')
PAPER = PROFILES['paper']
ANY = PAPER
LAB = replace(PAPER, orientations='largest_not_vertical')


def put(box_id, corner, size, **box):
    """A box of exactly ``size`` at ``corner``, as it lies."""
    return PlacedBox(Box(box_id, size, **box), corner, size)


def broken(placed, others=(), profile=ANY, spec=EQ):
    """Names of the rules that ``placed`` breaks."""
    return {v.rule for v in violations(placed, others, spec, profile)}


def test_a_box_on_the_floor_of_an_empty_bin_breaks_nothing():
    assert broken(put('a', (0, 0, 0), (300, 200, 100)), profile=PAPER) == set()


@pytest.mark.parametrize('corner', [(-10, 0, 0), (510, 0, 0), (0, 610, 0), (0, 0, 710)])
def test_a_box_must_be_inside_the_bin(corner):
    assert Rule.INSIDE_BIN in broken(put('a', corner, (300, 200, 100)))


def test_positions_lie_on_the_grid():
    assert broken(put('a', (5, 0, 0), (300, 200, 100))) == {Rule.ON_GRID}


def test_the_reserved_size_is_the_rounded_size():
    placed = PlacedBox(Box('a', (295, 195, 95)), (0, 0, 0), (290, 200, 100))
    assert broken(placed) == {Rule.PLANNED_SIZE}


def test_two_boxes_share_no_space():
    low = put('a', (0, 0, 0), (300, 200, 100))
    assert Rule.NO_OVERLAP in broken(put('b', (290, 0, 0), (300, 200, 100)), [low])
    assert broken(put('b', (300, 0, 0), (300, 200, 100)), [low]) == set()


def test_nothing_may_stand_over_the_place_of_a_box():
    roof = [
        put('l', (0, 0, 0), (100, 400, 200)),
        put('r', (300, 0, 0), (100, 400, 200)),
        put('roof', (0, 0, 200), (400, 400, 100)),
    ]
    assert validate_sequence(roof, EQ, ANY) == []
    assert Rule.ACCESS_FROM_ABOVE in broken(put('b', (100, 0, 0), (200, 400, 100)), roof)


def test_three_supported_vertices_are_enough_and_two_are_not():
    ell = [put('a', (0, 0, 0), (400, 200, 100)), put('b', (0, 200, 0), (200, 200, 100))]
    on_three = put('c', (0, 0, 100), (400, 400, 100))
    assert broken(on_three, ell) == set()
    assert broken(on_three, ell[:1]) == {Rule.SUPPORT}


def test_touching_an_edge_is_no_support():
    table = [put('a', (0, 0, 0), (200, 200, 100))]
    assert broken(put('c', (200, 0, 100), (200, 200, 100)), table) == {Rule.SUPPORT}


def test_one_resolution_cell_under_a_vertex_is_support():
    table = [put('a', (0, 0, 0), (200, 200, 100)), put('b', (390, 0, 0), (100, 200, 100))]
    assert broken(put('c', (0, 0, 100), (400, 200, 100)), table) == set()


def test_a_top_that_is_lower_than_the_base_supports_within_the_tolerance_only():
    table = [put('a', (0, 0, 0), (200, 200, 100)), put('b', (200, 0, 0), (200, 200, 98))]
    loose = replace(ANY, resolution_z_mm=1, support_tolerance_mm=2)
    bridge = put('c', (0, 0, 100), (400, 200, 100))
    assert broken(bridge, table, loose) == set()
    assert broken(bridge, table, replace(loose, support_tolerance_mm=1)) == {Rule.SUPPORT}


def test_orientation_rule_and_up_flag_are_kept():
    standing = PlacedBox(Box('a', (300, 200, 100)), (0, 0, 0), (100, 200, 300), 'zyx')
    assert broken(standing, profile=LAB) == {Rule.ORIENTATION}
    fixed = PlacedBox(
        Box('a', (300, 200, 100), allowed_up=UP_POS_Z), (0, 0, 0), (300, 100, 200), 'xzy'
    )
    assert broken(fixed, profile=LAB) == {Rule.ORIENTATION}


def test_the_centre_of_mass_stays_inside_the_support_polygon():
    ell = [put('a', (0, 0, 0), (400, 200, 100)), put('b', (0, 200, 0), (200, 200, 100))]
    strict = replace(ANY, com_margin_mm=15.0)
    square = put('c', (0, 0, 100), (400, 400, 100))
    assert broken(square, ell, strict) == set()
    tipped = put('c', (0, 0, 100), (400, 400, 100), com_offset_mm=(120, 120, 0))
    assert broken(tipped, ell, strict) == {Rule.CENTRE_OF_MASS}


@pytest.mark.parametrize('orientation', ORIENTATIONS)
def test_the_centre_of_mass_goes_with_the_turn_that_the_arm_makes(orientation):
    box = Box('a', (300, 200, 100), com_offset_mm=(30.0, -20.0, 10.0))
    size = oriented_size(box.size_mm, orientation)
    placed = PlacedBox(box, (0, 0, 0), size, orientation)
    turned = rotated(QUATERNIONS[orientation], box.com_offset_mm)
    x, y = centre_of_mass(placed)
    assert (x - size[0] / 2, y - size[1] / 2) == pytest.approx(turned[:2])


def test_a_share_of_the_base_must_rest():
    corners = [
        put(str(i), (x, y, 0), (10, 10, 100))
        for i, (x, y) in enumerate([(0, 0), (390, 0), (0, 390), (390, 390)])
    ]
    table = put('c', (0, 0, 100), (400, 400, 100))
    assert broken(table, corners) == set()
    assert broken(table, corners, replace(ANY, min_support_share=0.5)) == {Rule.SUPPORT_SHARE}


def test_payload_and_bin_weight_are_limits():
    heavy = put('a', (0, 0, 0), (300, 200, 100), weight_kg=21.0)
    assert broken(heavy, profile=replace(ANY, max_payload_kg=20.0)) == {Rule.PAYLOAD}
    other = put('b', (300, 0, 0), (300, 200, 100), weight_kg=10.0)
    assert broken(heavy, [other], replace(ANY, max_bin_weight_kg=30.0)) == {Rule.BIN_WEIGHT}


def test_load_is_passed_down_the_stack_to_the_weak_box():
    weak = put('a', (0, 0, 0), (200, 200, 100), weight_kg=5.0, max_top_load_n=50.0)
    middle = put('b', (0, 0, 100), (200, 200, 100), weight_kg=3.0)
    top = put('c', (0, 0, 200), (200, 200, 100), weight_kg=3.0)
    profile = replace(ANY, check_top_load=True)
    assert broken(middle, [weak], profile) == set()
    assert broken(top, [weak, middle], profile) == {Rule.TOP_LOAD}
    assert broken(top, [weak, middle], ANY) == set()


def test_a_bridge_shares_its_load_by_area():
    left = put('a', (0, 0, 0), (300, 200, 100))
    right = put('b', (300, 0, 0), (100, 200, 100))
    bridge = put('c', (0, 0, 100), (400, 200, 100), weight_kg=4.0)
    loads = top_loads([left, right, bridge], tolerance=0)
    assert loads['a'] == pytest.approx(3.0 * GRAVITY)
    assert loads['b'] == pytest.approx(1.0 * GRAVITY)


def test_a_box_is_in_one_bin_once():
    placed = put('a', (0, 0, 0), (300, 200, 100))
    first, second = Bin('EQ-1', 1, EQ, (placed,)), Bin('EQ-2', 2, EQ, (placed,))
    assert [v.rule for v in validate_bins([first, second], PAPER)] == [Rule.DUPLICATE_BOX]
    assert broken(placed, [placed]) == {Rule.DUPLICATE_BOX}


def test_the_cell_profile_leaves_air_between_boxes():
    assert planned_size(Box('a', (590, 390, 270.3)), 'yxz', PROFILES['cell']) == (400, 600, 271)


def test_the_paper_profile_rounds_up_and_keeps_whole_centimetres():
    assert planned_size(Box('a', (300.0, 200.1, 95)), 'xyz', PAPER) == (300, 210, 100)


def test_the_footprint_keeps_a_margin_for_the_error_of_the_scanner_where_the_profile_wants_it():
    box = Box('a', (590, 390, 270.3), size_stddev_mm=(4.0, 2.0, 2.0))
    assert planned_size(box, 'yxz', PROFILES['cell']) == (400, 600, 271)
    assert planned_size(box, 'yxz', PAPER) == (390, 590, 280)


def test_a_box_that_may_lie_askew_keeps_more_room_across_than_along():
    box = Box('a', (592.0, 192.0, 270.0), size_stddev_mm=(2.0, 2.0, 2.0), yaw_stddev_rad=0.01)
    fine = replace(PROFILES['cell'], resolution_mm=1)
    # Along it 592 + 2 + 2 * hypot(2, 1.92), across it 192 + 2 + 2 * hypot(2, 5.92).
    assert planned_size(box, 'xyz', fine) == (600, 207, 270)
    assert planned_size(box, 'yxz', fine) == (207, 600, 270)
    assert planned_size(box, 'xyz', PAPER) == (600, 200, 270)


def test_unknown_profiles_and_orientation_rules_are_refused():
    with pytest.raises(ValueError, match='paper, cell'):
        find_profile('lab')
    with pytest.raises(ValueError, match='orientation rule'):
        Profile('x', orientations='sideways')


@given(
    st.lists(
        st.tuples(st.integers(0, 20), st.integers(0, 20), st.integers(1, 9), st.integers(1, 9)),
        min_size=1,
        max_size=5,
    ),
    st.tuples(st.floats(-5, 30), st.floats(-5, 30)),
)
def test_a_point_is_inside_the_hull_exactly_when_no_edge_separates_it(spots, point):
    rects = [(x, y, x + w, y + h) for x, y, w, h in spots]
    corners = [(x, y) for r in rects for x in (r[0], r[2]) for y in (r[1], r[3])]
    inside = hull_distance(rects, point) >= 0
    # A point is outside a convex hull when some direction sees it beyond every corner; the
    # directions normal to a pair of corners are all that matter.
    separated = False
    for ax, ay in corners:
        for bx, by in corners:
            nx, ny = ay - by, bx - ax
            if (nx, ny) == (0, 0):
                continue
            reach = max(nx * x + ny * y for x, y in corners)
            if nx * point[0] + ny * point[1] > reach + 1e-7:
                separated = True
    assert inside != separated or abs(hull_distance(rects, point)) < 1e-6


def test_a_box_goes_only_into_a_bin_of_its_destination():
    north = put('a', (0, 0, 0), (300, 200, 100), destination='north')

    def rules(destination):
        return [v.rule for v in violations(north, (), EQ, ANY, destination)]

    assert rules('north') == rules('') == []
    assert rules('south') == [Rule.DESTINATION]
    unsorted = put('b', (0, 0, 0), (300, 200, 100))
    assert [v.rule for v in violations(unsorted, (), EQ, ANY, 'north')] == [Rule.DESTINATION]
    wrong = Bin('EQ-1', 1, EQ, (north,), destination='south')
    assert [v.rule for v in validate_bins([wrong], PAPER)] == [Rule.DESTINATION]
    assert validate_bins([replace(wrong, destination='north')], PAPER) == []
