"""The record knows where every box is, and when a run is complete."""

import json
from dataclasses import replace

from pack_cell.options.run_options import parse_run_options
from pack_cell.report.archive import Archive
from pack_cell.report.ended_run import EndedRun, execution_profile
from pack_cell.report.offline_packing import OfflineBins
from pack_cell.report.record import KEPT_BINS, MOST_REASONS, RunRecord
from pack_cell.report.run_figures import RunFigures
from pack_cell.report.summary import placement_rows, summarize, summary_lines
from pack_cell.report.summary_figures import FIGURES
from pack_msgs_py.cell_values import BinSnapshot, BoxEvent, Decision, Report, Scan, ScannedBox
from pack_msgs_py.closing import Cause, ClosingReason
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Reason
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.orientation import QUATERNIONS
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

BOX = Box('a', (596.0, 396.0, 200.0), 5.0)
PLACED = PlacedBox(BOX, (0, 0, 0), (600, 400, 200), 'xyz', (300.0, 200.0, 100.0))
LDC = parse_bin('LDC')
OPEN = Bin('LDC-1', 1, LDC, (PLACED,), 'A', 1)


def scan(*boxes, supplied=1, remaining=0):
    return Scan(
        1, 1.0, tuple(ScannedBox(b, Pose()) for b in boxes), 'cell', (0, 0, 0), supplied, remaining
    )


def event(kind, box_id='a', stamp=1.0, **more):
    return BoxEvent(box_id, kind, stamp_s=stamp, **more)


def report_of(quaternion, cycle_s):
    times = {'planning_s': 0.25, 'motion_s': 4.0, 'cycle_s': cycle_s}
    return Report('a', commanded=Pose((0.0, 0.0, 0.0), quaternion), **times)


def test_what_the_tray_takes_is_counted_of_boxes_that_are_turned_over():
    figures = RunFigures()
    figures.add_report(report_of(QUATERNIONS['yxz'], 4.25))
    figures.add_report(report_of(QUATERNIONS['zyx'], 5.0))
    assert list(figures.tray_s) == [0.75]
    assert figures.robot_s == 9.25


def finished_record():
    record = RunRecord()
    record.on_scan(scan(BOX))
    record.on_decision(Decision(BOX, 'LDC-1', stamp_s=1.9, trigger_stamp_s=1.0))
    record.on_decision(
        Decision(
            BOX,
            'LDC-1',
            1,
            0,
            'xyz',
            (0, 0, 0),
            (600, 400, 200),
            sequence=1,
            planning_s=0.002,
            stamp_s=2.003,
            trigger_stamp_s=2.0,
        )
    )
    record.on_event(event(BoxEventKind.PICKED, stamp=3.0))
    record.on_event(event(BoxEventKind.PLACED, stamp=4.0, bin_id='LDC-1', bin_serial=1))
    record.on_bins(BinSnapshot(1, 4.0, (OPEN,)))
    record.on_report(
        Report(
            'a',
            'LDC-1',
            1,
            0,
            measured=Pose(),
            position_error_m=0.0005,
            motion_s=4.0,
            cycle_s=4.1,
            slack_s=1.4,
            goal_id=b'1' * 16,
        )
    )
    record.on_scan(scan())
    return record


def summary_of(record):
    return summarize(EndedRun(record, parse_run_options([]), ['cell', 'run'], 1.0, 0.5))


def test_a_run_is_complete_when_the_last_box_is_in_its_bin():
    assert finished_record().complete()


def test_a_run_is_not_complete_while_a_box_is_in_the_gripper():
    record = RunRecord()
    record.on_scan(scan())
    record.on_event(event(BoxEventKind.PICKED))
    assert not record.complete()


def test_a_run_is_not_complete_before_the_bins_show_the_box():
    record = finished_record()
    record.on_bins(BinSnapshot(2, 5.0, (replace(OPEN, boxes=()),)))
    assert not record.complete()


def test_a_run_is_not_complete_while_boxes_are_to_come():
    record = finished_record()
    record.on_scan(scan(remaining=3))
    assert not record.complete()


def test_a_doubled_box_is_found():
    record = finished_record()
    record.on_closed(Bin('LDC-0', 9, LDC, (PLACED,)))
    [line] = record.unaccounted()
    assert "box 'a' is in 2 places" in line


def test_a_vanished_box_is_found():
    record = finished_record()
    record.on_bins(BinSnapshot(2, 5.0, (replace(OPEN, boxes=()),)))
    [line] = record.unaccounted()
    assert "box 'a' is in 0 places" in line


def test_a_box_that_waits_for_its_place_on_the_belt_is_on_the_belt():
    record = finished_record()
    other = Box('b', (300.0, 200.0, 100.0))
    record.on_scan(scan(other, supplied=2, remaining=1))
    record.on_event(event(BoxEventKind.RETURNED, 'b', stamp=6.0))
    record.on_scan(scan(supplied=2, remaining=1))
    assert record.unaccounted() == []
    record.on_scan(scan(supplied=2, remaining=0))
    [line] = record.unaccounted()
    assert "box 'b' is in 0 places" in line


def test_boxes_that_no_topic_showed_are_found():
    record = finished_record()
    record.on_scan(scan(supplied=3))
    assert record.unaccounted() == ['supplied, and never shown on any topic: 2 boxes']


def test_a_closed_bin_leaves_the_open_ones_whatever_comes_first():
    record = finished_record()
    record.on_closed(OPEN)
    record.on_bins(BinSnapshot(1, 4.0, (OPEN,)))
    assert [known.id for known in record.every_bin()] == ['LDC-1']


def test_repeated_and_outdated_events_change_nothing():
    record = finished_record()
    assert not record.on_event(event(BoxEventKind.PLACED, stamp=4.0))
    assert not record.on_event(event(BoxEventKind.PICKED, stamp=3.0))
    assert record.count(BoxEventKind.PLACED) == 1


def test_the_summary_counts_and_measures():
    summary = summary_of(finished_record())
    assert (summary['boxes_supplied'], summary['placed'], summary['unaccounted']) == (1, 1, 0)
    assert summary['cycle_time_s']['p50'] == 5.5 - 1.4
    assert summary['max_pose_error_mm'] == 0.5
    assert abs(summary['ros_overhead_s']['max'] - 0.001) < 1e-6
    assert summary['rule_violations'] == 0
    assert summary['deadline_misses'] == 0
    assert summary['fill_closed'] is None


def test_the_summary_tells_a_broken_rule():
    record = finished_record()
    floating = replace(PLACED, corner_mm=(0, 0, 100))
    record.on_bins(BinSnapshot(2, 5.0, (replace(OPEN, boxes=(floating,)),)))
    summary = summary_of(record)
    assert summary['rule_violations'] > 0
    assert any('support' in line for line in summary['problems'])


def test_a_late_box_is_a_missed_deadline():
    record = finished_record()
    record.on_report(Report('a', code=ErrorCode.DEADLINE_MISSED, slack_s=-0.2, goal_id=b'2' * 16))
    assert summary_of(record)['deadline_misses'] == 1


def test_each_box_has_a_row_with_where_it_ended():
    record = finished_record()
    record.on_event(BoxEvent('b', BoxEventKind.REJECTED, Reason.OVERSIZE, 'too long', stamp_s=9.0))
    placed, rejected = placement_rows(record)
    assert placed['position_mm'] == [0, 0, 0]
    assert placed['measured_position_mm'] == [300.0, 200.0, 100.0]
    assert placed['outcome'] == 'placed'
    assert (rejected['outcome'], rejected['reason']) == ('rejected', 'oversize: too long')


def placed_box(record, name, serial):
    """A box goes all its way into the bin ``serial``."""
    box, bin_id = replace(BOX, id=name), f'LDC-{serial}'
    record.on_scan(scan(box))
    record.on_truth(scan(box))
    record.on_decision(Decision(box, bin_id, stamp_s=serial + 0.1, planning_s=0.01))
    record.on_event(event(BoxEventKind.PICKED, name, serial + 0.2))
    record.on_event(event(BoxEventKind.PLACED, name, serial + 0.3))
    report = Report(name, bin_id, serial, slack_s=1.0, motion_s=4.0, goal_id=name.encode())
    record.on_report(report)
    record.on_closing(
        ClosingReason(bin_id, {Cause.TOO_HIGH: 5}, 4, {ErrorCode.DEADLINE_UNREACHABLE: 2})
    )
    record.on_closed(replace(OPEN, id=bin_id, serial=serial, boxes=(replace(PLACED, box=box),)))
    return report


def test_the_summary_sets_the_bins_beside_what_the_same_boxes_need_without_a_belt():
    run = EndedRun(finished_record(), parse_run_options([]), ['cell', 'run'], 1.0, 0.5)
    assert 'bins needed' not in dict(summary_lines(summarize(run)))
    told = summarize(replace(run, offline=OfflineBins(1, 2)))
    assert (told['bins_used'], told['bins_offline']) == (1, {'least': 1, 'packed': 2})
    assert dict(summary_lines(told))['bins needed'] == (
        '1 used; without a belt 1 at least by volume and weight, 2 by an offline packer'
    )
    silent = summarize(replace(run, offline=OfflineBins(1)))
    assert dict(summary_lines(silent))['bins needed'].endswith('1 at least by volume and weight')


def test_a_bin_that_somebody_else_closed_has_no_reason():
    record = finished_record()
    record.on_closed(OPEN)
    summary = summary_of(record)
    [row] = summary['closings']
    assert (row['bin'], row['boxes'], row['reason'], row['causes']) == ('LDC-1', 1, '', {})
    assert '  closed for' not in dict(summary_lines(summary))


def test_what_a_long_run_is_done_with_is_on_disk_and_still_counted(tmp_path):
    rules = execution_profile(parse_run_options([]))
    record = RunRecord(archive=Archive(tmp_path / 'placements.jsonl', rules))
    record.on_event(event(BoxEventKind.REJECTED, 'ugly', 0.5))
    count = 3 * KEPT_BINS
    reports = [placed_box(record, f'box-{serial}', serial) for serial in range(1, count + 1)]
    record.on_scan(scan(supplied=count + 1))
    for known in (record.boxes, record.true_boxes, record.decisions, record.events, record.closed):
        assert len(known) <= KEPT_BINS
    rows = [json.loads(line) for line in (tmp_path / 'placements.jsonl').open()]
    archived = count - KEPT_BINS
    assert [row['box_id'] for row in rows] == ['ugly', *(f'box-{n + 1}' for n in range(archived))]
    summary = summary_of(record)
    assert (summary['placed'], summary['rejected'], summary['closed_bins']) == (count, 1, count)
    assert summary['goal_codes'] == {'NONE': count} and summary['unaccounted'] == 0
    assert record.complete() and record.all_reported()
    assert len(record.closings) <= KEPT_BINS
    assert [row['bin'] for row in summary['closings']] == [f'LDC-{n + 1}' for n in range(count)]
    assert {row['reason'] for row in summary['closings']} == {
        'nothing fits: 5 of 5 boxes too high; arm refused 2 of 4 places, all for time'
    }
    text = dict(summary_lines(summary))['  closed for']
    assert text == (
        f'{5 * count} of {5 * count} boxes too high; '
        f'arm refused {2 * count} of {4 * count} places, all for time'
    )
    # What comes a second time is known; what is somewhere else too is found.
    assert not record.on_report(reports[0])
    assert not record.on_event(event(BoxEventKind.PLACED, 'box-1', 9e9))
    record.on_bins(BinSnapshot(9, 9e9, (replace(OPEN, id='LDC-999', boxes=(doubled('box-1'),)),)))
    [line] = record.unaccounted()
    assert line == "box 'box-1' is in 2 places: bin LDC-1, bin LDC-999"


def doubled(name):
    return replace(PLACED, box=replace(BOX, id=name))


def test_a_summary_goes_into_json_and_is_printed_line_by_line():
    summary = json.loads(json.dumps(summary_of(finished_record())))
    lines = dict(summary_lines(summary))
    assert lines['boxes'] == '1 supplied, 1 placed, 0 rejected, 0 lost, 0 unaccounted for'
    assert lines['bins'] == 'LDC: 0 closed, 1 open'
    assert lines['fill rate'] == 'closed bins no bin, all bins 6.1 %, first failure no bin'
    assert lines['cycle time'] == 'mean 4.10, p50 4.10, p95 4.10, max 4.10 s'
    assert lines['  planning'] == 'mean 1.0, p50 0.0, p95 2.0, max 2.0 ms'
    assert lines['deadline'] == '5.5 s, 0 missed'
    assert lines['worst pose error'] == '0.50 mm'
    assert lines['robot time'] == '4.1 s, 878 boxes/h, 8.2 times real time'
    assert not {'  ledger', '  longest wait', 'destinations'} & set(lines)
    first, *_, last = lines
    assert (first, last) == ('boxes', 'wall time')


def test_no_two_figures_of_the_summary_have_the_same_key():
    keys = [figure.key for figure in FIGURES]
    assert len(set(keys)) == len(keys)
    assert set(keys) < set(summary_of(finished_record()))


def test_reasons_for_bins_that_there_are_not_do_not_pile_up():
    record = RunRecord()
    for number in range(3 * MOST_REASONS):
        record.on_closing(ClosingReason(f'nowhere-{number}'))
    assert list(record.closings)[-1] == f'nowhere-{3 * MOST_REASONS - 1}'
    assert len(record.closings) == MOST_REASONS
