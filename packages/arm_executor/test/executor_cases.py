"""Boxes, bins, goals and scans that the executor's tests share."""

from __future__ import annotations

from dataclasses import replace

from arm_executor.goals.place_goal import PlaceGoal
from arm_executor.model.layout import Layout, pick_pose
from pack_msgs_py.cell_values import Decision, Scan, ScannedBox
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.orientation import QUATERNIONS, oriented_size
from pack_msgs_py.profiles import PROFILES, planned_size
from pack_msgs_py.values import Box, parse_bin

LDC = parse_bin('LDC')
CELL = PROFILES['cell']
SIZE_MM = (296.0, 196.0, 150.0)
LAYOUT = Layout()


def make_box(number: int = 1, size_mm=SIZE_MM, weight_kg: float = 3.0) -> Box:
    return Box(f'box-{number}', size_mm, weight_kg=weight_kg)


def make_decision(
    box: Box,
    corner_mm=(0, 0, 0),
    *,
    orientation='xyz',
    bin_id='LDC-1',
    serial=1,
    revision=1,
    profile=CELL,
) -> Decision:
    size = planned_size(box, orientation, profile)
    height = oriented_size(box.size_mm, orientation)[2]
    centre = (
        (corner_mm[0] + size[0] / 2) / 1e3,
        (corner_mm[1] + size[1] / 2) / 1e3,
        (corner_mm[2] + height / 2) / 1e3,
    )
    return Decision(
        box=box,
        bin_id=bin_id,
        bin_serial=serial,
        bin_revision=revision,
        orientation=orientation,
        corner_mm=corner_mm,
        size_mm=size,
        target=Pose(centre, QUATERNIONS[orientation]),
        algorithm='test',
        profile=profile.name,
    )


def pick_of(box: Box) -> Pose:
    return pick_pose(LAYOUT, box.size_mm)


def make_goal(decision: Decision, *, deadline_s=1e12, number=1, **changes) -> PlaceGoal:
    goal = PlaceGoal(
        decision=decision,
        frame_id='bin_a',
        pick=pick_of(decision.box),
        pick_frame='cell',
        deadline_s=deadline_s,
        goal_id=bytes([number] * 16),
    )
    return replace(goal, **changes)


def make_scan(*boxes: Box, stamp_s: float, presented: str = '', sequence: int = 1) -> Scan:
    """Boxes in a row behind the pick point; ``presented`` is held there, first in the row."""
    scanned, way = [], 0.0
    for box in boxes:
        x, y, z = pick_of(box).position
        at_pick = box.id == presented
        scanned.append(
            ScannedBox(
                box=box,
                pose=Pose((x, y + (0.0 if at_pick else way), z)),
                pick_open_s=stamp_s if at_pick else None,
                travel_time_s=way,
            )
        )
        way += box.size_mm[1] / 1e3 + 0.2
    return Scan(sequence=sequence, stamp_s=stamp_s, boxes=tuple(scanned))
