"""When the planner decides, sends, closes and waits; scripted inputs, a hand-set clock."""

from __future__ import annotations

from dataclasses import replace

import pytest
from planner_cases import SMALL

from pack_msgs_py.cell_values import BinSnapshot, BoxEvent, Decision, Pose, Report, Scan, ScannedBox
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Mode, PlacementStatus, Reason
from pack_msgs_py.values import Bin, Box
from pack_planner.coordinator import BINS_TIMEOUT_S, PATIENCE_S, SILENCE_S, Coordinator
from pack_planner.decide import Close, Place, Reject, Wait, expected_bins
from pack_planner.inputs import Heartbeat
from pack_planner.running import ACCEPT_TIMEOUT_S, FORGOTTEN_S, REPORT_TIMEOUT_S

EMPTY = Bin('bin-1', 1, SMALL)
OK = ErrorCode.NONE


class Cell:
    """A coordinator whose every output is written down, and whose inputs are set by hand."""

    def __init__(self, look_ahead=2):
        self.now = 0.0
        self.done = []
        self.situations = {}
        self.goal_ids = 0
        self.coordinator = Coordinator(self, lambda: self.now, look_ahead)
        self.sequence = 0
        self.bins_now = (EMPTY,)
        self.boxes = ['a', 'b', 'c']
        self.remaining = 5

    # outputs
    def plan(self, number, situation):
        self.situations[number] = situation
        self.done.append(('plan', number))

    def announce(self, decision, bins):
        self.done.append(('announce', decision.box.id))
        return replace(decision, sequence=len(self.done))

    def send(self, decision, target, unhidden_s):
        self.goal_ids += 1
        self.sent = decision
        self.unhidden_s = unhidden_s
        self.done.append(('send', decision.box.id))
        return self.goal_ids.to_bytes(16, 'big')

    def swap(self, target):
        self.done.append(('swap', target.id))

    def refresh_bins(self):
        self.done.append(('refresh',))

    def info(self, text):
        pass

    def warn(self, text):
        self.done.append(('warn', text))

    # inputs
    def take(self):
        done, self.done = self.done, []
        return [entry for entry in done if entry[0] != 'warn']

    def scan(self, boxes=None):
        if boxes is not None:
            self.boxes = list(boxes)
        self.sequence += 1
        items = tuple(ScannedBox(box(name), Pose()) for name in self.boxes)
        self.coordinator.on_scan(Scan(self.sequence, self.now, items, remaining=self.remaining))

    def bins(self, *bins):
        if bins:
            self.bins_now = bins
        self.coordinator.on_bins(BinSnapshot(1, self.now, self.bins_now))

    def beat(self, mode=Mode.IDLE, active=''):
        self.coordinator.on_heartbeat(Heartbeat(mode, active, self.now))

    def event(self, name, kind):
        self.coordinator.on_event(BoxEvent(name, kind, stamp_s=self.now))

    def planned(self, name, corner=(0, 0, 0)):
        number = max(self.situations)
        target = self.situations[number].bins[0]
        decision = Decision(
            box(name), target.id, target.serial, target.revision,
            corner_mm=corner, size_mm=(100, 100, 100), planning_s=0.5,
        )  # fmt: skip
        self.coordinator.on_planned(number, Place(decision))

    def outcome(self, outcome):
        self.coordinator.on_planned(max(self.situations), outcome)

    @property
    def goal_id(self):
        return self.goal_ids.to_bytes(16, 'big')

    def report(self, code=OK):
        self.coordinator.on_report(Report(self.sent.box.id, code=code, goal_id=self.goal_id))

    def finish(self, code=OK):
        """The executor ends the goal: bins, report, result."""
        if code.box_is_in_bin:
            self.bins(*expected_bins(self.bins_now, self.sent))
        self.report(code)
        self.coordinator.on_result(self.goal_id, None)

    def start(self, name='a'):
        """Bring it to a running goal for box ``name``."""
        self.bins()
        self.scan()
        self.beat()
        self.planned(name)
        self.coordinator.on_answer(self.goal_id, accepted=True)
        self.take()

    def refuse(self, code):
        """The executor refuses the goal: report, answer."""
        self.report(code)
        self.coordinator.on_answer(self.goal_id, accepted=False)

    def wait(self, seconds, mode=Mode.IDLE, active=''):
        """Let time pass with a living executor."""
        until = self.now + seconds
        while self.now < until:
            self.now += 0.1
            self.beat(mode, active)


def box(name):
    return Box(name, (100.0, 100.0, 100.0))


@pytest.fixture
def rig():
    return Cell()


@pytest.mark.parametrize('order', ['sbh', 'shb', 'bsh', 'bhs', 'hsb', 'hbs'])
def test_it_decides_as_soon_as_it_has_scan_bins_and_an_idle_arm_in_any_order(rig, order):
    inputs = {'s': rig.scan, 'b': rig.bins, 'h': rig.beat}
    for letter in order[:2]:
        inputs[letter]()
        assert rig.take() == []
    inputs[order[2]]()
    assert rig.take() == [('plan', 1)]
    rig.planned('a')
    assert rig.take() == [('announce', 'a'), ('send', 'a')]
    assert rig.unhidden_s == 0.5


def test_it_offers_only_the_look_ahead(rig):
    rig.start()
    assert [one.id for one in rig.situations[1].boxes] == ['a', 'b']


def test_it_waits_for_a_full_look_ahead_but_not_for_ever(rig):
    rig.bins()
    rig.scan(['a'])
    rig.beat()
    rig.wait(PATIENCE_S - 0.2)
    assert rig.take() == []
    rig.wait(0.4)
    assert rig.take() == [('plan', 1)]


def test_the_end_of_the_stream_is_as_good_as_a_full_look_ahead(rig):
    rig.remaining = 0
    rig.bins()
    rig.scan(['a'])
    rig.beat()
    assert rig.take() == [('plan', 1)]


def test_it_waits_while_the_arm_carries_out_the_goal_of_someone_else(rig):
    rig.bins()
    rig.scan()
    rig.wait(10, Mode.EXECUTING, 'z')
    assert rig.take() == []
    rig.beat()
    assert rig.take() == [('plan', 1)]


@pytest.mark.parametrize('mode', [Mode.INACTIVE, Mode.PROTECTIVE_STOP, Mode.FAULT])
def test_it_waits_while_the_arm_takes_no_goals(rig, mode):
    rig.bins()
    rig.scan()
    rig.wait(3, mode)
    assert rig.take() == []


def test_boxes_that_are_picked_placed_or_rejected_are_not_offered(rig):
    rig.event('a', BoxEventKind.PICKED)
    rig.event('b', BoxEventKind.PLACED)
    rig.event('b', BoxEventKind.RETURNED)
    rig.remaining = 0
    rig.start('b')
    assert [one.id for one in rig.situations[1].boxes] == ['b', 'c']


def test_while_the_arm_moves_it_plans_the_next_box_against_the_expected_bins(rig):
    rig.start('a')
    rig.scan(['b', 'c'])
    assert rig.take() == [], 'not before the box is picked'
    rig.event('a', BoxEventKind.PICKED)
    assert rig.take() == [('plan', 2)]
    ahead = rig.situations[2]
    assert [one.id for one in ahead.boxes] == ['b', 'c']
    assert ahead.bins[0].revision == 1
    assert [placed.box.id for placed in ahead.bins[0].boxes] == ['a']
    rig.planned('b')
    assert rig.take() == [('announce', 'b')], 'so that the belt brings it'
    rig.finish()
    assert rig.take() == [('send', 'b')]
    assert rig.unhidden_s == 0.0


def test_planning_that_the_motion_did_not_hide_counts(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.finish()
    assert rig.take() == [('plan', 2)]
    rig.now += 0.2
    rig.planned('b')
    assert rig.take() == [('announce', 'b'), ('send', 'b')]
    assert rig.unhidden_s == pytest.approx(0.2)


def test_it_plans_ahead_only_when_the_belt_was_refilled(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b'])
    assert rig.take() == []
    rig.scan(['b', 'c'])
    assert rig.take() == [('plan', 2)]


def test_a_plan_made_ahead_is_dropped_when_the_bins_came_out_otherwise(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.planned('b')
    rig.take()
    other = replace(expected_bins((EMPTY,), rig.sent)[0], revision=7)
    rig.bins(other)
    rig.report()
    rig.coordinator.on_result(rig.goal_id, None)
    assert rig.take() == [('plan', 3)]
    assert rig.situations[3].bins[0].revision == 7


def test_a_plan_made_ahead_is_dropped_when_its_box_left_the_belt(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.planned('b')
    rig.take()
    rig.scan(['c', 'd'])
    assert rig.take() == [('plan', 3)]


def test_a_failed_motion_drops_the_plan_made_ahead_and_decides_again_on_new_inputs(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.planned('b')
    rig.take()
    rig.finish(ErrorCode.GRASP_FAILED)
    assert rig.take() == []
    rig.event('a', BoxEventKind.RETURNED)
    rig.scan(['a', 'b'])
    assert rig.take() == [('plan', 3)]
    assert [one.id for one in rig.situations[3].boxes] == ['a', 'b']
    assert rig.situations[3].forbidden.zones == {}


def test_a_box_that_came_back_before_the_report_is_tried_again_at_once(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.event('a', BoxEventKind.RETURNED)
    rig.scan(['a', 'b'])
    rig.take()
    rig.finish(ErrorCode.GRASP_FAILED)
    assert rig.take() == [('plan', 3)]


@pytest.mark.parametrize(
    'code', [ErrorCode.STALE_BIN_REVISION, ErrorCode.BUSY, ErrorCode.BOX_NOT_ON_BELT]
)
def test_a_refusal_that_is_not_about_the_placement_waits_for_new_inputs(rig, code):
    rig.start('a')
    rig.refuse(code)
    assert rig.take() == []
    rig.bins(replace(EMPTY, revision=3))
    assert rig.take() == [('plan', 2)]
    assert rig.situations[2].forbidden.zones == {}


@pytest.mark.parametrize(
    'code',
    [ErrorCode.RULE_VIOLATION, ErrorCode.NO_IK_SOLUTION, ErrorCode.DEADLINE_UNREACHABLE],
)
def test_a_refused_placement_is_not_offered_again_until_the_bin_changes(rig, code):
    rig.start('a')
    rig.refuse(code)
    assert rig.take() == [('plan', 2)]
    zones = rig.situations[2].forbidden.refused(box('a'), EMPTY)
    assert [zone.corner_mm for zone in zones] == [(0, 0, 0)]
    rig.planned('a', (100, 0, 0))
    rig.refuse(code)
    assert len(rig.situations[3].forbidden.refused(box('a'), EMPTY)) == 2
    rig.planned('a', (200, 0, 0))
    rig.refuse(code)
    assert rig.situations[4].forbidden(box('a'), EMPTY) is None
    rig.bins(replace(EMPTY, revision=5))
    rig.planned('b')
    assert rig.situations[5].forbidden.zones == {}


def test_a_refusal_without_goal_id_is_matched_by_box_and_revision(rig):
    rig.start('a')
    rig.coordinator.on_report(Report('a', 'bin-1', 1, 0, ErrorCode.NO_IK_SOLUTION))
    rig.coordinator.on_answer(rig.goal_id, accepted=False)
    assert rig.take() == [('plan', 2)]


def test_a_box_that_the_executor_knows_to_be_in_a_bin_is_not_offered_again(rig):
    rig.start('a')
    rig.refuse(ErrorCode.DUPLICATE_BOX)
    rig.scan()
    assert [one.id for one in rig.situations[2].boxes] == ['b', 'c']


def test_nothing_fits_closes_the_bin_and_waits_for_the_new_one(rig):
    full = replace(EMPTY, revision=4)
    rig.bins(full)
    rig.scan()
    rig.beat()
    rig.outcome(Close(full))
    assert rig.take() == [('plan', 1), ('swap', 'bin-1')]
    rig.scan()
    assert rig.take() == []
    rig.coordinator.on_swapped(success=True, message='')
    assert rig.take() == [], 'the new bin is not there yet'
    rig.bins(Bin('bin-2', 2, SMALL))
    assert rig.take() == [('plan', 2)]


def test_a_bin_is_never_closed_while_a_goal_runs(rig):
    rig.start('a')
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.outcome(Close(rig.situations[2].bins[0]))
    assert rig.take() == [('plan', 2)]
    rig.finish()
    assert rig.take() == [('swap', 'bin-1')]


def test_a_refused_swap_decides_again(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.outcome(Close(EMPTY))
    rig.coordinator.on_swapped(success=False, message='busy')
    rig.take()
    rig.scan()
    assert rig.take() == [('plan', 2)]


def test_a_rejected_box_is_announced_and_no_longer_offered(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    decision = Decision(
        box('a'), status=PlacementStatus.REJECT, reject_reason=Reason.OVERSIZE, reason='too large'
    )
    rig.outcome(Reject(decision))
    assert rig.take() == [('plan', 1), ('announce', 'a'), ('plan', 2)]
    assert [one.id for one in rig.situations[2].boxes] == ['b', 'c']


def test_a_silent_executor_is_forgotten_with_its_goal_and_asked_for_its_bins(rig):
    rig.start('a')
    rig.now += SILENCE_S + 0.1
    rig.scan()
    assert rig.take() == []
    rig.report()
    rig.scan()
    assert rig.take() == []
    rig.beat()
    assert rig.take() == [('refresh',)]
    rig.scan()
    assert rig.take() == [], 'the bins of before may be wrong'
    rig.bins()
    assert rig.take() == [('plan', 2)]


def test_death_of_the_executor_during_planning_drops_the_decision(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.coordinator.on_executor_lost()
    rig.planned('a')
    assert rig.take() == [('plan', 1)]


def test_an_unanswered_goal_is_given_up(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.planned('a')
    rig.take()
    rig.wait(ACCEPT_TIMEOUT_S + 0.2)
    rig.scan()
    assert rig.take() == [('plan', 2)]


def test_a_refusal_without_a_report_is_given_up(rig):
    rig.start('a')
    rig.coordinator.on_answer(rig.goal_id, accepted=False)
    rig.wait(REPORT_TIMEOUT_S + 0.2)
    rig.scan()
    assert rig.take() == [('plan', 2)]


def test_a_goal_whose_result_got_lost_is_given_up(rig):
    rig.start('a')
    rig.wait(20, Mode.EXECUTING, 'a')
    rig.scan()
    assert rig.take() == []
    rig.wait(FORGOTTEN_S + 0.2)
    rig.scan()
    assert rig.take() == [('plan', 2)]


def test_a_bin_that_does_not_change_as_reported_does_not_stop_the_cell(rig):
    rig.start('a')
    rig.report()
    rig.coordinator.on_result(rig.goal_id, None)
    rig.wait(BINS_TIMEOUT_S - 0.2)
    rig.scan(['b', 'c'])
    assert rig.take() == []
    rig.wait(0.5)
    assert rig.take() == [('plan', 2)]


def test_a_decision_that_failed_is_tried_again_with_the_next_input(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.coordinator.on_planned(1, None, 'ValueError: broken')
    rig.take()
    rig.scan()
    assert rig.take() == [('plan', 2)]


def test_waiting_is_reconsidered_with_the_next_scan(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.outcome(Wait('nothing'))
    assert rig.take() == [('plan', 1)]
    rig.scan()
    assert rig.take() == [('plan', 2)]


def test_a_decision_for_bins_that_changed_meanwhile_is_made_again(rig):
    rig.bins()
    rig.scan()
    rig.beat()
    rig.bins(replace(EMPTY, revision=9))
    rig.planned('a')
    assert rig.take() == [('plan', 1), ('plan', 2)]
