"""Values survive the trip through messages; bad messages are refused with the value."""

import math
from dataclasses import replace

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from pack_msgs.action import PlaceBox
from pack_msgs.msg import Alarm as AlarmMsg
from pack_msgs.msg import (
    BinState,
    BoxScan,
    ExecutorState,
    PlacementDecision,
)
from pack_msgs.msg import BoxEvent as BoxEventMsg
from pack_msgs.msg import CellState as CellStateMsg
from pack_msgs.msg import NodeState as NodeStateMsg
from pack_msgs.srv import Operate
from pack_msgs_py import codes
from pack_msgs_py.alarms import MOST_WARNINGS, Alarm, raised, with_new
from pack_msgs_py.cell_state import CellState, NodeState
from pack_msgs_py.cell_values import (
    BinSnapshot,
    BoxEvent,
    Decision,
    Report,
    RunnerUp,
    Scan,
    ScannedBox,
)
from pack_msgs_py.checks import InvalidValue
from pack_msgs_py.closing import Cause, ClosingReason
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.ros import conversions as conv
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

BOX = Box('carton 1', (590.5, 390.0, 270.25), 6.8, (1.0, -2.0, 0.0), 48, 120.0, 'north')
POSE = Pose((0.3, 0.2, 0.1), (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))


def test_a_box_survives():
    assert conv.box_from_ros(conv.box_to_ros(BOX)) == BOX


def test_an_unknown_top_load_survives():
    box = Box('b', (100, 100, 100))
    assert conv.box_from_ros(conv.box_to_ros(box)).max_top_load_n is None


def test_a_scan_survives():
    box = replace(BOX, size_stddev_mm=(2.0, 2.0, 1.5), yaw_stddev_rad=0.005)
    item = ScannedBox(box, POSE, 12.5, None, 1.25, 3)
    scan = Scan(7, 100.25, (item,), 'cell', (0.0, -1.0, 0.0), 12, 28)
    assert conv.scan_from_ros(conv.scan_to_ros(scan)) == (scan, [])


def test_what_others_know_of_a_box_goes_with_it():
    known = (('barcode', '4006381333931'), ('scan_confidence', '0.97'), ('gift', 'ja'))
    box = replace(BOX, extra=known)
    scan, _ = conv.scan_from_ros(conv.scan_to_ros(Scan(7, 100.25, (ScannedBox(box, POSE),))))
    decision = conv.decision_from_ros(conv.decision_to_ros(Decision(scan.boxes[0].box)))
    order = conv.placement_from_ros(conv.placement_to_ros(decision))
    placed = PlacedBox(order.box, (0, 0, 0), (600, 400, 271), measured_mm=(300.0, 200.0, 100.0))
    bin_ = conv.bin_from_ros(
        conv.bin_to_ros(
            Bin('LDC-1', 1, parse_bin('LDC'), (placed,)), {box.id: POSE}, conv.time_to_ros(1.0),
            codes.BinStatus.OPEN,
        )
    )  # fmt: skip
    report = Report(box.id, attributes=bin_.boxes[0].box.extra)
    assert conv.report_from_ros(conv.report_to_ros(report)).attributes == known


@pytest.mark.parametrize(
    ('attributes', 'text'),
    [
        ((('', 'x'),), 'must not be empty'),
        ((('a', 'x'), ('a', 'y')), 'each be there once'),
        (tuple((f'key {n}', 'x') for n in range(65)), 'there are 65 of them'),
    ],
)
def test_attributes_that_cannot_be_told_apart_are_refused(attributes, text):
    msg = conv.box_to_ros(replace(BOX, extra=attributes))
    with pytest.raises(InvalidValue, match=text):
        conv.box_from_ros(msg)


def test_a_duration_is_kept_within_what_its_message_holds():
    assert conv.duration_from_ros(conv.duration_to_ros(-1.25), 'slack', low=-2.0) == -1.25
    assert conv.duration_to_ros(math.inf).sec == 2**31 - 1


def test_a_duration_below_zero_is_taken_only_where_there_can_be_one():
    with pytest.raises(InvalidValue, match=r'cycle_time is -1.25 s; it must be'):
        conv.duration_from_ros(conv.duration_to_ros(-1.25), 'cycle_time')


def test_bins_survive_with_measured_poses():
    placed = PlacedBox(BOX, (0, 0, 0), (600, 400, 271), 'xyz', (300.0, 200.0, 100.0))
    bin_ = Bin('LDC-2', 2, parse_bin('LDC'), (placed,), 'B', 5, 'north')
    snapshot = BinSnapshot(9, 50.5, (bin_,))
    msg = conv.bins_to_ros(snapshot, {BOX.id: POSE})
    assert conv.bins_from_ros(msg) == snapshot


def test_bins_that_do_not_accept_boxes_are_left_out_and_the_rest_come_oldest_first():
    bins = tuple(
        Bin(f'EQ-{n}', n, parse_bin('EQ'), station=s) for n, s in ((3, 'A'), (2, 'B'), (1, 'C'))
    )
    msg = conv.bins_to_ros(BinSnapshot(1, 0.0, bins), {}, {'EQ-1': codes.BinStatus.BLOCKED})
    assert [bin_.id for bin_ in conv.bins_from_ros(msg).bins] == ['EQ-2', 'EQ-3']


def test_a_decision_survives():
    decision = Decision(
        BOX,
        'LDC-1',
        1,
        4,
        'yxz',
        (10, 20, 30),
        (400, 600, 271),
        POSE,
        123.5,
        'mpack_lite',
        'cell',
        codes.PlacementStatus.BUDGET,
        0.002,
        8,
        3,
        10.5,
        10.25,
        'least increase',
        runners_up=(
            RunnerUp('other', 'LDC-1', (0, 20, 5), 120.0, codes.ErrorCode.NO_IK_SOLUTION),
            RunnerUp('third', 'LDC-2', (7, 0, 0), 140.0),
        ),
    )
    assert conv.decision_from_ros(conv.decision_to_ros(decision)) == decision


def test_a_reason_for_closing_survives_and_says_it_in_words():
    reason = ClosingReason(
        'LDC-3', {Cause.TOO_HIGH: 3, Cause.TOO_SLOW: 2}, 45,
        {ErrorCode.DEADLINE_UNREACHABLE: 20}, 8.0,
    )  # fmt: skip
    msg = conv.closing_to_ros(reason)
    assert conv.closing_from_ros(msg) == reason
    assert msg.message == (
        'nothing fits: 3 of 5 boxes too high, 2 refused by the arm for the time; '
        'arm refused 20 of 45 places, all for time: try --deadline 8'
    )


@pytest.mark.parametrize(
    ('name', 'key', 'value'),
    [
        ('', 'asked', '1'),
        ('LDC-3', 'asked', 'many'),
        ('LDC-3', 'boxes.magic', '1'),
        ('LDC-3', 'refused.MAGIC', '1'),
    ],
)
def test_a_reason_for_closing_that_makes_no_sense_is_refused(name, key, value):
    msg = DiagnosticStatus(name=name, values=[KeyValue(key=key, value=value)])
    with pytest.raises(InvalidValue, match=r'names no bin|LDC-3'):
        conv.closing_from_ros(msg)


def test_an_event_survives():
    event = BoxEvent(
        'b', codes.BoxEventKind.REJECTED, codes.Reason.OVERSIZE, 'too long', '', 0, 3.5
    )
    assert conv.event_from_ros(conv.event_to_ros(event)) == event


@pytest.mark.parametrize('measured', [POSE, None])
def test_a_report_survives(measured):
    report = Report(
        'b',
        'LDC-1',
        1,
        4,
        codes.ErrorCode.DEADLINE_MISSED,
        'late',
        POSE,
        measured,
        0.001,
        0.002,
        0.003,
        0.1,
        0.2,
        4.5,
        4.6,
        -0.1,
        bytes(range(16)),
        99.5,
    )
    assert conv.report_from_ros(conv.report_to_ros(report)) == report


@pytest.mark.parametrize('value', [math.nan, math.inf, -1.0, 0.0])
def test_one_bad_box_does_not_cost_the_others_of_a_scan(value):
    good, bad = ScannedBox(BOX, POSE), ScannedBox(Box('bad', (100, 100, 100)), POSE)
    msg = conv.scan_to_ros(Scan(1, 0.0, (bad, good)))
    msg.boxes[0].box.size.y = value
    scan, errors = conv.scan_from_ros(msg)
    assert [item.box.id for item in scan.boxes] == [BOX.id]
    assert len(errors) == 1
    assert 'bad' in errors[0]


def test_a_repeated_id_in_a_scan_is_kept_once_and_told():
    item = ScannedBox(BOX, POSE)
    scan, errors = conv.scan_from_ros(conv.scan_to_ros(Scan(1, 0.0, (item, item))))
    assert len(scan.boxes) == 1
    assert 'twice' in errors[0]


def test_a_quaternion_must_have_length_one():
    msg = conv.decision_to_ros(Decision(BOX, target=Pose((0, 0, 0), (0, 0, 0, 2.0))))
    with pytest.raises(ValueError, match=r'length 2\.0'):
        conv.decision_from_ros(msg)


def test_planned_geometry_must_be_whole_millimetres():
    msg = conv.decision_to_ros(Decision(BOX, size_mm=(600, 400, 271)))
    msg.placement.planned_corner.x = 0.0105
    with pytest.raises(ValueError, match=r'10\.500 mm'):
        conv.decision_from_ros(msg)


def test_a_bin_whose_size_contradicts_its_name_is_refused():
    msg = conv.bin_to_ros(
        Bin('EQ-1', 1, parse_bin('EQ')), {}, conv.time_to_ros(0.0), codes.BinStatus.OPEN
    )
    msg.size.x = 1.0
    with pytest.raises(ValueError, match='EQ'):
        conv.bin_from_ros(msg)


@pytest.mark.parametrize('kind', ['RC', 'PAL', '120x80x150:pallet', '120x80x150:cage', 'EQ:cage'])
def test_the_walls_of_a_bin_travel_with_the_name_of_its_kind(kind):
    sent = Bin('b', 1, parse_bin(kind))
    msg = conv.bin_to_ros(sent, {}, conv.time_to_ros(0.0), codes.BinStatus.OPEN)
    assert conv.bin_from_ros(msg) == sent


def test_an_empty_scan_message_is_an_empty_scan():
    assert conv.scan_from_ros(BoxScan())[0].boxes == ()


@pytest.mark.parametrize('seconds', [0.0, 0.999999999, 12.3456, 1e9 + 0.25])
def test_times_survive_within_a_microsecond(seconds):
    assert conv.time_from_ros(conv.time_to_ros(seconds)) == pytest.approx(seconds, abs=1e-6)


@pytest.mark.parametrize('seconds', [0.0, 0.999999999, 12.3456, 1e5 + 0.25])
def test_durations_survive_within_a_microsecond(seconds):
    assert conv.duration_from_ros(conv.duration_to_ros(seconds)) == pytest.approx(seconds, abs=1e-6)


def test_the_state_of_the_cell_and_its_alarms_survive():
    alarm = Alarm('BOX_LOST', 'box 7 fell', codes.Severity.ALARM, 'look', '7', 'LDC-1', 12.5)
    nodes = (NodeState('/planner', codes.Level.OK, 'waiting', 'the arm'), NodeState('/conveyor'))
    state = CellState(codes.Condition.ALARM, 'an alarm', 'cell ack', nodes, (alarm,), 13.25)
    assert conv.cell_state_from_ros(conv.cell_state_to_ros(state)) == state
    sent = conv.alarms_to_ros('/arm_executor', (alarm,), 13.25)
    assert conv.alarms_from_ros(sent) == ('/arm_executor', (alarm,))


def test_an_alarm_without_a_code_is_refused_with_its_message():
    with pytest.raises(InvalidValue, match='without a code'):
        conv.alarm_from_ros(AlarmMsg(severity=2, message='what?'))


def test_alarms_stand_however_many_warnings_come():
    standing = with_new((), raised('COLLISION', 'at the rim', 1.0))
    for number in range(3 * MOST_WARNINGS):
        standing = with_new(standing, raised('GRASP_FAILED', '', 2.0, box_id=str(number)))
    assert [alarm.code for alarm in standing if alarm.blocks] == ['COLLISION']
    assert len(standing) == 1 + MOST_WARNINGS and standing[-1].box_id == str(3 * MOST_WARNINGS - 1)


def test_the_same_trouble_with_the_same_box_stands_once_with_its_latest_words():
    first = raised('GRASP_FAILED', 'at 4 mm', 1.0, box_id='7')
    second = raised('GRASP_FAILED', 'at 6 mm', 2.0, box_id='7')
    assert with_new(with_new((), first), second) == (second,)


def test_a_refusal_before_motion_is_no_alarm():
    assert raised('BUSY', 'box 7 is being handled', 1.0) is None


@pytest.mark.parametrize(
    ('enum', 'message', 'prefix'),
    [
        (codes.ErrorCode, PlaceBox.Result, ''),
        (codes.Phase, PlaceBox.Feedback, 'PHASE_'),
        (codes.BoxEventKind, BoxEventMsg, ''),
        (codes.Reason, BoxEventMsg, 'REASON_'),
        (codes.PlacementStatus, PlacementDecision, 'STATUS_'),
        (codes.Mode, ExecutorState, 'MODE_'),
        (codes.BinStatus, BinState, 'STATUS_'),
        (codes.Command, Operate.Request, ''),
        (codes.Severity, AlarmMsg, 'SEVERITY_'),
        (codes.Condition, CellStateMsg, 'STATE_'),
        (codes.Level, NodeStateMsg, 'LEVEL_'),
    ],
)
def test_codes_equal_the_constants_of_the_messages(enum, message, prefix):
    for member in enum:
        assert getattr(message, prefix + member.name) == member.value
