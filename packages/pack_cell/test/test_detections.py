"""Scans made of detections: names of axes, sizes that stay, boxes that come, hide and go."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pack_cell.detections.detection import Detection, as_it_lies
from pack_cell.detections.parameters import DetectionParameters
from pack_cell.detections.tracker import DetectionTracker
from pack_msgs_py.cell_values import BoxEvent, Decision
from pack_msgs_py.codes import BoxEventKind, PlacementStatus, Reason
from pack_msgs_py.geometry.pose import (
    HALF_TURNS,
    NO_TURN,
    Pose,
    about_z,
    conjugate,
    corners,
    metres,
    quaternion_product,
)
from pack_msgs_py.orientation import ORIENTATIONS, QUATERNIONS, oriented_size
from pack_msgs_py.picking import turn_from
from pack_msgs_py.values import UP_POS_Z, Box

SIZE_MM = (400.0, 300.0, 150.0)
TIN = Box('x', (1.0, 1.0, 1.0), 7.5, allowed_up=UP_POS_Z, extra=(('sku', 'TIN-7'), ('aisle', '4')))


def seen(name='a', at=(0.0, 0.72, 0.825), *, score=0.9, yaw=0.0, class_id='TIN-7', size=SIZE_MM):
    return Detection(name, class_id, score, Pose(at, about_z(yaw)), size)


def tracker(**parameters):
    return DetectionTracker(DetectionParameters(**parameters), {'TIN-7': TIN})


def watched(found, seconds=2.0, *detections):
    """The scan after ``detections`` were seen ten times a second from 100 s on."""
    for step in range(round(10 * seconds) + 1):
        assert found.on_detections(detections, 100.0 + 0.1 * step) == []
    return found.scan(100.0 + seconds)


@given(
    st.sampled_from(ORIENTATIONS),
    st.sampled_from((NO_TURN, *HALF_TURNS)),
    st.floats(-0.7, 0.7),
)
def test_however_a_detector_names_the_axes_it_is_the_same_box(names, flip, yaw):
    lies = about_z(yaw)
    named = quaternion_product(quaternion_product(lies, QUATERNIONS[names]), flip)
    # the detector's axes along those of the box as it lies
    size = oriented_size(SIZE_MM, ORIENTATIONS[_back(names)])
    pose, size_mm = as_it_lies(Pose((0.1, 0.7, 0.8), named), size)
    assert size_mm == SIZE_MM
    assert turn_from(pose, Pose()) == pytest.approx(yaw, abs=1e-6)
    places = [
        {
            tuple(round(v, 6) + 0.0 for v in corner)
            for corner in corners(Pose(pose.position, turn), s)
        }
        for turn, s in ((named, metres(size)), (pose.quaternion, metres(size_mm)))
    ]
    assert places[0] == places[1]


def _back(names):
    """Which orientation undoes ``names``."""
    undone = conjugate(QUATERNIONS[names])
    for index, other in enumerate(ORIENTATIONS):
        product = quaternion_product(undone, conjugate(QUATERNIONS[other]))
        if any(
            abs(abs(sum(a * b for a, b in zip(product, turn, strict=True))) - 1.0) < 1e-9
            for turn in (NO_TURN, *HALF_TURNS)
        ):
            return index
    raise AssertionError(names)


def test_a_box_is_measured_once_and_knows_its_article():
    found = tracker(samples=3)
    sizes = [(401.0, 300.0, 150.0), (399.0, 300.0, 150.0), (403.0, 300.0, 150.0)]
    for step, size in enumerate(sizes):
        assert found.scan(100.0).boxes == ()
        found.on_detections([seen(size=size)], 100.0 + 0.1 * step)
    found.on_detections([seen(size=(500.0, 300.0, 150.0), at=(0.0, 2.0, 0.825))], 100.4)
    (item,) = found.scan(100.5).boxes
    assert (item.box.size_mm, item.box.weight_kg) == ((401.0, 300.0, 150.0), 7.5)
    assert item.box.size_stddev_mm == (2.0, 1.0, 1.0)
    assert item.box.allowed_up == UP_POS_Z
    assert item.pose.position == (0.0, 2.0, 0.825), 'where it is, not where it was measured'
    assert dict(item.box.extra) == {
        'sku': 'TIN-7', 'aisle': '4', 'scan_confidence': '0.900', 'scan_status': 'ok'
    }  # fmt: skip


def test_a_box_can_be_grasped_at_the_guide_once_it_lies_still():
    found = tracker(samples=1)
    for step in range(20):
        y = max(0.72, 1.22 - 0.05 * step)
        found.on_detections(
            [seen(at=(0.0, y, 0.825)), seen('b', (0.0, 3.0, 0.825))], 100 + step / 10
        )
        first = found.scan(100 + step / 10).boxes[0]
        assert first.box.id == 'a'
        assert (first.pick_open_s is not None) == (step >= 13), step
    assert found.scan(102.0).boxes[1].pick_open_s is None, 'still, but far from the guide'


def test_the_arm_may_hide_a_box_for_a_while():
    found = tracker(samples=1)
    assert watched(found, 1.0, seen(), seen('b')).boxes
    found.on_detections([seen('b')], 103.5)
    assert found.forget(103.9) == [] and len(found.scan(103.9).boxes) == 2
    assert found.forget(104.1) == [] and [x.box.id for x in found.scan(104.1).boxes] == ['b']


def test_a_picked_box_is_gone_until_it_is_returned_and_the_others_were_passed_over():
    found = tracker(samples=1)
    watched(found, 1.0, seen(), seen('b'))
    found.on_event(BoxEvent('a', BoxEventKind.PICKED))
    (left,) = watched(found, 1.0, seen(), seen('b')).boxes
    assert (left.box.id, left.laps) == ('b', 1)
    found.on_event(BoxEvent('a', BoxEventKind.RETURNED))
    smaller = seen(size=(380.0, 300.0, 150.0))
    sizes = {x.box.id: x.box.size_mm[0] for x in watched(found, 1.0, smaller, seen('b')).boxes}
    assert sizes == {'a': 380.0, 'b': 400.0}, 'measured again'


def test_a_rejected_box_is_told_of_once_it_is_gone():
    found = tracker(samples=1)
    watched(found, 1.0, seen(), seen('b'))
    found.on_decision(
        Decision(
            replace(TIN, id='a'), status=PlacementStatus.REJECT, reason='fits no bin',
            reject_reason=Reason.OVERSIZE,
        )
    )  # fmt: skip
    found.on_detections([seen('b')], 104.5)
    (event,) = found.forget(104.6)
    assert (event.box_id, event.event, event.reason) == (
        'a',
        BoxEventKind.REJECTED,
        Reason.OVERSIZE,
    )
    assert found.forget(104.7) == []


def test_what_is_not_known_well_enough_is_not_offered():
    found = tracker(samples=2)
    doubtful, strange = seen('doubtful', score=0.4), seen('strange', class_id='TIN-8')
    told = [text for step in range(9) for text in found.on_detections([doubtful, strange], step)]
    assert len(told) == 1 and "article 'TIN-8' is not in the list" in told[0]
    assert found.scan(9.0).boxes == ()
    by_default = tracker(samples=2, weight=3.0)
    (item,) = watched(by_default, 1.0, strange).boxes
    assert item.box.weight_kg == 3.0
    assert dict(item.box.extra)['scan_status'] == 'article unknown'


def test_scans_grow_over_a_restart():
    assert tracker().scan(1_700_000_100.0).sequence > tracker().scan(1_700_000_000.0).sequence
    found = tracker()
    assert [found.scan(100.0).sequence for _ in range(3)] == [100, 101, 102]
    assert math.isfinite(found.scan(100.0).remaining)
