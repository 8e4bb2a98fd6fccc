"""Stops: on request, by protection, and by the watchdog; the core with the timed arm."""

from __future__ import annotations

import threading
import time

import pytest
from executor_cases import make_box, make_decision, make_goal, make_scan

from arm_executor.arms.timed import TimedArm
from arm_executor.goals.outputs import Finished, Progress, Replied
from arm_executor.model.arm_interface import MotionError
from pack_msgs_py.codes import ErrorCode, Mode, Phase

BOX = make_box()


def begin(bench, *, presented=BOX.id):
    """Submit a goal for BOX; the caller waits for what it wants."""
    bench.core.on_scan(make_scan(BOX, stamp_s=time.time(), presented=presented))
    bench.core.submit(make_goal(make_decision(BOX), deadline_s=time.time() + 60))


def wait_phase(bench, phase):
    bench.wait(lambda: any(progress.phase is phase for progress in bench.of(Progress)))


def ended(bench):
    bench.wait(lambda: bench.of(Finished))
    return bench.of(Finished)[-1].report


def reset(bench):
    count = len(bench.of(Replied))
    bench.core.reset(count)
    bench.wait(lambda: len(bench.of(Replied)) > count)
    return bench.of(Replied)[-1].answer


@pytest.mark.parametrize(
    ('phase', 'events'),
    [
        (Phase.WAITING, []),
        (Phase.APPROACHING, []),
        (Phase.TRANSFERRING, ['PICKED']),
        (Phase.LOWERING, ['PICKED']),
    ],
)
def test_a_protective_stop_holds_the_box_until_the_reset(make_core_bench, phase, events):
    bench = make_core_bench(arm=TimedArm(speed=1.0))
    begin(bench, presented='' if phase is Phase.WAITING else BOX.id)
    wait_phase(bench, phase)
    bench.core.protective_stop('a person came in')
    report = ended(bench)
    assert (report.code, report.message) == (ErrorCode.PROTECTIVE_STOP, 'a person came in')
    bench.wait(lambda: bench.core.status().mode is Mode.PROTECTIVE_STOP)
    assert bench.events(BOX) == events
    assert bench.arm.holds() == (BOX.id if events else None)
    assert bench.place(make_box(2)).code is ErrorCode.NOT_ACTIVE
    success, text = reset(bench)
    assert success, text
    assert bench.events(BOX) == events + ['RETURNED'] * len(events)
    assert bench.core.status().mode is Mode.IDLE


def test_a_protective_stop_after_the_release_lets_the_box_be_placed_and_then_stands(
    make_core_bench,
):
    bench = make_core_bench(arm=TimedArm(speed=1.0))
    begin(bench)
    wait_phase(bench, Phase.RETREATING)
    bench.core.protective_stop('a person came in')
    assert ended(bench).code is ErrorCode.NONE
    bench.wait(lambda: bench.core.status().mode is Mode.PROTECTIVE_STOP)
    assert bench.boxes() == [BOX.id]
    assert reset(bench)[0]


def test_a_protective_stop_of_an_idle_arm_refuses_goals_until_the_reset(make_core_bench):
    bench = make_core_bench()
    bench.core.protective_stop('a person came in')
    assert bench.core.status().mode is Mode.PROTECTIVE_STOP
    assert bench.place(BOX).code is ErrorCode.NOT_ACTIVE
    assert reset(bench)[0]
    assert bench.place(BOX).code is ErrorCode.NONE


def test_pause_finishes_what_runs_and_refuses_what_comes(make_core_bench):
    bench = make_core_bench(arm=TimedArm(speed=5.0))
    begin(bench)
    wait_phase(bench, Phase.TRANSFERRING)
    bench.core.panel.request('PAUSE', '', 'anna', 'lunch', (True, ''))
    assert ended(bench).code is ErrorCode.NONE
    status = bench.core.status()
    assert status.mode is Mode.PAUSED
    assert 'PAUSED by anna (since ' in status.message and status.message.endswith(': lunch')
    assert bench.place(make_box(2), (300, 0, 0), revision=2).code is ErrorCode.NOT_ACTIVE
    bench.core.panel.request('RESUME', '', 'anna', '', (True, ''))
    assert bench.place(make_box(2), (300, 0, 0), revision=2).code is ErrorCode.NONE


class Clumsy(TimedArm):
    """Cannot bring a box back: it drops it, or keeps it in the gripper."""

    def __init__(self, *, drops):
        super().__init__(speed=1.0)
        self._drops = drops

    def return_to_belt(self):
        if self._drops:
            self._held = None
        raise MotionError(ErrorCode.BOX_LOST, 'on the way back: a hose burst')


@pytest.mark.parametrize(
    ('drops', 'code', 'events'),
    [
        (True, ErrorCode.BOX_LOST, ['PICKED', 'LOST']),
        (False, ErrorCode.PROTECTIVE_STOP, ['PICKED']),
    ],
)
def test_the_report_of_a_cancelled_goal_says_why_the_box_did_not_come_back(
    make_core_bench, drops, code, events
):
    bench = make_core_bench(arm=Clumsy(drops=drops))
    begin(bench)
    wait_phase(bench, Phase.TRANSFERRING)
    bench.core.cancel(bench.of(Progress)[0].goal_id)
    report = ended(bench)
    assert report.code is code
    assert 'stopped while transferring; on the way back: a hose burst' in report.message
    assert bench.events(BOX) == events


class Stuck(TimedArm):
    """Makes no progress after the grasp until it is stopped; ``deaf`` to that for good."""

    def __init__(self, *, deaf=False):
        super().__init__(speed=0.0)
        self.deaf = deaf
        self.freed = threading.Event()

    def _spend(self, phase, duration, spent, total, hooks, stop):
        going_on = super()._spend(phase, duration, spent, total, hooks, stop)
        if phase is Phase.TRANSFERRING and not self.freed.is_set():
            (self.freed if self.deaf else stop).wait(20.0)
            return False
        return going_on


def tick_until(bench, condition):
    """The heartbeat, which also drives the watchdog."""
    until = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < until, bench.said
        bench.core.tick()
        time.sleep(0.01)


def test_a_motion_without_progress_is_stopped_and_the_box_brought_back(make_core_bench):
    bench = make_core_bench(arm=Stuck(), watchdog_s=0.2)
    begin(bench)
    tick_until(bench, lambda: bench.of(Finished))
    report = bench.of(Finished)[0].report
    assert report.code is ErrorCode.MOTION_OVERDUE
    assert 'no progress for 0.2 s, 0.2 s are allowed' in report.message
    assert bench.events(BOX) == ['PICKED', 'RETURNED']
    assert bench.core.status().last_fault.startswith('MOTION_OVERDUE')


def test_an_arm_that_does_not_stop_is_a_fault_and_its_box_in_doubt(make_core_bench, monkeypatch):
    monkeypatch.setattr('arm_executor.goals.core.HUNG_S', 0.2)
    arm = Stuck(deaf=True)
    bench = make_core_bench(arm=arm, watchdog_s=0.2)
    begin(bench)
    tick_until(bench, lambda: bench.of(Finished))
    assert bench.of(Finished)[0].report.code is ErrorCode.UNKNOWN
    assert bench.core.status().mode is Mode.FAULT
    assert bench.events(BOX) == ['PICKED', 'UNKNOWN']
    arm.freed.set()
    assert bench.core.end(10.0)
    assert len(bench.of(Finished)) == 1


def test_an_arm_at_rest_may_be_quiet(make_core_bench):
    bench = make_core_bench(watchdog_s=0.05)
    assert bench.place(BOX).code is ErrorCode.NONE
    time.sleep(0.1)
    bench.core.tick()
    assert bench.core.status().mode is Mode.IDLE
