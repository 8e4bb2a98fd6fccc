"""A box that a crash has left in doubt: the arm is asked, then a person; its bin is blocked."""

from __future__ import annotations

import time

import pytest
from core_bench import CoreBench
from executor_cases import CELL, LDC, make_box, make_decision, make_goal, make_scan
from toy_arm import ToyArm

from arm_executor.bins.book import BinBook, BookError
from arm_executor.bins.journal import Journal
from arm_executor.bins.records import configuration
from arm_executor.goals.outputs import BinsChanged, Finished, Replied
from arm_executor.model.arm_interface import FoundAt
from pack_msgs_py.codes import ErrorCode

STEPS = ('picked', 'releasing', 'placed')


class FindingToy(ToyArm):
    """Says of every box that it is where it was told."""

    def __init__(self, found):
        super().__init__(None)
        self.found, self.asked = found, []

    def find_box(self, box, station, target, *, released):
        self.asked.append((box.id, station, released))
        return self.found


def crash_after(folder, last):
    """A journal whose executor died behind step ``last`` of a box."""
    journal = Journal(folder, configuration(LDC, CELL))
    book = BinBook(journal, LDC, 2, time.time)
    book.recover()
    book.settled({})
    book.begin(make_decision(make_box()))
    for step in STEPS[: STEPS.index(last) + 1]:
        getattr(book, step)()
    journal.close()


@pytest.fixture
def restarted(tmp_path):
    """Restart after a crash behind a step, with an arm."""
    benches = []

    def restart(last, arm):
        crash_after(tmp_path, last)
        benches.append(CoreBench(arm=arm, folder=str(tmp_path), acknowledges_itself=True))
        return benches[-1]

    yield restart
    for bench in benches:
        bench.end()


def resolve(bench, placed, why='seen', box_id='box-1'):
    bench.core.resolve('ticket', box_id, placed=placed, text=why)
    count = len(bench.of(Replied))
    bench.wait(lambda: len(bench.of(Replied)) > count)
    return bench.of(Replied)[-1].answer


@pytest.mark.parametrize('last', ['picked', 'releasing'])
@pytest.mark.parametrize(
    ('found', 'end', 'inside'),
    [(FoundAt.ON_BELT, 'RETURNED', []), (FoundAt.IN_BIN, 'PLACED', ['box-1'])],
)
def test_an_arm_that_can_tell_is_believed(restarted, last, found, end, inside):
    arm = FindingToy(found)
    bench = restarted(last, arm)
    assert arm.asked == [('box-1', 'A', last == 'releasing')]
    assert bench.events(make_box())[-1] == end
    assert bench.boxes() == inside
    assert bench.book.state.blocked == {}


@pytest.mark.parametrize('last', ['picked', 'releasing'])
@pytest.mark.parametrize('arm', [ToyArm(None), FindingToy(None)], ids=['no word', 'no idea'])
def test_a_box_of_which_nobody_can_tell_is_unknown_and_blocks_its_bin(restarted, last, arm):
    bench = restarted(last, arm)
    assert bench.events(make_box())[-1] == 'UNKNOWN'
    assert bench.boxes() == []
    [(name, why)] = bench.book.state.blocked.items()
    assert name == 'LDC-1'
    assert 'cell resolve box-1' in why
    assert [alarm.code for alarm in bench.core.panel.standing] == ['BOX_UNKNOWN']
    with pytest.raises(BookError, match='is blocked: nobody knows'):
        bench.core.swap('LDC-1', 0)


def test_a_box_that_the_pad_has_let_go_is_in_its_bin_without_asking(restarted):
    bench = restarted('placed', FindingToy(None))
    assert bench.boxes() == ['box-1']
    assert bench.book.state.blocked == {}


def test_no_goal_goes_into_a_blocked_bin_and_the_other_one_goes_on(restarted):
    bench = restarted('picked', ToyArm(None))
    other = make_box(2)
    report = bench.place(other)
    assert report.code is ErrorCode.NOT_ACTIVE
    assert "bin 'LDC-1' is blocked" in report.message
    decision = make_decision(other, bin_id='LDC-2', serial=2)
    goal = make_goal(decision, deadline_s=time.time() + 60, frame_id='bin_b', number=2)
    bench.core.on_scan(make_scan(other, stamp_s=time.time(), presented=other.id))
    bench.core.submit(goal)
    bench.wait(lambda: len(bench.of(Finished)) > 1)
    assert bench.of(Finished)[-1].report.code is ErrorCode.NONE


@pytest.mark.parametrize(
    ('placed', 'end', 'inside'), [(True, 'PLACED', ['box-1']), (False, 'REJECTED', [])]
)
def test_a_person_resolves_it_and_the_bin_goes_on(restarted, placed, end, inside):
    bench = restarted('releasing', ToyArm(None))
    before = bench.book.state.bins[0].revision
    done, text = resolve(bench, placed)
    assert done and 'goes on' in text
    assert bench.events(make_box())[-1] == end
    assert bench.boxes() == inside
    state = bench.of(BinsChanged)[-1].state
    assert state.blocked == {}
    assert state.bins[0].revision > before
    assert ('box-1' in bench.book.ids_in_bins) == placed


def test_what_a_person_says_is_in_the_journal(restarted):
    bench = restarted('picked', ToyArm(None))
    resolve(bench, False, 'anna: lay beside the rail')
    steps = bench.journal.steps()[1]
    assert ('resolved: anna: lay beside the rail') in [step for step, _ in steps]


def test_a_box_that_is_not_in_doubt_is_not_resolved(restarted):
    bench = restarted('picked', ToyArm(None))
    done, text = resolve(bench, True, box_id='box-9')
    assert not done
    assert text == "box 'box-9' is not in doubt; in doubt: 'box-1'"


def test_doubt_outlives_another_crash(restarted, tmp_path):
    bench = restarted('picked', ToyArm(None))
    bench.journal.close()
    journal = Journal(tmp_path, configuration(LDC, CELL))
    book = BinBook(journal, LDC, 2, time.time)
    assert book.recover().undecided == ()
    assert list(book.state.blocked) == ['LDC-1']
    journal.close()
