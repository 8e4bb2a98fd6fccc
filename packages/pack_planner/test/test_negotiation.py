"""The planner asks the arm before it sends a goal; the coordinator with scripted answers."""

from __future__ import annotations

from dataclasses import replace

import pytest
from coordinator_rig import EMPTY, CoordinatorRig, box

from pack_msgs_py.codes import BoxEventKind, ErrorCode, Mode
from pack_planner.coordination.answers import CheckAnswer
from pack_planner.coordination.negotiation import HIDDEN_TIMEOUT_S, MARGIN_S
from pack_planner.decision.planner import CloseStep

NO_PATH, NO_REACH = ErrorCode.PATH_IN_COLLISION, ErrorCode.NO_IK_SOLUTION
LEFT, RIGHT, BACK = (0, 0, 0), (200, 0, 0), (0, 200, 0)


@pytest.fixture
def rig():
    cell = CoordinatorRig(candidates=8, timeout_s=0.4, deadline_s=5.5)
    cell.bins()
    cell.scan()
    cell.beat()
    return cell


def test_nothing_is_announced_before_the_arm_has_said_that_it_can(rig):
    rig.planned('a')
    assert rig.take() == [('plan', 1), ('check', 1)]
    assert rig.enough_s == 5.5 - MARGIN_S - 0.5, 'planning that nothing hides counts'
    rig.now += 0.2
    rig.answer(4.0)
    assert rig.take() == [('announce', 'a'), ('send', 'a')]
    assert (rig.sent.candidates_checked, rig.sent.first_refusal) == (1, ErrorCode.NONE)
    assert rig.sent.check_s == pytest.approx(0.2)
    assert rig.unhidden_s == pytest.approx(0.7)


def test_the_best_that_the_arm_can_do_in_time_is_taken(rig):
    rig.planned('a')
    assert rig.wanted == 1, 'alternatives cost computing, and mostly nobody needs them'
    rig.answer(NO_PATH)
    assert rig.take() == [('plan', 1), ('check', 1), ('plan', 2)]
    assert rig.wanted == 8
    assert rig.situations[2].forbidden.refused(box('a'), EMPTY)
    rig.planned('a', LEFT, RIGHT, BACK)
    rig.answer(NO_REACH, 7.0, 4.2)
    assert rig.take() == [('check', 2), ('announce', 'a'), ('send', 'a')]
    assert rig.sent.corner_mm == BACK
    assert (rig.sent.candidates_checked, rig.sent.first_refusal) == (4, NO_PATH)
    assert (rig.sent.objective, rig.sent.first_objective) == (200.0, 0.0)
    assert rig.sent.planning_s == 0.5 + 3 * 0.5


def test_a_decision_names_what_it_was_preferred_to_and_why(rig):
    rig.planned('a')
    rig.answer(NO_PATH)
    rig.planned('a', RIGHT, BACK, (200, 200, 0))
    rig.answer(7.0, 4.2, ErrorCode.BUSY)
    assert rig.sent.corner_mm == BACK
    named = [(other.corner_mm, other.refusal) for other in rig.sent.runners_up]
    assert named == [
        (LEFT, NO_PATH),
        (RIGHT, ErrorCode.DEADLINE_UNREACHABLE),
        ((200, 200, 0), ErrorCode.NONE),
    ]


def test_candidates_that_are_refused_are_never_asked_about_again(rig):
    rig.planned('a')
    rig.answer(NO_PATH)
    rig.planned('a', RIGHT, BACK)
    rig.answer(NO_PATH, 6.0)
    refused = rig.situations[3].forbidden.refused(box('a'), EMPTY)
    assert [zone.corner_mm for zone in refused] == [LEFT, RIGHT, BACK]


NOWHERE = CheckAnswer(NO_REACH, predicted=True)
SLOW = CheckAnswer(ErrorCode.DEADLINE_UNREACHABLE, 6.5, predicted=True)


def test_the_first_choice_is_the_best_that_a_prediction_lets_through(rig):
    rig.planned('a', LEFT, RIGHT, BACK)
    assert len(rig.asked[1]) == 3, 'what the algorithm names itself is asked about at once'
    rig.answer(NOWHERE, SLOW, 3.2)
    assert rig.sent.corner_mm == BACK
    assert (rig.sent.candidates_checked, rig.sent.first_refusal) == (3, ErrorCode.NONE)


def test_a_first_choice_that_planning_refuses_is_counted_in_whatever_round(rig):
    rig.planned('a', LEFT, RIGHT)
    rig.answer(NOWHERE, SLOW)
    rig.planned('a', BACK, (200, 200, 0))
    rig.answer(NO_PATH, 4.2)
    assert (rig.sent.corner_mm, rig.sent.first_refusal) == ((200, 200, 0), NO_PATH)


def test_what_only_the_talk_made_late_is_sent_though_it_was_only_predicted(rig):
    rig.planned('a')
    rig.now += 0.3
    rig.answer(CheckAnswer(ErrorCode.DEADLINE_UNREACHABLE, 5.2, predicted=True))
    assert rig.sent.corner_mm == LEFT
    assert rig.situations[1].forbidden.by_bin == {}


def test_what_the_arm_had_no_time_to_look_at_is_not_sent_unasked(rig):
    rig.planned('a', LEFT, RIGHT)
    rig.answer(NO_PATH, ErrorCode.BUSY)
    assert rig.take()[-1] == ('plan', 2)


def test_the_arm_is_asked_about_no_more_than_it_may_be():
    rig = CoordinatorRig(candidates=2)
    rig.bins()
    rig.scan()
    rig.beat()
    rig.planned('a', LEFT, RIGHT, BACK)
    assert [candidate.corner_mm for candidate in rig.asked[1]] == [LEFT, RIGHT]


def test_a_bin_is_closed_when_every_candidate_was_refused(rig):
    rig.planned('a')
    rig.answer(NO_PATH)
    rig.outcome(CloseStep(EMPTY))
    assert rig.take()[-1] == ('swap', 'bin-1')


def test_time_that_the_talk_took_refuses_no_placement_for_good(rig):
    rig.planned('a')
    rig.now += 0.3
    rig.answer(5.2)
    assert rig.sent.corner_mm == LEFT, 'the quickest is sent: the arm decides'
    assert rig.situations[1].forbidden.by_bin == {}


def test_an_answer_that_stays_away_costs_its_time_out_and_no_more(rig):
    rig.planned('a')
    rig.take()
    rig.wait(0.3)
    assert rig.take() == []
    rig.wait(0.2)
    assert rig.take() == [('announce', 'a'), ('send', 'a')]
    assert rig.sent.candidates_checked == 0
    rig.answer(NO_PATH)
    assert rig.take() == [], 'too late'


def test_an_arm_that_cannot_be_asked_gets_the_first_choice(rig):
    rig.planned('a')
    rig.coordinator.on_checked(1, None)
    assert rig.take()[-1] == ('send', 'a')


def test_an_answer_that_is_not_about_the_placement_leaves_it_to_the_goal(rig):
    rig.planned('a')
    rig.answer(ErrorCode.STALE_BIN_REVISION)
    assert rig.take()[-1] == ('send', 'a')
    assert rig.sent.candidates_checked == 0


@pytest.fixture
def moving(rig):
    """The arm carries box a; the planner asks about box b, at the revision that is to come."""
    rig.planned('a')
    rig.answer(4.0)
    rig.coordinator.on_answer(rig.goal_id, accepted=True)
    rig.event('a', BoxEventKind.PICKED)
    rig.scan(['b', 'c'])
    rig.planned('b', RIGHT)
    rig.take()
    return rig


def test_while_the_arm_moves_it_is_asked_about_the_bins_to_come(moving):
    (candidate,) = moving.asked[1]
    assert (candidate.box.id, candidate.bin_revision) == ('b', EMPTY.revision + 1)
    assert moving.enough_s == 5.5 - MARGIN_S, 'the motion hides it'
    moving.wait(HIDDEN_TIMEOUT_S - 0.3, Mode.EXECUTING, 'a')
    assert moving.take() == []
    moving.answer(4.0)
    assert moving.take() == [('announce', 'b')]
    moving.finish()
    assert moving.take() == [('send', 'b')]
    assert moving.unhidden_s == 0.0


def test_an_answer_may_come_a_little_after_the_motion_it_was_hidden_in(moving):
    moving.finish()
    moving.wait(0.2)
    assert moving.take() == []
    moving.answer(4.0)
    assert moving.take() == [('announce', 'b'), ('send', 'b')]
    assert moving.unhidden_s == pytest.approx(0.2, abs=0.11)


def test_the_wait_for_an_answer_ends_soon_after_the_motion(moving):
    moving.wait(1.0, Mode.EXECUTING, 'a')
    moving.finish()
    moving.wait(0.6)
    assert moving.take() == [('announce', 'b'), ('send', 'b')]


def test_what_the_arm_refused_for_the_bins_to_come_still_holds_when_they_have_come(moving):
    moving.answer(NO_PATH)
    moving.finish()
    moving.planned('c', BACK)
    number = max(moving.situations)
    grown = replace(EMPTY, revision=EMPTY.revision + 1)
    assert moving.situations[number].forbidden.refused(box('b'), grown)


def test_answers_about_bins_that_did_not_come_about_are_dropped(moving):
    moving.answer(NO_PATH)
    moving.finish(ErrorCode.GRASP_FAILED)
    moving.scan(['a', 'b'])
    moving.event('a', BoxEventKind.RETURNED)
    last = moving.situations[max(moving.situations)]
    assert last.bins == (EMPTY,)
    assert last.forbidden.refused(box('b'), replace(EMPTY, revision=2)) == ()


def test_without_candidates_the_arm_is_not_asked():
    cell = CoordinatorRig(candidates=0)
    cell.start('a')
    assert cell.sent.candidates_checked == 0
    assert not hasattr(cell, 'asked')
