"""The planner says what it does and what it waits for, as it is."""

from __future__ import annotations

import pytest
from coordinator_rig import CoordinatorRig

from pack_msgs_py.codes import BoxEventKind, Mode
from pack_planner.coordination.doing import Doing


def test_it_names_what_it_has_not_heard_yet():
    rig = CoordinatorRig()
    assert rig.coordinator.doing() == Doing('waiting', 'the heartbeat of the arm')
    rig.beat()
    assert rig.coordinator.doing() == Doing('waiting', 'the belt')
    rig.scan()
    assert rig.coordinator.doing() == Doing('waiting', 'the bins')
    rig.bins()
    assert rig.coordinator.doing() == Doing('deciding')


def test_it_says_when_it_asks_the_arm_and_whom_it_watches():
    rig = CoordinatorRig(candidates=2)
    rig.bins()
    rig.scan()
    rig.beat()
    rig.planned('a')
    assert rig.coordinator.doing() == Doing('asking the arm')
    rig.answer(1.0)
    assert rig.coordinator.doing() == Doing('watching', "the arm to place box 'a'")


@pytest.mark.parametrize(
    ('mode', 'waits_for'),
    [
        (Mode.PAUSED, 'the arm, which is paused, to be resumed'),
        (Mode.ALARM, 'an alarm to be acknowledged'),
        (Mode.PROTECTIVE_STOP, 'the arm, which is stopped, to be reset'),
    ],
)
def test_while_the_arm_stands_it_does_not_say_that_it_decides(mode, waits_for):
    rig = CoordinatorRig()
    rig.beat(mode)
    rig.bins()
    rig.scan()
    assert rig.coordinator.doing() == Doing('waiting', waits_for)


def test_without_a_bin_that_may_be_filled_it_waits_and_decides_when_there_is_one():
    rig = CoordinatorRig()
    rig.beat()
    rig.coordinator.on_bins(rig.snapshot_without_bins())
    rig.scan()
    assert rig.coordinator.doing() == Doing('waiting', 'a bin that may be filled')
    assert rig.take() == []
    rig.bins()
    assert rig.take() == [('plan', 1)]


def test_it_says_that_it_waits_for_boxes_and_that_all_is_done():
    rig = CoordinatorRig()
    rig.beat()
    rig.bins()
    rig.scan([])
    assert rig.coordinator.doing() == Doing('waiting', 'boxes')
    rig.remaining = 0
    rig.scan([])
    assert rig.coordinator.doing() == Doing('done')


def test_a_box_that_is_on_its_way_is_no_box_to_choose_from():
    rig = CoordinatorRig()
    rig.event('a', BoxEventKind.PICKED)
    rig.beat()
    rig.bins()
    rig.scan(['a'])
    assert rig.coordinator.doing() == Doing('waiting', 'boxes')
