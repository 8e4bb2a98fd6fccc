"""Requests, bins and runs that the tests of the arm in physics share."""

from __future__ import annotations

import math
import threading

import numpy as np

from arm_executor.model.arm_interface import MotionHooks, PlaceRequest
from arm_executor.model.layout import pick_pose
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

LDC = parse_bin('LDC')
QUARTER = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))
NO_TURN = (0.0, 0.0, 0.0, 1.0)


def box(name='box', size=(300.0, 200.0, 200.0), weight=4.0, com=(0.0, 0.0, 0.0)):
    return Box(name, size, weight, com)


def request_for(arm, taken, station, centre, quaternion=NO_TURN, belt=()):
    pick = pick_pose(arm.layout, taken.size_mm)
    return PlaceRequest(taken, pick, station, Pose(centre, quaternion), belt)


def empty(*stations):
    return [Bin(f'bin-{s}', i, LDC, station=s) for i, s in enumerate(stations, 1)]


def holding(station, boxes):
    placed = tuple(PlacedBox(content, (0, 0, 0), (1, 1, 1)) for content in boxes)
    return Bin(f'bin-{station}', 1, LDC, placed, station)


class Told:
    """Hooks that note what they were told, and can act when a phase begins."""

    def __init__(self, **when):
        self.steps, self.phases, self.fractions = [], [], []
        self._when = when
        self.hooks = MotionHooks(
            self._phase,
            *(
                lambda name=name: self.steps.append(name)
                for name in ('picked', 'releasing', 'released')
            ),
        )

    def _phase(self, phase, fraction):
        if phase not in self.phases:
            self.phases.append(phase)
        self.fractions.append(fraction)
        act = self._when.get(phase.name)
        if act is not None:
            act()


def run(arm, request, told=None, stop=None):
    told = told or Told()
    return arm.execute(arm.plan(request), told.hooks, stop or threading.Event())


def assert_arm_stays_still(arm):
    arm.hold_still(0.01)
    before = np.array(arm.joint_positions()[1])
    arm.hold_still(1.0)
    assert np.abs(np.array(arm.joint_positions()[1]) - before).max() < 0.01


def metres(taken):
    return tuple(edge / 1000 for edge in taken.size_mm)
