"""What stood where at a moment of a recorded run."""

from __future__ import annotations

import base64
import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pack_cell.recording.heard import (
    ArmMode,
    FixedFrame,
    Heard,
    JointPositions,
    RobotText,
    RobotTimes,
)
from pack_cell.replay.page import replay_page
from pack_cell.replay.timeline import timeline
from pack_msgs_py.cell_values import (
    BinSnapshot,
    BoxEvent,
    Decision,
    Report,
    RunnerUp,
    Scan,
    ScannedBox,
)
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Mode, PlacementStatus
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

BOX = Box('a', (300.0, 200.0, 100.0), 2.0)
EMPTY = Bin('LDC-1', 1, parse_bin('LDC'), (), 'A', 1)
PLACED = PlacedBox(BOX, (0, 0, 0), (200, 300, 100), 'yxz', (101.0, 150.0, 50.0))
FULL = replace(EMPTY, boxes=(PLACED,), revision=2)
DECISION = Decision(BOX, 'LDC-1', 1, 1, 'yxz', target=Pose((0.1, 0.15, 0.05)), sequence=1)
URDF = (
    '<robot name="r"><link name="cell"/><link name="tcp"><visual><geometry>'
    '<sphere radius="0.1"/></geometry></visual></link><joint name="rail" type="prismatic">'
    '<parent link="cell"/><child link="tcp"/><axis xyz="1 0 0"/></joint></robot>'
)


def story(*said: tuple[float, object]) -> dict:
    return timeline(Heard(when, '', value) for when, value in said).data()


def snapshot(*bins: Bin) -> BinSnapshot:
    return BinSnapshot(1, 0.0, bins)


def test_a_box_is_on_the_belt_then_in_the_gripper_then_in_its_bin() -> None:
    run = story(
        (0.0, Scan(1, 0.0, (ScannedBox(BOX, Pose((0.0, 0.6, 0.8))),))),
        (0.0, snapshot(EMPTY)),
        (0.5, DECISION),
        (1.0, BoxEvent('a', BoxEventKind.PICKED, stamp_s=1.0)),
        (1.1, Scan(2, 1.1)),
        (4.0, BoxEvent('a', BoxEventKind.PLACED, stamp_s=4.0)),
        (4.0, snapshot(FULL)),
        (4.1, Report('a', 'LDC-1', motion_s=3.2, slack_s=1.5)),
    )
    assert [time for time, _ in run['belt']] == [0.0, 1.1]
    assert run['held'] == [[1.0, 4.0, 0]]
    [of_run] = run['bins']
    assert of_run['put'] == [[4.0, 0, 101.0, 150.0, 50.0, 200.0, 300.0, 100.0]]
    [decision] = run['decisions']
    assert (decision['size'], decision['motion_s'], decision['code']) == (
        [200, 300, 100],
        3.2,
        'NONE',
    )


def test_what_is_repeated_is_told_once_and_a_box_that_moved_again() -> None:
    moved = replace(PLACED, measured_mm=(105.0, 150.0, 50.0))
    event = BoxEvent('a', BoxEventKind.LOST, text='it fell', stamp_s=3.0)
    run = story(
        (1.0, DECISION),
        (1.1, DECISION),
        (2.0, snapshot(FULL)),
        (2.5, snapshot(FULL)),
        (3.0, event),
        (3.1, event),
        (3.5, snapshot(replace(FULL, boxes=(moved,)))),
        (4.0, snapshot(EMPTY)),
    )
    assert len(run['decisions']) == 1
    assert [row[0] for row in run['bins'][0]['put']] == [2.0, 3.5, 4.0]
    assert run['bins'][0]['put'][-1][2] is None
    assert [text for _, text, _ in run['notes']] == ['a lost: it fell']


def test_a_closed_bin_and_a_rejected_box_are_told() -> None:
    rejected = Decision(BOX, status=PlacementStatus.REJECT, reason='too long', sequence=1)
    run = story((0.0, snapshot(FULL)), (1.0, rejected), (2.0, FULL), (3.0, FULL))
    assert run['bins'][0]['closed'] == 2.0
    assert (run['decisions'][0]['rejected'], run['decisions'][0]['why']) == (True, 'too long')


def test_what_else_there_was_is_told_in_plain_words_each_place_once() -> None:
    less = RunnerUp('b', 'LDC-1', (0, 0, 100), 2.0)
    refused = RunnerUp('a', 'LDC-1', (5, 0, 0), 1.0, ErrorCode.PATH_IN_COLLISION)
    decision = replace(
        DECISION, first_refusal=ErrorCode.NO_IK_SOLUTION, runners_up=(refused, less, less)
    )
    [told] = story((0.5, decision))['decisions']
    assert told['first_refusal'] == 'the arm cannot reach there'
    assert told['others'] == [
        ('a → LDC-1 at x 5, y 0, z 0', 'the arm: something is in the way'),
        ('b → LDC-1 at x 0, y 0, z 100', 'fills less well'),
    ]


def test_an_arm_that_rests_does_not_creep_to_where_it_goes_next() -> None:
    said = [
        (when, JointPositions(('rail',), (at,)))
        for when, at in ((0.0, 0.0), (1.0, 0.0), (9.9, 0.0), (10.0, 0.5), (10.1, 0.6))
    ]
    run = story((0.0, RobotText(URDF)), *said, (0.0, FixedFrame('bin_a', 'cell', Pose())))
    times = np.frombuffer(base64.b64decode(run['joint_times']), '<f4')
    joints = np.frombuffer(base64.b64decode(run['joints']), '<f4')
    assert np.interp(9.8, times, joints) == pytest.approx(0.0)
    assert np.interp(10.05, times, joints) == pytest.approx(0.55)
    assert run['robot']['shapes'][0]['sizes'] == (0.1,)


def test_robot_time_passes_between_what_was_told_of_it() -> None:
    times = RobotTimes([(1_000, 0), (2_000, 5_000_000_000), (3_000, 5_000_000_000)], 0)
    assert [times.at(wall) for wall in (0, 1_500, 2_500, 9_000)] == [0.0, 2.5, 5.0, 5.0]
    assert RobotTimes([], 1_000_000_000).at(3_000_000_000) == 2.0


def test_the_page_holds_the_run_and_whatever_a_box_is_called() -> None:
    name = '</script><b>&'
    page = replay_page(
        'monday',
        [Heard(0.0, 'box_scan', Scan(1, 0.0, (ScannedBox(replace(BOX, id=name), Pose()),)))],
    )
    assert '</script><b>' not in page
    data = page.split('id="run">', 1)[1].split('</script>', 1)[0]
    assert json.loads(data)['boxes'][0]['id'] == name


@given(st.lists(st.sampled_from([Mode.IDLE, Mode.EXECUTING, Mode.FAULT]), max_size=20))
def test_a_mode_is_told_when_it_changes(modes: list[Mode]) -> None:
    run = story(*((float(n), ArmMode(mode)) for n, mode in enumerate(modes)))
    told = [name for _, name, _ in run['modes']]
    assert all(a != b for a, b in itertools.pairwise(told))
    assert told == [m.name for n, m in enumerate(modes) if not n or modes[n - 1] is not m]


def test_a_goal_that_failed_is_told() -> None:
    run = story((0.0, Report('a', code=ErrorCode.COLLISION, message='something in the way')))
    assert run['notes'] == [[0.0, 'a: collision: something in the way', 1]]
