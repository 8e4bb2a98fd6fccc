"""An arm as somebody else would write it: it knows nothing but the protocol, and takes no time."""

from __future__ import annotations

from arm_executor.arms.kind import ArmKind, ArmSetup
from arm_executor.model.arm_interface import MotionPlan, MotionResult
from pack_msgs_py.codes import ErrorCode, Phase


class ToyArm:
    def __init__(self, setup: ArmSetup) -> None:
        self.setup = setup
        self.poses = {}
        self.held = None

    def set_bins(self, bins, poses):
        self.poses = {placed.box.id: poses[placed.box.id] for bin_ in bins for placed in bin_.boxes}
        return dict(self.poses)

    def plan(self, request, after=None):
        return MotionPlan(request, predicted_s=1.0, planning_s=0.0)

    def execute(self, plan, hooks, stop):
        request = plan.request
        if stop.is_set():
            return MotionResult(ErrorCode.CANCELED, 'stopped')
        self.held = request.box.id
        hooks.picked()
        hooks.phase(Phase.TRANSFERRING, 0.5)
        hooks.releasing()
        self.held = None
        hooks.released()
        others = dict(self.poses)
        self.poses[request.box.id] = request.target
        return MotionResult(
            ErrorCode.NONE,
            motion_s=1.0,
            measured=request.target,
            others=others,
            split_s={Phase.TRANSFERRING: 1.0},
        )

    def return_to_belt(self):
        had_box, self.held = self.held is not None, None
        return had_box

    def withdraw(self):
        return True

    def holds(self):
        return self.held

    def tracking_error(self):
        return 0.0

    def joint_positions(self):
        return (), ()

    def close(self):
        pass


TOY = ArmKind(
    name='toy',
    summary='is there at once',
    make=ToyArm,
    lifting_limit=lambda layout: 12.0,
)
