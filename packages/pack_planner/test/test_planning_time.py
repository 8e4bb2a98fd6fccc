"""Where the arm moves as fast as possible, planning counts by what was done, on no clock."""

from __future__ import annotations

from dataclasses import replace

import pytest
from coordinator_rig import CoordinatorRig

from pack_msgs_py.cell_values import MOTION_PLAN_S, Report
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Mode
from pack_planner.coordination.answers import CheckAnswer
from pack_planner.coordination.negotiation import MARGIN_S
from pack_planner.coordination.planning_time import (
    AFTER_PICK_SHARE,
    DECISION_S,
    PREDICTION_S,
    PlanningTime,
)
from pack_planner.parameters import SLOWEST_MACHINE, PlannerParameters, counted_node_s, settings

COUNTED = PlanningTime(node_s=0.001)


@pytest.fixture
def rig():
    cell = CoordinatorRig(candidates=8, timeout_s=0.4, deadline_s=5.5, time=COUNTED)
    cell.bins()
    cell.scan()
    cell.beat()
    return cell


def report_of_motion(rig, motion_s):
    """The running goal ends with its box in its bin, after so much motion."""
    report = Report(rig.sent.box.id, goal_id=rig.goal_id, stamp_s=rig.now, motion_s=motion_s)
    rig.coordinator.on_report(report)
    rig.coordinator.on_result(rig.goal_id, None)
    rig.bins(replace(rig.bins_now[0], revision=rig.bins_now[0].revision + 1))


def test_a_slow_machine_makes_no_goal_late(rig):
    rig.planned('a', nodes=100)
    assert rig.enough_s == pytest.approx(5.5 - MARGIN_S - DECISION_S - 0.1)
    rig.now += 20.0
    rig.beat()
    rig.answer(4.0)
    assert rig.take()[-1] == ('send', 'a'), 'the answer was waited for'
    spent_s = DECISION_S + 0.1 + PREDICTION_S + MOTION_PLAN_S
    assert rig.unhidden_s == pytest.approx(spent_s)
    assert (rig.sent.planning_s, rig.sent.check_s) == (0.5, 20.0), 'the clock is recorded'


def test_a_motion_hides_what_follows_its_pick_whether_the_clock_saw_it_or_not(rig):
    rig.planned('a')
    rig.answer(4.0)
    rig.coordinator.on_answer(rig.goal_id, accepted=True)
    report_of_motion(rig, 4.0)
    rig.scan(['b', 'c'])
    rig.beat()
    rig.planned('b', nodes=3000)
    rig.answer(4.0)
    spent_s = DECISION_S + 3.0 + PREDICTION_S + MOTION_PLAN_S
    assert rig.unhidden_s == pytest.approx(spent_s - AFTER_PICK_SHARE * 4.0)


def test_what_is_planned_ahead_and_takes_longer_than_the_motion_hides_is_not_free(rig):
    rig.planned('a')
    rig.answer(4.0)
    rig.coordinator.on_answer(rig.goal_id, accepted=True)
    rig.event('a', BoxEventKind.PICKED)
    rig.beat(Mode.EXECUTING, 'a')
    rig.scan(['b', 'c'])
    rig.planned('b', nodes=4000)
    rig.answer(4.0)
    rig.finish()
    rig.beat()
    assert rig.take()[-1] == ('send', 'b')
    assert rig.unhidden_s == pytest.approx(4.0, abs=0.1), 'a motion of no time hides nothing'


def test_only_what_the_arm_looked_at_counts():
    answers = [
        CheckAnswer(ErrorCode.DEADLINE_UNREACHABLE, 6.0, predicted=True),
        CheckAnswer(ErrorCode.NONE, 4.0),
        CheckAnswer(ErrorCode.BUSY),
    ]
    assert COUNTED.of_answers(answers, 9.0) == pytest.approx(2 * PREDICTION_S + MOTION_PLAN_S)
    assert PlanningTime().of_answers(answers, 9.0) == 9.0


def test_at_speed_0_the_budget_is_counted_in_nodes():
    slow = PlannerParameters(algorithm='foresight', budget_s=0.5)
    fast = replace(slow, speed=0.0)
    node_s = counted_node_s(fast)
    assert node_s is not None
    assert node_s > 0
    assert settings(slow).node_limit is None
    assert settings(fast).node_limit == round(0.5 / node_s)
    assert settings(fast).budget_s == 0.5 * SLOWEST_MACHINE
    assert settings(replace(fast, node_limit=7)).node_limit == 7


def test_what_counts_no_nodes_goes_by_the_clock_unless_it_is_quick():
    assert counted_node_s(PlannerParameters(algorithm='dbl', speed=0.0)) == 0.0
    solver = PlannerParameters(algorithm='mpack_lite', backend='cp_sat', speed=0.0)
    assert counted_node_s(solver) is None
    assert counted_node_s(PlannerParameters(algorithm='foresight', speed=1.0)) is None
