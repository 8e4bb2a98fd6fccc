"""Where everything is between what was said of it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_replay_timeline import BOX, DECISION, EMPTY, FULL, URDF, snapshot

from pack_cell.recording.heard import FixedFrame, Heard, JointPositions, RobotText
from pack_cell.replay.moments import Moments, matrix_of, pose_of
from pack_cell.replay.timeline import Timeline, timeline
from pack_msgs_py.cell_values import BoxEvent, Scan, ScannedBox
from pack_msgs_py.codes import BoxEventKind
from pack_msgs_py.geometry.pose import Pose

STATION = Pose((1.0, 0.5, 0.15), (0.0, 0.0, 1.0, 0.0))
AT_PICK = Pose((0.0, 0.65, 0.8))


def carried_box(*more: tuple[float, object]) -> Timeline:
    """The box lies at the pick point, is picked at 1 s and in its bin at 5 s."""
    said = [
        (0.0, FixedFrame('bin_a', 'cell', STATION)),
        (0.0, Scan(1, 0.0, (ScannedBox(BOX, AT_PICK),))),
        (0.0, snapshot(EMPTY)),
        (0.5, DECISION),
        (1.0, BoxEvent('a', BoxEventKind.PICKED, stamp_s=1.0)),
        (1.0, Scan(2, 1.0)),
        (5.0, BoxEvent('a', BoxEventKind.PLACED, stamp_s=5.0)),
        (5.0, snapshot(FULL)),
        *more,
    ]
    return timeline(
        Heard(when, '', value) for when, value in sorted(said, key=lambda each: each[0])
    )


def place_of(moments: Moments, now_s: float) -> np.ndarray:
    [seen] = moments.boxes(now_s)
    return seen.pose[:3, 3]


def test_without_joints_a_box_flies_from_the_belt_to_its_place() -> None:
    moments = Moments(carried_box(), None)
    assert place_of(moments, 0.2) == pytest.approx(AT_PICK.position)
    above = place_of(moments, 3.0)
    # The bin is turned by half a turn about z.
    target = np.array([1.0 - 0.1, 0.5 - 0.15, 0.15 + 0.05])
    assert above[:2] == pytest.approx((np.array(AT_PICK.position)[:2] + target[:2]) / 2)
    assert above[2] > max(AT_PICK.position[2], target[2])
    measured = place_of(moments, 5.0)
    assert measured == pytest.approx([1.0 - 0.101, 0.5 - 0.15, 0.15 + 0.05])


def test_a_held_box_hangs_on_the_pad_until_that_is_nearest_to_its_place() -> None:
    target_x = 1.0 - 0.1
    joints = [
        (0.0, 0.0), (1.0, 0.0), (1.5, 0.0), (3.0, target_x), (3.2, target_x), (4.0, 0.1), (4.5, 0.0)
    ]  # fmt: skip
    run = carried_box(
        (0.0, RobotText(URDF)),
        *((when, JointPositions(('rail',), (at,))) for when, at in joints),
    )

    def pad_at(positions):
        """A pad that looks down, 5 cm (half the box) over the target's height at its place."""
        down = matrix_of(Pose((positions['rail'], 0.35, 0.25), (1.0, 0.0, 0.0, 0.0)))
        down[:3, 3] += (AT_PICK.position - down[:3, 3]) * (positions['rail'] < 1e-3)
        return down

    moments = Moments(run, pad_at)
    held = place_of(moments, 2.5)
    assert held[0] == pytest.approx(target_x * 2 / 3, abs=0.01)
    # From there on the pad goes away, and the box stays.
    assert place_of(moments, 3.9)[0] == pytest.approx(target_x)


def test_a_box_on_the_belt_moves_on_between_two_scans_and_waits_between_distant_ones() -> None:
    scans = [
        (when, Scan(n, when, (ScannedBox(BOX, Pose((0.0, y, 0.8))),)))
        for n, (when, y) in enumerate([(0.0, 3.0), (1.0, 2.0), (9.0, 1.0)])
    ]
    moments = Moments(timeline(Heard(when, '', scan) for when, scan in scans), None)
    assert place_of(moments, 0.25)[1] == pytest.approx(2.75)
    assert place_of(moments, 8.9)[1] == pytest.approx(2.0)


def test_a_closed_bin_stands_until_the_next_one_stands_there() -> None:
    other = type(EMPTY)('LDC-2', 2, EMPTY.spec, (), 'A', 1)
    said = [(0.0, snapshot(FULL)), (2.0, FULL), (4.0, snapshot(other))]
    moments = Moments(timeline(Heard(when, '', value) for when, value in said), None)
    assert [each['id'] for each in moments.standing(3.0)] == ['LDC-1']
    assert [each['id'] for each in moments.standing(4.0)] == ['LDC-2']
    assert moments.boxes(4.0) == []


def test_a_pose_and_its_matrix_say_the_same() -> None:
    pose = Pose((1.0, 2.0, 3.0), (0.0, math.sin(0.3), 0.0, math.cos(0.3)))
    back = pose_of(matrix_of(pose))
    assert back.position == pytest.approx(pose.position)
    assert abs(np.dot(back.quaternion, pose.quaternion)) == pytest.approx(1.0)
