"""Walls belong to the kind of bin: what stands in the world, and how the arm goes in."""

from __future__ import annotations

import pytest

pytest.importorskip('pybullet')
pytest.importorskip('toppra')

from physics_cases import Told, box, request_for, run

from arm_executor.arms.physics.arm import PhysicsArm
from arm_executor.model.arm_interface import MotionError
from arm_executor.model.layout import Layout, bin_blocks
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.values import Bin, parse_bin


@pytest.fixture
def arm_before():
    """Makes an arm in physics with one empty bin of a kind at station A."""
    arms = []

    def make(kind):
        arm = PhysicsArm()
        arms.append(arm)
        arm.set_bins([Bin('bin-A', 1, parse_bin(kind), station='A')], {})
        return arm

    yield make
    for arm in arms:
        arm.close()


@pytest.mark.parametrize(
    ('kind', 'walls'),
    [
        ('120x80x150', {'left', 'right', 'front', 'back'}),
        ('120x80x150:cage', {'left', 'right', 'back'}),
        ('120x80x150:pallet', set()),
        ('PAL', set()),
        ('PAL:box', {'left', 'right', 'front', 'back'}),
        ('RC', {'left', 'right', 'back'}),
    ],
)
def test_a_bin_stands_there_with_its_walls_and_no_others(kind, walls):
    names = [block.name for block in bin_blocks(Layout(), 'A', parse_bin(kind))]
    assert names[0] == 'bin A floor'
    assert set(names[1:]) == {f'bin A {side} wall' for side in walls}
    assert len(names) == 1 + len(walls)


def test_a_box_may_stand_over_the_edge_of_a_pallet_where_a_wall_would_be(arm_before):
    """Its left side lies 10 mm beyond the edge, where a closed bin of that size has its wall."""
    pallet, closed = arm_before('120x80x150:pallet'), arm_before('120x80x80')
    result = run(pallet, request_for(pallet, box(), 'A', (0.14, 0.4, 0.1)))
    assert result.code is ErrorCode.NONE, result.message
    assert result.measured.position == pytest.approx((0.14, 0.4, 0.1), abs=0.002)
    with pytest.raises(MotionError, match='bin A left wall'):
        closed.plan(request_for(closed, box(), 'A', (0.14, 0.4, 0.1)))


def test_a_cage_of_any_size_is_entered_through_its_front_below_its_rim(arm_before):
    cage = arm_before('110x75x160:cage')
    rim = Layout().stations.deck_z + 1.6
    front_y = Layout().stations.near_y_open_front
    heights = []

    def look():
        _, y, z = cage.world.tool_pose().position
        if y > front_y:
            heights.append(z)

    request = request_for(cage, box(), 'A', (0.6, 0.15, 0.1))
    result = run(cage, request, Told(TRANSFERRING=look, LOWERING=look))
    assert result.code is ErrorCode.NONE, result.message
    assert result.measured.position == pytest.approx((0.6, 0.15, 0.1), abs=0.002)
    assert heights
    assert max(heights) < rim


def test_a_bin_that_comes_after_one_with_other_walls_replaces_them(arm_before):
    arm = arm_before('120x80x80')
    arm.set_bins([Bin('bin-A', 1, parse_bin('120x80x80:pallet'), station='A')], {})
    result = run(arm, request_for(arm, box(), 'A', (0.14, 0.4, 0.1)))
    assert result.code is ErrorCode.NONE, result.message
