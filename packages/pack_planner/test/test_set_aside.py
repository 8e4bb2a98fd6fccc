"""A box that the arm cannot take where the belt holds it does not stop the others."""

from __future__ import annotations

import math

from coordinator_rig import CoordinatorRig, box

from pack_msgs_py.cell_values import Scan, ScannedBox
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.geometry.pose import Pose, about_z
from pack_planner.coordination.set_aside import RETRY_S, TRIES

TURNED = Pose((0.05, 0.7, 0.8), about_z(math.radians(30.0)))


class BeltRig(CoordinatorRig):
    """Box `a` is held at the pick point, and the arm finds that it cannot take it there."""

    pose = TURNED

    def scan(self, boxes=None):
        if boxes is not None:
            self.boxes = list(boxes)
        self.sequence += 1
        items = tuple(
            ScannedBox(box(name), self.pose, pick_open_s=self.now if name == 'a' else None)
            for name in self.boxes
        )
        self.coordinator.on_scan(Scan(self.sequence, self.now, items, remaining=self.remaining))

    def tries(self, seconds):
        """Which boxes are tried while time passes; goals for `a` end at once."""
        tried = []
        until = self.now + seconds
        while self.now < until:
            self.now += 0.1
            self.scan()
            self.beat()
            number = max(self.situations, default=0)
            if ('plan', number) in self.take():
                offered = [item.id for item in self.situations[number].boxes]
                name = 'a' if 'a' in offered else offered[0]
                tried.append(name)
                self.planned(name)
                if name == 'a':
                    self.refuse(ErrorCode.BOX_NOT_PRESENTED)
                else:
                    return tried
        return tried


def start(boxes):
    rig = BeltRig(look_ahead=2)
    rig.boxes = boxes
    rig.bins()
    rig.beat()
    return rig


def test_after_a_few_tries_another_box_is_taken():
    assert start(['a', 'b', 'c']).tries(60.0) == [*['a'] * TRIES, 'b']


def test_a_box_alone_is_tried_again_now_and_then():
    tried = start(['a']).tries(TRIES + 3.5 * RETRY_S)
    assert TRIES + 2 <= len(tried) <= TRIES + 5


def test_a_box_that_lies_otherwise_now_is_offered_at_once():
    for pose, first in ((TURNED, 'c'), (Pose((0.0, 0.7, 0.8)), 'a')):
        rig = start(['a', 'b', 'c'])
        assert rig.tries(60.0)[-1] == 'b'
        rig.coordinator.on_answer(rig.goal_id, accepted=True)
        rig.pose = pose
        rig.scan()
        rig.finish()
        assert rig.tries(2.0)[0] == first
