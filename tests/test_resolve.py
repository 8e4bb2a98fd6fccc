"""A box in doubt after a crash, with an arm that cannot tell: a person is asked, and answers."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pack_cell.testing import NodeGroup
from pack_msgs_py.codes import BoxEventKind

pytestmark = pytest.mark.cell

#: An arm of somebody else that holds each box for a while, and knows nothing after a restart.
ARM = """
import time

from arm_executor.arms.kind import ArmKind
from arm_executor.model.arm_interface import MotionPlan, MotionResult
from pack_msgs_py.codes import ErrorCode, Phase


class SlowArm:
    def __init__(self, setup):
        self.poses = {}

    def set_bins(self, bins, poses):
        self.poses = {p.box.id: poses[p.box.id] for bin_ in bins for p in bin_.boxes}
        return dict(self.poses)

    def plan(self, request, after=None):
        return MotionPlan(request, predicted_s=1.0, planning_s=0.0)

    def execute(self, plan, hooks, stop):
        request, others = plan.request, dict(self.poses)
        hooks.picked()
        for share in range(1, 9):
            time.sleep(0.1)
            hooks.phase(Phase.TRANSFERRING, share / 10)
        hooks.releasing()
        hooks.released()
        self.poses[request.box.id] = request.target
        return MotionResult(
            ErrorCode.NONE, motion_s=1.0, measured=request.target, others=others,
            split_s={Phase.TRANSFERRING: 1.0},
        )

    def return_to_belt(self):
        return False

    def withdraw(self):
        return True

    def holds(self):
        return None

    def tracking_error(self):
        return 0.0

    def joint_positions(self):
        return (), ()

    def close(self):
        pass


SLOW = ArmKind(name='slow', summary='holds each box for a while', make=SlowArm)
"""


def resolve(domain: int, *words: str) -> str:
    done = subprocess.run(
        [sys.executable, '-m', 'pack_cell', 'resolve', *words, '--domain', str(domain)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env=dict(os.environ, COLUMNS='200'),
    )
    return done.stdout + done.stderr


def test_a_person_says_where_the_box_is_and_the_bin_goes_on(
    group: NodeGroup, tmp_path: Path, ros_domain: int
) -> None:
    (tmp_path / 'slow.py').write_text(ARM)
    arm = f'{tmp_path}/slow.py:SLOW'
    group.start(
        'arm_executor',
        arm=arm,
        orientations='upright',
        acknowledge='itself',
        state_dir=tmp_path / 'state',
    )
    group.start('planner', orientations='upright', algorithm='mpack_lite', deadline_s=60.0)
    group.start('conveyor', count=4, speed=0.0)
    group.wait_until(lambda record: record.count(BoxEventKind.PLACED) == 1, 60)
    group.wait_until(lambda record: record.count(BoxEventKind.PICKED) == 1, 60)
    group.kill('arm_executor')
    (box_id,) = (
        box_id
        for box_id, event in group.record.events.items()
        if event.event is BoxEventKind.PICKED
    )
    group.start('arm_executor')
    group.wait_until(lambda record: record.unknown() == 1, 60)
    assert 'is not in doubt; in doubt' in resolve(ros_domain, 'b0', '--removed', '--why', 'x')
    told = resolve(ros_domain, box_id, '--placed', '--why', 'stands where it should')
    assert 'which goes on' in told, told + group.text()
    group.wait_until(lambda record: record.complete(), 60)
    assert group.record.count(BoxEventKind.PLACED) == 4, group.text()
    assert group.record.unaccounted() == []
