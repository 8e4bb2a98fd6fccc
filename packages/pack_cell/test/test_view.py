"""What the live page makes of what it hears."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from view_cases import (
    BOX,
    PLACED,
    Clock,
    beat,
    bins_of,
    box,
    decision_for,
    event_for,
    new_view,
    report_for,
    scan_of,
    urdf,
)

from arm_executor.model.kinematics import CellKinematics
from arm_executor.model.layout import Layout, bin_frame
from arm_executor.model.robot_data import ROBOTS
from arm_executor.model.robot_shapes import read_urdf
from arm_executor.model.tree import CELL_JOINT_NAMES
from pack_cell.view.banner import LOOKS, Tone
from pack_cell.view.cell_view import CellView
from pack_cell.view.live_figures import WINDOW, LiveFigures
from pack_cell.view.plain_words import ENDINGS, REASONS
from pack_cell.view.scene import LAST, NEXT, Batch, drawn_cell
from pack_cell.view.side import alarms_html, figures_html, lately_html, why_html, why_lines
from pack_cell.watching.cell_watch import HEARTBEAT_SILENCE_S, CellWatch
from pack_msgs_py.alarms import Alarm
from pack_msgs_py.cell_values import BinSnapshot, RunnerUp
from pack_msgs_py.codes import (
    BoxEventKind,
    Condition,
    ErrorCode,
    Mode,
    PlacementStatus,
    Reason,
)
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin, parse_bin

A, B = box(1), box(2)


# -- the banner ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('mode', 'message', 'word', 'tone'),
    [
        (Mode.EXECUTING, '', 'RUN', Tone.RUN),
        (Mode.IDLE, '', 'RUN', Tone.RUN),
        (Mode.INACTIVE, 'starting', 'STARTING', Tone.IDLE),
        (Mode.PAUSED, 'PAUSED by somebody', 'PAUSED', Tone.PAUSED),
        (Mode.ALARM, 'a box is lost', 'WAITING FOR OPERATOR', Tone.OPERATOR),
        (Mode.PROTECTIVE_STOP, 'stopped by somebody', 'WAITING FOR OPERATOR', Tone.OPERATOR),
        (Mode.FAULT, 'no journal', 'FAULT', Tone.FAULT),
    ],
)
def test_each_mode_has_its_word_and_colour_and_one_action(mode, message, word, tone):
    view = new_view()
    beat(view, mode, message=message)
    banner = view.banner()
    assert (banner.word, banner.tone) == (word, tone)
    assert banner.action and '\n' not in banner.action


def test_every_condition_of_a_cell_has_a_word_and_a_colour():
    assert set(LOOKS) == set(Condition)


@pytest.mark.parametrize(
    ('mode', 'button'),
    [(Mode.PROTECTIVE_STOP, 'Reset'), (Mode.PAUSED, 'Resume'), (Mode.ALARM, 'Acknowledge')],
)
def test_what_is_done_with_a_button_names_the_button(mode, button):
    view = new_view()
    beat(view, mode)
    assert view.banner().action.endswith(f'press {button}')


def test_a_cell_that_falls_silent_is_a_fault_and_no_longer_runs():
    clock = Clock()
    view = new_view(clock)
    beat(view, Mode.EXECUTING, A.id)
    clock.now_s += HEARTBEAT_SILENCE_S + 0.1
    assert view.banner().tone is Tone.FAULT
    beat(view, Mode.EXECUTING, A.id)
    assert view.banner().tone is Tone.RUN


def test_without_any_node_the_page_says_where_it_listens_and_how_to_start_a_cell():
    banner = CellView(CellWatch(Clock()), domain=42).banner()
    assert '42' in banner.now and 'cell run' in banner.action


def test_a_bin_that_is_held_stands_on_until_it_is_closed():
    """It may not be filled, so that the arm does not say it any more; a person releases it."""
    first, second = (Bin(f'LDC-{n}', n, parse_bin('LDC'), (), s) for n, s in ((1, 'A'), (2, 'B')))
    view = new_view()
    view.on_bins(BinSnapshot(1, 1.0, (first, second)))
    view.on_bins(BinSnapshot(2, 2.0, (second,)))
    assert view.bins == (first, second)
    after = replace(first, id='LDC-3', serial=3)
    view.on_bins(BinSnapshot(3, 3.0, (second, after)))
    assert view.bins == (second, after)
    view.on_bins(BinSnapshot(4, 4.0, (after,)))
    view.on_closed(second)
    assert view.bins == (after,)


def test_the_end_of_the_stream_is_no_waiting_for_boxes():
    view = new_view()
    view.on_scan(scan_of(remaining=3))
    assert view.banner().action == 'Lay boxes on the belt'
    view.on_scan(scan_of(remaining=0))
    assert view.banner().word == 'DONE'


def test_the_banner_names_box_and_bin_under_way():
    view = new_view()
    view.on_scan(scan_of(A))
    view.on_decision(decision_for(A))
    beat(view, Mode.EXECUTING, A.id)
    assert view.banner().now == 'Packing box-1 into LDC-1'


# -- figures ---------------------------------------------------------------------------------------


def test_what_is_heard_twice_counts_once():
    view = new_view()
    for _ in range(2):
        view.on_decision(decision_for(A))
        view.on_report(report_for(A))
        view.on_event(event_for(A, BoxEventKind.PLACED))
        view.on_event(event_for(B, BoxEventKind.REJECTED, reason=Reason.OVERSIZE))
        view.on_closed(Bin('LDC-1', 1, parse_bin('LDC'), (PLACED,)))
    figures = view.figures
    assert (figures.placed, len(figures.planning_s), len(figures.slack_s)) == (1, 1, 1)
    assert figures.rejects == {Reason.OVERSIZE: 1}
    assert figures.boxes_per_hour == pytest.approx(900)
    assert figures.fill_closed == pytest.approx(BOX.volume_mm3 / parse_bin('LDC').volume_mm3)


@given(st.lists(st.floats(0.001, 5.0), min_size=1, max_size=3 * WINDOW))
def test_p95_is_of_the_last_decisions_and_one_of_them(times):
    figures = LiveFigures()
    for seconds in times:
        figures.planning_s.append(seconds)
    recent, p95 = times[-WINDOW:], figures.planning_p95_s
    assert p95 in recent
    assert sum(seconds <= p95 for seconds in recent) >= 0.95 * len(recent)
    assert sum(seconds < p95 for seconds in recent) < 0.95 * len(recent)


def test_before_the_first_box_the_figures_are_dashes():
    assert figures_html(new_view()).count('<b>–</b>') == 5


def test_the_fill_of_the_open_bins_is_that_of_their_room_together():
    view = new_view()
    view.on_bins(bins_of(PLACED))
    alone = view.bins[0].fill_rate
    assert view.fill_now == pytest.approx(alone)
    view.on_bins(replace(bins_of(PLACED), bins=(view.bins[0], replace(view.bins[0], boxes=()))))
    assert view.fill_now == pytest.approx(alone / 2)


# -- the scene -------------------------------------------------------------------------------------


def colours_of(batch: Batch) -> list[tuple[float, ...]]:
    return [tuple(row) for row in batch.colours.tolist()]


def test_the_box_that_came_last_and_the_one_that_comes_next_stand_out():
    view = new_view()
    view.on_bins(bins_of(PLACED))
    view.on_event(event_for(BOX, BoxEventKind.PLACED))
    view.on_scan(scan_of(A, B))
    view.on_decision(decision_for(B))
    drawn = drawn_cell(view, Layout())
    assert colours_of(drawn.placed) == [LAST[:3]]
    assert [colour == NEXT[:3] for colour in colours_of(drawn.waiting)] == [False, True]
    assert len(drawn.ghosts) == 1


def test_a_ghost_stands_where_the_box_will_in_the_frame_of_its_station():
    view = new_view()
    view.on_bins(bins_of(station='C'))
    view.on_decision(decision_for(A))
    expected = bin_frame(Layout(), 'C', parse_bin('LDC')).to_cell(Pose((0.155, 0.105, 0.05)))
    assert drawn_cell(view, Layout()).ghosts.centres[0] == pytest.approx(expected.position)


def test_while_a_box_is_carried_its_place_and_that_of_the_next_are_shown():
    view = new_view()
    view.on_joints(dict.fromkeys(CELL_JOINT_NAMES, 0.1))
    view.on_bins(bins_of())
    view.on_scan(scan_of(A, B))
    view.on_decision(decision_for(A))
    view.on_event(event_for(A, BoxEventKind.PICKED))
    view.on_decision(decision_for(B, stamp_s=4.0))
    assert {decision.box.id for decision in view.planned} == {A.id, B.id}
    assert view.held is not None and view.held.box == A
    assert len(drawn_cell(view, Layout()).waiting) == 1, 'what is held is not on the belt'
    view.on_event(event_for(A, BoxEventKind.PLACED, stamp_s=5.0))
    assert [decision.box.id for decision in view.planned] == [B.id]
    assert view.held is None


def test_a_decision_that_is_withdrawn_leaves_no_ghost():
    view = new_view()
    view.on_bins(bins_of())
    view.on_decision(decision_for(A))
    view.on_decision(decision_for(B, stamp_s=3.0))
    view.on_decision(decision_for(A, status=PlacementStatus.REJECT, bin_id='', stamp_s=4.0))
    assert view.planned == ()


def test_boxes_on_the_belt_are_labelled_with_their_order_and_their_laps():
    view = new_view()
    view.on_scan(scan_of(A, B, laps=2))
    texts = [label.text for label in drawn_cell(view, Layout()).labels]
    assert texts == ['1 · 2 laps', '2 · 2 laps']


def test_edges_of_a_turned_box_have_its_lengths():
    turned = Batch(
        np.array([[1.0, 2.0, 3.0]]),
        np.array([[0.3, 0.2, 0.1]]),
        np.array([[0.0, 0.0, np.sin(0.3), np.cos(0.3)]]),
        np.zeros((1, 3)),
    )
    ends = turned.edges()
    lengths = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    assert sorted(np.round(lengths, 9)) == [0.1] * 4 + [0.2] * 4 + [0.3] * 4
    assert ends.reshape(-1, 3).mean(axis=0) == pytest.approx([1.0, 2.0, 3.0])


# -- the robot -------------------------------------------------------------------------------------


@settings(deadline=None)
@given(st.lists(st.floats(-2.0, 2.0), min_size=7, max_size=7))
def test_the_drawn_robot_stands_like_the_one_that_is_planned_with(positions):
    robot = read_urdf(urdf())
    turn = robot.turn_of('tcp', dict(zip(CELL_JOINT_NAMES, positions, strict=True)))
    kinematics = CellKinematics(ROBOTS['ur20'], Layout())
    assert turn == pytest.approx(kinematics.tool(positions)[0][:3, :3], abs=1e-6)


def test_every_link_with_a_shape_hangs_on_the_robot():
    robot = read_urdf(urdf())
    assert {shape.link for shape in robot.shapes} > {'carriage', 'forearm_link', 'tool'}
    assert all(robot.path(shape.link).startswith('/carriage') for shape in robot.shapes)
    assert robot.path('tcp').endswith('/wrist_3_link/flange/tool0/tool/tcp')


@pytest.mark.parametrize(
    'text', ['', '<robot', '<robot><joint name="a"/></robot>'.replace('/>', '')]
)
def test_what_is_no_urdf_is_refused(text):
    with pytest.raises(ValueError, match='robot_description'):
        read_urdf(text)


def test_joints_in_a_circle_are_refused():
    ends = '<joint name="{0}" type="fixed"><parent link="{0}"/><child link="{1}"/></joint>'
    with pytest.raises(ValueError, match='circle'):
        read_urdf(f'<robot>{ends.format("a", "b")}{ends.format("b", "a")}</robot>')


# -- words -----------------------------------------------------------------------------------------


def test_every_code_has_plain_words():
    assert set(ENDINGS) == set(ErrorCode) and set(REASONS) == set(Reason)


def test_why_says_in_plain_words_what_the_arm_would_not_do_and_what_fills_less_well():
    refused = RunnerUp(A.id, 'LDC-1', (0, 10, 20), 90.0, ErrorCode.PATH_IN_COLLISION)
    view = new_view()
    view.on_decision(
        decision_for(B, candidates_checked=2, runners_up=(refused, RunnerUp(A.id, 'LDC-2')))
    )
    html = why_html(view)
    assert 'box-1 → LDC-1 at x 0, y 10, z 20' in html and 'something is in the way' in html
    assert 'fills less well' in html
    assert why_lines(decision_for(A))[-1] == 'The arm was not asked before'


def test_names_of_boxes_are_no_markup():
    view = new_view()
    view.on_event(event_for(BOX, BoxEventKind.LOST))
    view.on_decision(decision_for(BOX))
    for html in (why_html(view), lately_html(view)):
        assert '<b>small' not in html and '&lt;b&gt;small &amp; brown' in html


def test_alarms_stand_until_the_node_says_that_they_are_over_and_happenings_stay_below():
    view = new_view()
    view.on_report(report_for(A, ErrorCode.NONE))
    view.on_report(report_for(B, ErrorCode.GRASP_FAILED))
    assert [one.code for one in view.happenings] == ['GRASP_FAILED']
    lost = Alarm('BOX_LOST', 'box-1 is lost', action='Find the box, then: cell ack')
    view.watch.on_alarms('/arm_executor', (lost,))
    html = alarms_html(view)
    assert 'Find the box, then press Acknowledge' in html and 'grave' in html
    assert view.banner().word == 'WAITING FOR OPERATOR'
    view.watch.on_alarms('/arm_executor', ())
    assert 'box-1 is lost' not in alarms_html(view) and 'take hold' in lately_html(view)
