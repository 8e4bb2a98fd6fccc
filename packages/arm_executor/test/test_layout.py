"""The layout is checked before anything is built on it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from arm_executor.model.layout import (
    ConveyorLayout,
    Layout,
    LayoutError,
    Rail,
    Stations,
    Tool,
    bin_blocks,
    bin_frame,
    check_layout,
    pick_pose,
)
from arm_executor.model.robot_data import ROBOTS
from arm_executor.reach.layout_file import find_layout, load_layout
from arm_executor.reach.reach import check_reach, reached
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import BIN_TYPES, parse_bin

CONFIG = Path(__file__).parents[1] / 'config' / 'layout.yaml'


@pytest.mark.parametrize('kind', BIN_TYPES)
def test_every_bin_of_the_paper_fits_every_station(kind):
    check_layout(Layout(), dict.fromkeys('ABC', parse_bin(kind)))


def test_shipped_file_says_what_the_defaults_say():
    assert load_layout(CONFIG) == Layout()


def test_overlapping_station_is_refused_with_both_names():
    narrow = replace(Layout(), stations=Stations(gap_x=0.30))
    with pytest.raises(LayoutError, match=r'conveyor .* overlaps bin A floor'):
        check_layout(narrow, {'A': parse_bin('LDC')})


def test_bin_in_the_way_of_the_pedestal_is_refused():
    near = replace(Layout(), stations=Stations(near_y=0.10))
    with pytest.raises(LayoutError, match=r'rail and pedestal .* overlaps bin C'):
        check_layout(near, {'C': parse_bin('EQ')})


@pytest.mark.parametrize(
    ('layout', 'message'),
    [
        (Layout(conveyor=ConveyorLayout(width=-1.0)), 'conveyor.width is -1.0; it must be above 0'),
        (Layout(rail=Rail(speed=float('nan'))), 'rail.speed is nan; it must be finite'),
        (Layout(rail=Rail(x_min=1.0, x_max=-1.0)), 'rail.x_min 1.0 is above rail.x_max -1.0'),
        (Layout(stations=Stations(wall=0.0)), 'stations.wall is 0.0; it must be above 0'),
        (Layout(rail=Rail(x_max=1e9)), r'rail.x_max is 1000000000.0; it must be -50 to 50'),
        (Layout(tool=Tool(vacuum=2e5)), r'tool.vacuum is 200000.0; it must be 0 to 101325'),
        (Layout(tool=Tool(safety=0.5)), r'tool.safety is 0.5; it must be 1 to 10'),
        (Layout(robot='ur7'), r"unknown robot 'ur7': use one of ur5e, .*ur30"),
    ],
)
def test_impossible_values_are_named(layout, message):
    with pytest.raises(LayoutError, match=message):
        check_layout(layout, {})


def test_an_arm_without_a_rail_stands_still():
    rail = Rail(x_min=0.3, x_max=0.3)
    assert check_layout(replace(Layout(), rail=rail), {'A': parse_bin('EQ')}).rail.fixed
    assert not Layout().rail.fixed
    assert [rail.nearest(x) for x in (-1.0, 0.3, 2.0)] == [0.3, 0.3, 0.3]


def test_unknown_station_is_named():
    with pytest.raises(LayoutError, match="no station 'D'"):
        bin_frame(Layout(), 'D', parse_bin('EQ'))


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('rails: {}', "unknown key 'rails'"),
        ('rail: {speed: fast}', "speed is 'fast'; it must be a number"),
        ('rail: 3', 'expected a mapping, got 3'),
        ('rail: {speed: true}', 'speed is True; it must be a number'),
        ('robot: ur7', "unknown robot 'ur7': use one of"),
        ('robot: 20', 'robot is 20; it must be a name'),
        ('[1, 2', 'while parsing a flow sequence'),
    ],
)
def test_bad_file_names_the_key(tmp_path, text, message):
    path = tmp_path / 'layout.yaml'
    path.write_text(text)
    with pytest.raises(LayoutError, match=message):
        load_layout(path)


def test_missing_file_is_a_layout_error(tmp_path):
    with pytest.raises(LayoutError, match=r'none\.yaml'):
        load_layout(tmp_path / 'none.yaml')


def test_parameter_robot_wins_over_the_file_and_the_rest_of_the_file_stays(tmp_path):
    path = tmp_path / 'layout.yaml'
    path.write_text('robot: ur10e\nrail: {x_max: 1.5}')
    assert find_layout(str(path)).robot == 'ur10e'
    layout = find_layout(str(path), 'ur30')
    assert (layout.robot, layout.rail.x_max, layout.rail.x_min) == ('ur30', 1.5, -2.4)
    assert find_layout('') == Layout()
    assert find_layout('', 'ur20') == Layout(robot='ur20')


def test_belt_in_a_bin_is_refused():
    wide = replace(Layout(), conveyor=ConveyorLayout(width=1.2))
    with pytest.raises(LayoutError, match=r'conveyor .* overlaps bin A'):
        check_layout(wide, {'A': parse_bin('EQ')})


@pytest.mark.parametrize(('name', 'value'), [('front_y', 0.6), ('top_z', 0.9)])
def test_pick_point_that_the_other_nodes_do_not_know_is_refused(name, value):
    moved = replace(Layout(), conveyor=ConveyorLayout(**{name: value}))
    with pytest.raises(LayoutError, match=rf'conveyor\.{name} is {value}; planner and conveyor'):
        check_layout(moved, {})


@pytest.mark.parametrize(
    ('robot', 'kinds'),
    [
        ('ur20', ('EQ', 'LDC', 'SYN', 'PAL', 'RC')),
        ('ur30', ('EQ', 'LDC', 'SYN', 'PAL')),
        ('ur10e', ('EQ', 'LDC', 'SYN', 'PAL')),
        ('ur16e', ('EQ', 'SYN')),
        ('ur5e', ('EQ', 'SYN')),
    ],
)
def test_layout_of_each_robot_reaches_the_bins_that_it_is_for(robot, kinds):
    for kind in kinds:
        bins = dict.fromkeys('ABC', parse_bin(kind))
        check_reach(check_layout(find_layout('', robot), bins), bins, 0.6)


def test_short_arm_in_the_layout_of_a_long_one_is_refused_with_what_it_reaches():
    with pytest.raises(LayoutError, match=r'ur16e \(reach 0\.9 m\) reaches 43% of bin A \(LDC\)'):
        low = ConveyorLayout(tallest_box=0.45)
        check_reach(Layout(robot='ur16e', conveyor=low), {'A': parse_bin('LDC')})
    with pytest.raises(LayoutError, match=r'ur5e .* base 1\.3 m high cannot reach the waiting'):
        low_base = Rail(base_height=1.30)
        check_reach(Layout(robot='ur5e', rail=low_base), {'A': parse_bin('SYN')})


def test_tool_as_heavy_as_the_robot_lifts_is_refused():
    with pytest.raises(LayoutError, match=r'tool\.mass is 6 kg, all that ur5e lifts'):
        check_layout(Layout(robot='ur5e', tool=Tool(mass=6.0)), {})


def test_bin_too_far_away_is_refused_with_the_share_in_reach():
    far = replace(Layout(), stations=Stations(near_y=2.2))
    with pytest.raises(LayoutError, match=r'ur20 .* reaches 0% of bin A \(EQ\), at least 50%'):
        check_reach(far, {'A': parse_bin('EQ')})


@pytest.mark.parametrize('name', ROBOTS)
def test_layout_of_every_robot_can_be_built(name):
    layout = find_layout('', name)
    assert layout.robot == name
    check_layout(layout, dict.fromkeys('ABC', parse_bin('SYN')))
    assert 0.0 <= reached(layout, 'A', parse_bin('SYN')) <= 1.0


def test_stations_stand_where_the_architecture_says():
    spec, layout = parse_bin('LDC'), Layout()
    assert bin_frame(layout, 'A', spec).origin == pytest.approx((-1.65, 0.55, 0.15))
    assert bin_frame(layout, 'B', spec).origin == pytest.approx((0.45, 0.55, 0.15))
    back = bin_frame(layout, 'C', spec)
    # The corner nearest the bin's origin is nearest the rail, on the other side.
    assert back.to_cell(Pose((0.1, 0.2, 0.3))).position == pytest.approx((0.5, -0.75, 0.45))


@pytest.mark.parametrize('station', 'ABC')
def test_cage_is_filled_from_its_back_wall_to_its_open_front(station):
    layout, cage = Layout(), parse_bin('RC')
    frame = bin_frame(layout, station, cage)
    length, breadth, _ = (edge / 1000 for edge in cage.size_mm)
    corners = [
        frame.to_cell(Pose((x, y, 0.0))).position for x in (0.0, length) for y in (0.0, breadth)
    ]
    away = [abs(y) for _, y, _ in corners]
    assert away == pytest.approx([0.85 + breadth, 0.85] * 2)
    back = next(b for b in bin_blocks(layout, station, cage) if b.name.endswith('back wall'))
    assert min(abs(back.low[1]), abs(back.high[1])) == pytest.approx(0.85 + breadth)
    # Where it stands is the same as for a bin with four walls that starts there.
    low = {'A': -0.45 - length, 'B': 0.45, 'C': -length / 2}[station]
    assert min(x for x, _, _ in corners) == pytest.approx(low)


@pytest.mark.parametrize('station', 'ABC')
def test_bin_frame_and_back_is_the_same_pose(station):
    frame = bin_frame(Layout(), station, parse_bin('PAL'))
    pose = Pose((0.3, 0.2, 0.1), (0.0, 0.0, 0.6, 0.8))
    back = frame.from_cell(frame.to_cell(pose))
    assert back.position == pytest.approx(pose.position)
    assert back.quaternion == pytest.approx(pose.quaternion)


@pytest.mark.parametrize(
    ('kind', 'parts'), [('LDC', 5), ('RC', 4), ('PAL', 1), ('SYN', 5), ('100x60x60', 5)]
)
def test_kinds_differ_in_walls(kind, parts):
    blocks = bin_blocks(Layout(), 'A', parse_bin(kind))
    assert len(blocks) == parts
    assert kind != 'RC' or 'bin A front wall' not in {block.name for block in blocks}


def test_box_at_the_pick_point_has_its_front_at_the_head_of_the_belt():
    assert pick_pose(Layout(), (400.0, 300.0, 200.0)).position == pytest.approx((0.0, 0.70, 0.85))
