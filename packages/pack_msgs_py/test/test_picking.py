"""Where a box will lie when it is taken, by what a scan says of it."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pack_msgs_py.cell_values import Scan, ScannedBox
from pack_msgs_py.geometry.pose import Pose, about_z, extent, metres, quaternion_product
from pack_msgs_py.orientation import QUATERNIONS, TIPPED
from pack_msgs_py.picking import expected_pick, levelled, lies_as, turn_from
from pack_msgs_py.values import Box

BOX = Box('a', (300.0, 200.0, 100.0))
NOMINAL = Pose((0.0, 0.65, 0.80))
TIPPED_NOMINAL = Pose((0.0, 0.60, 0.85), QUATERNIONS[TIPPED['y']])
ANGLE = st.floats(-3.1, 3.1)


def shown(pose, *, opens_s=None):
    return Scan(1, 100.0, (ScannedBox(BOX, pose, pick_open_s=opens_s),))


@given(ANGLE, st.floats(-0.09, 0.09), st.sampled_from([NOMINAL, TIPPED_NOMINAL]))
def test_a_lean_is_taken_off_and_the_turn_is_kept(yaw, lean, lies):
    leaning = quaternion_product(
        (math.sin(lean / 2), 0.0, 0.0, math.cos(lean / 2)),
        quaternion_product(about_z(yaw), lies.quaternion),
    )
    pose = levelled(Pose((0.1, 0.7, 0.8), leaning), lies)
    assert lies_as(Pose((0, 0, 0), leaning), lies)
    assert turn_from(pose, lies) == pytest.approx(yaw, abs=0.01)
    assert lies_as(pose, lies) and pose.position == (0.1, 0.7, 0.8)


def test_another_face_up_is_not_the_same_lie():
    assert not lies_as(NOMINAL, TIPPED_NOMINAL)


def test_a_box_at_the_pick_point_lies_where_it_is_seen():
    seen = Pose((0.05, 0.75, 0.801), about_z(0.5))
    assert expected_pick(NOMINAL, 'a', shown(seen, opens_s=99.0)).position == seen.position
    assert turn_from(expected_pick(NOMINAL, 'a', shown(seen, opens_s=99.0)), NOMINAL) == (
        pytest.approx(0.5)
    )


@given(ANGLE, st.floats(-0.1, 0.1), st.sampled_from([NOMINAL, TIPPED_NOMINAL]))
def test_a_box_on_its_way_comes_against_the_guide_as_it_lies_now(yaw, aside, nominal):
    pick = expected_pick(nominal, 'a', shown(Pose((aside, 2.0, 0.80), about_z(yaw))))
    size = metres(BOX.size_mm)
    assert pick.position[0] == aside
    assert turn_from(pick, nominal) == pytest.approx(yaw, abs=1e-6)
    assert extent(pick, size)[0][1:] == pytest.approx(extent(nominal, size)[0][1:])


@pytest.mark.parametrize(
    'scan',
    [None, Scan(1, 100.0), shown(Pose((0.1, 2.0, 0.3)))],
    ids=['no scan', 'not in the scan', 'below the belt'],
)
def test_of_a_box_that_is_not_on_the_top_strand_nothing_more_is_known(scan):
    assert expected_pick(NOMINAL, 'a', scan) == NOMINAL
