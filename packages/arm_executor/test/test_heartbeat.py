"""The heartbeat goes on beside a request that holds up the node's thread, and not for ever."""

from __future__ import annotations

import pytest

from arm_executor.goals.bin_work import BinWork
from arm_executor.ros.heartbeat import HELD_UP_S, STEP_IN_S, SteadyHeartbeat
from pack_msgs.srv import RemoveBox

PERIOD_S = 3600.0
TIMEOUT_S = 20.0


class Held:
    """A heart whose clock is set by hand, and the beats that are sent for its thread."""

    def __init__(self):
        self.now_s = 0.0
        self.again = 0
        self.heart = SteadyHeartbeat(self._beat, PERIOD_S, lambda: self.now_s)
        self.heart.beat(lambda: None)

    def _beat(self):
        self.again += 1

    def after(self, late_s):
        """Whether somebody else beats when the node's thread is so late."""
        self.now_s = PERIOD_S + late_s
        return self.heart.step_in()


@pytest.fixture
def held():
    held = Held()
    yield held
    held.heart.end()


def test_a_thread_that_beats_in_time_beats_alone(held):
    assert not held.after(0.5 * STEP_IN_S)
    assert held.again == 0


def test_for_a_thread_that_is_held_up_somebody_else_beats_until_it_counts_as_hung(held):
    assert held.after(2.0 * STEP_IN_S)
    assert held.after(0.9 * HELD_UP_S)
    assert not held.after(HELD_UP_S)
    assert held.again == 2


def test_nobody_beats_before_the_first_beat_and_after_the_end(held):
    silent = SteadyHeartbeat(held._beat, PERIOD_S, lambda: held.now_s)
    held.now_s = PERIOD_S + 2.0 * STEP_IN_S
    assert not silent.step_in()
    silent.end()
    held.heart.end()
    assert not held.heart.step_in()


@pytest.mark.ros
def test_the_heart_beats_while_a_request_holds_up_the_thread_of_the_node(start, monkeypatch):
    bench = start()

    def hold_up(bins, box_id):
        before = len(bench.of('executor_state'))
        bench.wait(lambda: len(bench.of('executor_state')) >= before + 5, 'five heartbeats')
        return f'{box_id} is out'

    monkeypatch.setattr(BinWork, 'remove', hold_up)
    answer = bench.call('remove_box', RemoveBox.Request(box_id='x'))
    assert (answer.success, answer.message) == (True, 'x is out')
