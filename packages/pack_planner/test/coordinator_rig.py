"""A coordinator with scripted inputs and a hand-set clock."""

from __future__ import annotations

from dataclasses import replace

from planner_cases import SMALL

from pack_msgs_py.cell_values import (
    BinSnapshot,
    BoxEvent,
    Decision,
    Report,
    Scan,
    ScannedBox,
)
from pack_msgs_py.codes import ErrorCode, Mode
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin, Box
from pack_planner.coordination.alternatives import Planned
from pack_planner.coordination.answers import CheckAnswer
from pack_planner.coordination.coordinator import Coordinator
from pack_planner.coordination.inputs import Heartbeat
from pack_planner.coordination.negotiation import Asking
from pack_planner.decision.planner import PlaceStep, expected_bins

EMPTY = Bin('bin-1', 1, SMALL)
OK = ErrorCode.NONE


class CoordinatorRig:
    """A coordinator whose every output is written down, and whose inputs are set by hand."""

    def __init__(self, look_ahead=2, patience=None, **asking):
        self.now = 0.0
        self.done = []
        self.reasons = []
        self.situations = {}
        self.goal_ids = 0
        self.coordinator = Coordinator(
            self, lambda: self.now, look_ahead, Asking(**asking), patience
        )
        self.sequence = 0
        self.bins_now = (EMPTY,)
        self.boxes = ['a', 'b', 'c']
        self.remaining = 5

    # outputs
    def plan(self, number, state, candidates):
        self.situations[number] = state
        self.wanted = candidates
        self.done.append(('plan', number))

    def check(self, number, candidates, enough_s):
        self.asked = (number, candidates)
        self.enough_s = enough_s
        self.done.append(('check', number))

    def announce(self, decision, bins):
        self.done.append(('announce', decision.box.id))
        return replace(decision, sequence=len(self.done))

    def send(self, decision, target, unhidden_s):
        self.goal_ids += 1
        self.sent = decision
        self.unhidden_s = unhidden_s
        self.done.append(('send', decision.box.id))
        return self.goal_ids.to_bytes(16, 'big')

    def closing(self, reason):
        self.reasons.append(reason)

    def swap(self, target, destination):
        self.done.append(('swap', target.id, *([destination] if destination else [])))

    def refresh_bins(self):
        self.done.append(('refresh',))

    def info(self, text):
        pass

    def warn(self, text):
        self.done.append(('warn', text))

    # inputs
    def take(self):
        done, self.done = self.done, []
        return [entry for entry in done if entry[0] != 'warn']

    def scan(self, boxes=None):
        if boxes is not None:
            self.boxes = list(boxes)
        self.sequence += 1
        items = tuple(ScannedBox(box(name), Pose()) for name in self.boxes)
        self.coordinator.on_scan(Scan(self.sequence, self.now, items, remaining=self.remaining))

    def bins(self, *bins):
        if bins:
            self.bins_now = bins
        self.coordinator.on_bins(BinSnapshot(1, self.now, self.bins_now))

    def snapshot_without_bins(self):
        return BinSnapshot(1, self.now, ())

    def beat(self, mode=Mode.IDLE, active=''):
        self.coordinator.on_heartbeat(Heartbeat(mode, active, self.now))

    def event(self, name, kind):
        self.coordinator.on_event(BoxEvent(name, kind, stamp_s=self.now))

    def planned(self, name, corner=(0, 0, 0), *others, nodes=0):
        number = max(self.situations)
        target = self.situations[number].bins[0]
        offered = [
            Decision(
                box(name), target.id, target.serial, target.revision,
                corner_mm=at, size_mm=(100, 100, 100), planning_s=0.5, objective=float(sum(at)),
            )
            for at in (corner, *others)
        ]  # fmt: skip
        planned = Planned(PlaceStep(offered[0]), tuple(offered[1:]), nodes)
        self.coordinator.on_planned(number, planned)

    def answer(self, *answers):
        """The arm's answers: codes of refusals, or seconds of motion, or whole ones."""
        self.coordinator.on_checked(self.asked[0], [_whole(said) for said in answers])

    def outcome(self, outcome):
        self.coordinator.on_planned(max(self.situations), Planned(outcome))

    @property
    def goal_id(self):
        return self.goal_ids.to_bytes(16, 'big')

    def report(self, code=OK):
        self.coordinator.on_report(
            Report(self.sent.box.id, code=code, goal_id=self.goal_id, stamp_s=self.now)
        )

    def finish(self, code=OK):
        """The executor ends the goal: bins, report, result."""
        if code.box_is_in_bin:
            self.bins(*expected_bins(self.bins_now, self.sent))
        self.report(code)
        self.coordinator.on_result(self.goal_id, None)

    def start(self, name='a'):
        """Bring it to a running goal for box ``name``."""
        self.bins()
        self.scan()
        self.beat()
        self.planned(name)
        self.coordinator.on_answer(self.goal_id, accepted=True)
        self.take()

    def refuse(self, code):
        """The executor refuses the goal: report, answer."""
        self.report(code)
        self.coordinator.on_answer(self.goal_id, accepted=False)

    def wait(self, seconds, mode=Mode.IDLE, active=''):
        """Let time pass with a living executor."""
        until = self.now + seconds
        while self.now < until:
            self.now += 0.1
            self.beat(mode, active)


def box(name):
    return Box(name, (100.0, 100.0, 100.0))


def _whole(said):
    if isinstance(said, CheckAnswer):
        return said
    return CheckAnswer(said) if isinstance(said, ErrorCode) else CheckAnswer(OK, said)
