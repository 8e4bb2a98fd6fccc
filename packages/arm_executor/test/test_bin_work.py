"""What operators do with bins: swap, close, hold, boxes put in and taken out by hand."""

from __future__ import annotations

import threading
import time

import pytest
from core_bench import TIMEOUT_S
from executor_cases import CELL, make_box, make_decision, make_goal, make_scan
from hypothesis import given, settings
from hypothesis import strategies as st
from test_stops import begin, ended, wait_phase

from arm_executor.arms.timed import TimedArm
from arm_executor.bins.book import BookError
from arm_executor.bins.hand_work import hand_pose
from arm_executor.goals.bin_work import BinWork
from arm_executor.goals.outputs import BinClosed
from pack_msgs_py.codes import ErrorCode, Mode, Phase
from pack_msgs_py.profiles import planned_size
from pack_msgs_py.values import PlacedBox

BOX, NEXT = make_box(1), make_box(2)
SIZE = planned_size(BOX, 'xyz', CELL)


def work_of(bench):
    return BinWork(bench.core, bench.book)


def paused(bench):
    bench.core.panel.request('PAUSE', '', 'anna', '', (True, ''))
    return work_of(bench)


def at(box, corner_mm=(0, 0, 0)):
    return PlacedBox(box, corner_mm, planned_size(box, 'xyz', CELL))


def stations(bench):
    return [(bin_.station, bin_.id) for bin_ in bench.book.state.bins]


def test_a_swap_closes_a_bin_and_opens_an_empty_one_there(make_core_bench):
    bench = make_core_bench()
    bench.place(BOX)
    text = work_of(bench).swap('A')
    assert text == 'bin LDC-1 closed with 1 box; empty bin LDC-3 is open'
    assert stations(bench) == [('B', 'LDC-2'), ('A', 'LDC-3')]


def test_a_swap_waits_for_the_box_that_is_on_its_way(make_core_bench):
    bench = make_core_bench(arm=TimedArm(speed=5.0))
    work = work_of(bench)
    begin(bench)
    wait_phase(bench, Phase.TRANSFERRING)
    assert 'as soon as the box on its way into it rests' in work.swap('LDC-1')
    assert ended(bench).code is ErrorCode.NONE
    assert stations(bench)[0] == ('A', 'LDC-1')
    work.goal_ended()
    assert [closed.bin.boxes[0].box.id for closed in bench.of(BinClosed)] == [BOX.id]
    assert stations(bench) == [('B', 'LDC-2'), ('A', 'LDC-3')]


def test_a_closed_bin_leaves_its_station_empty_until_a_swap_also_after_a_restart(
    make_core_bench, tmp_path
):
    bench = make_core_bench(folder=tmp_path)
    assert 'cell swap A' in work_of(bench).close('A')
    assert stations(bench) == [('B', 'LDC-2')]
    bench.end()
    again = make_core_bench(folder=tmp_path)
    assert stations(again) == [('B', 'LDC-2')]
    assert work_of(again).swap('A') == 'empty bin LDC-3 stands at station A'
    assert stations(again) == [('B', 'LDC-2'), ('A', 'LDC-3')]
    again.end()


def test_no_goal_goes_into_a_bin_that_is_held_also_after_a_restart(make_core_bench, tmp_path):
    bench = make_core_bench(folder=tmp_path)
    work_of(bench).hold('A', held=True)
    assert bench.place(BOX).code is ErrorCode.STALE_BIN_REVISION
    refused = bench.place(BOX, revision=2)
    assert (refused.code, refused.message) == (
        ErrorCode.NOT_ACTIVE,
        "bin 'LDC-1' is held by an operator",
    )
    bench.end()
    again = make_core_bench(folder=tmp_path)
    assert again.book.state.held == {'LDC-1'}
    work_of(again).hold('LDC-1', held=False)
    assert again.place(BOX, revision=3).code is ErrorCode.NONE
    again.end()


def test_holding_twice_is_refused(make_core_bench):
    work = work_of(make_core_bench())
    work.hold('A', held=True)
    with pytest.raises(BookError, match='bin LDC-1 is held already'):
        work.hold('A', held=True)


def test_every_bin_with_a_box_is_closed_at_the_end_of_a_shift(make_core_bench):
    bench = make_core_bench()
    bench.place(BOX)
    assert work_of(bench).close_all() == 'closed: LDC-1'
    assert stations(bench) == [('B', 'LDC-2'), ('A', 'LDC-3')]
    assert work_of(bench).close_all() == 'no bin holds a box'


def test_nobody_reaches_into_a_bin_while_the_arm_may_move(make_core_bench):
    bench = make_core_bench()
    with pytest.raises(BookError, match=r'the arm may move, its mode is IDLE: cell pause first'):
        work_of(bench).insert('A', at(BOX))


def test_a_box_put_in_by_hand_is_in_the_bin_and_in_nobodys_way(make_core_bench, tmp_path):
    bench = make_core_bench(folder=tmp_path)
    work = paused(bench)
    work.insert('A', at(BOX))
    assert bench.boxes() == [BOX.id] and bench.events(BOX) == ['PLACED']
    bench.wait(lambda: bench.book.state.bins[0].revision == 3)
    assert bench.book.state.poses[BOX.id] == hand_pose(at(BOX))
    bench.core.panel.request('RESUME', '', '', '', (True, ''))
    assert bench.place(BOX, revision=3).code is ErrorCode.DUPLICATE_BOX
    assert bench.place(NEXT, revision=3).code is ErrorCode.RULE_VIOLATION
    assert bench.place(NEXT, (SIZE[0], 0, 0), revision=3).code is ErrorCode.NONE
    bench.end()
    again = make_core_bench(folder=tmp_path)
    assert again.boxes() == [BOX.id, NEXT.id]
    again.end()


def test_a_box_taken_out_by_hand_is_out_of_the_bin_and_of_the_cell(make_core_bench, tmp_path):
    bench = make_core_bench(folder=tmp_path)
    bench.place(BOX)
    bench.place(NEXT, (0, 0, SIZE[2]), revision=2)
    text = paused(bench).remove(BOX.id)
    assert text == "box 'box-1' is out of its bin; it carried box-2: look how they stand now"
    assert bench.boxes() == [NEXT.id]
    assert bench.events(BOX) == ['PICKED', 'PLACED', 'REJECTED']
    bench.core.panel.request('RESUME', '', '', '', (True, ''))
    bench.end()
    again = make_core_bench(folder=tmp_path)
    assert again.boxes() == [NEXT.id]
    again.end()


@pytest.mark.parametrize(
    ('placed', 'said'),
    [
        (at(NEXT, (1000, 0, 0)), 'would reach from 1000 to 1300 mm along x, bin LDC-1'),
        (at(NEXT, (-10, 0, 0)), 'would reach from -10'),
        (at(NEXT, (100, 0, 0)), "would stand in box 'box-1'"),
        (at(BOX, (500, 0, 0)), "box 'box-1' is in a bin already"),
    ],
)
def test_a_box_cannot_be_put_where_it_cannot_be(make_core_bench, placed, said):
    bench = make_core_bench()
    bench.place(BOX)
    with pytest.raises(BookError, match=said):
        paused(bench).insert('A', placed)
    assert bench.boxes() == [BOX.id]


def test_a_box_that_is_in_no_open_bin_cannot_be_taken_out(make_core_bench):
    bench = make_core_bench()
    bench.place(BOX)
    bench.core.swap('LDC-1', 0)
    work = paused(bench)
    with pytest.raises(BookError, match="box 'box-1' is in a bin that was taken away"):
        work.remove(BOX.id)
    with pytest.raises(BookError, match="box 'box-2' is in no bin"):
        work.remove(NEXT.id)


def test_a_bin_that_is_not_there_is_named_with_those_that_are(make_core_bench):
    with pytest.raises(BookError, match="no open bin 'Z'; open are LDC-1 at A, LDC-2 at B"):
        work_of(make_core_bench()).swap('Z')


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.sampled_from('pirhcs'), st.integers(1, 4)), max_size=12))
def test_the_journal_holds_what_the_book_shows_whatever_people_do(steps):
    from core_bench import CoreBench

    bench = CoreBench()
    work = paused(bench)
    try:
        for step, number in steps:
            box = make_box(number)
            station = 'AB'[number % 2]
            corner = (300 * (number // 2), 0, 0)
            try:
                match step:
                    case 'p' | 'i':
                        work.insert(station, at(box, corner))
                    case 'r':
                        work.remove(box.id)
                    case 'h':
                        work.hold(station, held=number > 2)
                    case 'c':
                        work.close(station)
                    case 's':
                        work.swap(station)
            except BookError:
                pass
        with bench.book.lock:
            state = bench.book.state
            assert bench.journal.open_bins() == tuple(
                sorted(state.bins, key=lambda bin_: bin_.serial)
            )
            assert bench.journal.revision() == state.revision
            inside = [placed.box.id for bin_ in state.bins for placed in bin_.boxes]
            assert len(set(inside)) == len(inside) and set(inside) <= set(state.poses)
            assert state.held <= {bin_.id for bin_ in state.bins}
    finally:
        bench.end()


def test_a_goal_for_a_bin_that_was_swapped_meanwhile_is_refused_with_its_name(make_core_bench):
    import time

    bench = make_core_bench()
    work_of(bench).swap('A')
    bench.core.on_scan(make_scan(BOX, stamp_s=time.time(), presented=BOX.id))
    bench.core.submit(make_goal(make_decision(BOX), deadline_s=time.time() + 60))
    report = ended(bench)
    assert report.code is ErrorCode.INVALID_GOAL and "'LDC-1'" in report.message


def test_a_goal_that_meets_a_bin_which_people_have_just_changed_is_decided_again(make_core_bench):
    class SlowToLook(TimedArm):
        """Looks into the bins once the next goal is there."""

        def __init__(self):
            super().__init__(speed=0.0)
            self.look = threading.Event()
            self.look.set()

        def set_bins(self, bins, poses):
            assert self.look.wait(TIMEOUT_S)
            return super().set_bins(bins, poses)

    arm = SlowToLook()
    bench = make_core_bench(arm=arm)
    arm.look.clear()
    paused(bench).insert('A', at(BOX))
    bench.core.panel.request('RESUME', '', 'anna', '', (True, ''))
    bench.core.on_scan(make_scan(NEXT, stamp_s=time.time(), presented=NEXT.id))
    decision = make_decision(NEXT, (SIZE[0], 0, 0), revision=bench.book.state.bins[0].revision)
    bench.core.submit(make_goal(decision, deadline_s=time.time() + 60.0))
    arm.look.set()
    report = ended(bench)
    assert report.code is ErrorCode.STALE_BIN_REVISION, report.message
    assert bench.core.status().mode is Mode.IDLE
    again = bench.place(NEXT, (SIZE[0], 0, 0), revision=bench.book.state.bins[0].revision)
    assert again.code is ErrorCode.NONE
