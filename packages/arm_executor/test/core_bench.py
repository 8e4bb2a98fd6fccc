"""The core of the executor with an arm, without ROS, and everything that it says."""

from __future__ import annotations

import math
import threading
import time

from executor_cases import CELL, LDC, make_decision, make_goal, make_scan

from arm_executor.arms.timed import TimedArm
from arm_executor.bins.book import BinBook
from arm_executor.bins.journal import Journal
from arm_executor.bins.records import configuration
from arm_executor.goals.core import ExecutorCore
from arm_executor.goals.outputs import Finished, Happened
from arm_executor.parameters import ExecutorSettings, Tolerance
from pack_msgs_py.codes import Mode

#: Nothing takes that long, also on a busy machine.
TIMEOUT_S = 30.0


class CoreBench:
    """A core, and everything it says."""

    def __init__(self, *, faults=None, arm=None, folder='', start=True, profile=CELL, **settings):
        self._news = threading.Condition()
        self.said = []
        self.arm = arm or TimedArm(speed=0.0, faults=faults)
        self.journal = Journal(folder, configuration(LDC, CELL))
        self.book = BinBook(self.journal, LDC, 2, time.time)
        self.core = ExecutorCore(
            self.book,
            ExecutorSettings(profile, Tolerance(0.005, math.radians(1.0)), **settings),
            lambda: self.arm,
            self._hear,
        )
        if start:
            self.core.start()
            self.wait(lambda: self.core.status().mode is Mode.IDLE)

    def _hear(self, output):
        with self._news:
            self.said.append(output)
            self._news.notify_all()

    def wait(self, condition):
        with self._news:
            assert self._news.wait_for(condition, TIMEOUT_S), self.said

    def of(self, kind):
        return [output for output in list(self.said) if isinstance(output, kind)]

    def place(self, box, corner_mm=(0, 0, 0), *, revision=1, travel_s=None, in_s=60.0):
        """Present ``box`` and place it; the report."""
        count = len(self.of(Finished))
        self.core.on_scan(make_scan(box, stamp_s=time.time(), presented=box.id))
        decision = make_decision(box, corner_mm, revision=revision)
        self.core.submit(make_goal(decision, deadline_s=time.time() + in_s))
        self.wait(lambda: len(self.of(Finished)) > count)
        return self.of(Finished)[-1].report

    def events(self, box):
        return [
            output.event.event.name for output in self.of(Happened) if output.event.box_id == box.id
        ]

    def boxes(self):
        return [placed.box.id for placed in self.book.state.bins[0].boxes]

    def end(self):
        assert self.core.end(TIMEOUT_S)
        self.journal.close()
