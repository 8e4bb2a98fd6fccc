"""The running belt with the real planner and executor: windows, arrivals, kills, starvation."""

from __future__ import annotations

import pytest

from pack_cell.report.record import RunRecord
from pack_cell.testing import NodeGroup
from pack_msgs_py.codes import BoxEventKind, ErrorCode

pytestmark = pytest.mark.cell


def start_all(group: NodeGroup, *, speed: float, count: int, **conveyor: object) -> None:
    state = group.folder / 'state'
    group.start('arm_executor', arm='timed', speed=speed, orientations='upright', state_dir=state)
    group.start('planner', orientations='upright')
    group.start('conveyor', count=count, speed=speed, state_dir=state, **conveyor)


def complete(record: RunRecord) -> bool:
    return record.complete() and record.all_reported()


def assert_all_placed(group: NodeGroup, count: int) -> None:
    assert group.record.count(BoxEventKind.PLACED) == count, group.text()
    assert group.record.unaccounted() == []
    for name in ('conveyor', 'planner', 'arm_executor'):
        assert 'Traceback' not in group.log(name), group.text()


def test_boxes_are_picked_from_a_running_belt_in_their_windows(group: NodeGroup) -> None:
    start_all(group, speed=8.0, count=12, belt_mode='continuous')
    group.wait_until(complete, 60)
    assert_all_placed(group, 12)
    assert group.seen('late_picks') == 0
    assert group.seen('missed_windows') == 0
    assert group.seen('most_laps') >= 1
    codes = {report.code for report in group.record.all_reports.values()}
    assert codes == {ErrorCode.NONE}, group.text()


def test_a_window_that_nobody_uses_is_another_lap_and_no_box_is_lost(group: NodeGroup) -> None:
    start_all(group, speed=8.0, count=10, belt_mode='continuous', pick_window=4.0)
    group.wait_until(lambda record: record.count(BoxEventKind.PLACED) >= 3, 60)
    group.kill('arm_executor')
    group.wait_until(lambda record: group.seen('missed_windows') >= 2, 30)
    group.start('arm_executor')
    group.wait_until(lambda record: record.complete(), 60)
    assert_all_placed(group, 10)


@pytest.mark.slow
@pytest.mark.parametrize('arrivals', ['poisson:4000', 'bursts:4,6'])
def test_boxes_that_come_now_and_then_are_all_packed(group: NodeGroup, arrivals: str) -> None:
    start_all(group, speed=8.0, count=12, belt_mode='continuous', arrivals=arrivals)
    group.wait_until(complete, 60)
    assert_all_placed(group, 12)


def test_as_fast_as_possible_sparse_arrivals_and_jams_hold_nobody_up(group: NodeGroup) -> None:
    start_all(group, speed=0.0, count=12, arrivals='poisson:400', jams='random:60,30')
    group.wait_until(complete, 60)
    assert_all_placed(group, 12)


@pytest.mark.slow
@pytest.mark.parametrize('mode', ['stop_at_pick', 'continuous'])
def test_a_conveyor_that_is_killed_in_every_phase_loses_no_box_and_leaves_none_unpresented(
    group: NodeGroup, mode: str
) -> None:
    """Killed at 10 moments that wander through the cycle of a box, 0.5 s at this speed."""
    kills, cycle_s = 10, 0.5
    start_all(group, speed=8.0, count=14, belt_mode=mode)
    group.wait_until(lambda record: record.count(BoxEventKind.PICKED) >= 1, 60)
    for number in range(kills):
        before = len(group.record.all_reports)
        group.pause(cycle_s * number / kills)
        group.kill('conveyor')
        group.start('conveyor')
        group.wait_until(
            lambda record, n=before: len(record.all_reports) > n or complete(record), 20
        )
    group.wait_until(complete, 60)
    assert_all_placed(group, 14)
    codes = {report.code.name for report in group.record.all_reports.values()}
    assert 'BOX_NOT_PRESENTED' not in codes, group.text()
    assert group.record.count(BoxEventKind.REJECTED) == 0
