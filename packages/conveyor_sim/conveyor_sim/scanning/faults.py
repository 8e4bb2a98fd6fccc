"""The faults, each declared once: rates, behaviour, help and docs/faults.md follow from that.

A new one is a new entry of :data:`FAULTS`.
"""

from __future__ import annotations

import random
from dataclasses import replace

from conveyor_sim.scanning.fault import Fault
from pack_msgs_py.values import Box

#: Of the boxes that could not be read, so many cannot be read the second time either.
STILL_UNREAD = 0.5


def _read_second_or_never(rng: random.Random) -> int | None:
    return None if rng.random() < STILL_UNREAD else 2


def _one_edge_far_off(box: Box, rng: random.Random) -> Box:
    edges = list(box.size_mm)
    factor = rng.uniform(0.6, 0.8) if rng.random() < 0.5 else rng.uniform(1.25, 1.5)
    axis = rng.randrange(3)
    edges[axis] = round(edges[axis] * factor, 1)
    return replace(box, size_mm=(edges[0], edges[1], edges[2]))


def _too_wide(box: Box, rng: random.Random) -> Box:
    _, y, z = box.size_mm
    return replace(box, size_mm=(float(round(rng.uniform(700.0, 1100.0))), y, z))


def _too_heavy(box: Box, rng: random.Random) -> Box:
    return replace(box, weight_kg=round(rng.uniform(22.0, 60.0), 1))


def _carries_nothing(box: Box, rng: random.Random) -> Box:
    return replace(box, max_top_load_n=0.0)


def _aside(rng: random.Random) -> float:
    return rng.choice((-1.0, 1.0)) * 0.6


NO_READ = Fault(
    'no_read',
    happens='the scanner reads no label',
    noticed='at once, at the induct',
    ends='scanned again; half of them are read then and go on, the others go to the reject lane',
    code='`REASON_NO_READ`',
    read_at=_read_second_or_never,
)
WRONG_SIZE = Fault(
    'wrong_size',
    happens='one edge is measured 20 to 50 % wrong',
    noticed='a light curtain over the pick point measures what the arm lifts: `BOX_MISMATCH`; a '
    'pad that meets no box within its stroke: `GRASP_FAILED`',
    ends='put back, to the induct, scanned again: right this time, and on it goes; a second '
    'mismatch goes to the reject lane',
    code='`RETURNED` with `REASON_INVALID_DATA`',
    misread=_one_edge_far_off,
)
TOUCHING = Fault(
    'touching',
    happens='the box and the next one are read as one, with the joint size and weight and the '
    "first one's label",
    noticed='the arm lifts one of them, which weighs too little: `BOX_MISMATCH`; or its pad finds '
    'the joint: `GRASP_FAILED`',
    ends='the second one is fed again as soon as the first is off the belt; both are scanned '
    'alone, and go on',
    code='`RETURNED` with `REASON_INVALID_DATA`',
    touches_next=True,
)
OVERSIZE = Fault(
    'oversize',
    happens='the box is 70 to 110 cm wide across the belt',
    noticed='the gauge of the induct',
    ends='reject lane',
    code='`REASON_OVERSIZE`',
    body=_too_wide,
)
OVERWEIGHT = Fault(
    'overweight',
    happens='it weighs 22 to 60 kg',
    noticed='the checkweigher of the induct stops what is above 50 kg; the planner rejects what '
    'its arm cannot lift',
    ends='reject lane',
    code='`REASON_OVERWEIGHT`',
    body=_too_heavy,
)
DAMAGED = Fault(
    'damaged',
    happens='nothing may be stacked on it',
    noticed='a camera of the scanner: `max_top_load` is 0',
    ends='placed, and with rules that check loads nothing on it',
    code='none',
    body=_carries_nothing,
)
EMPTY_PICK = Fault(
    'empty_pick',
    happens='it has slipped aside, and the arm finds nothing at the pick point',
    noticed='no vacuum: `GRASP_FAILED`',
    ends='found again, scanned again, and placed; not found a second time it goes to the reject '
    'lane',
    code='`REASON_FAULT` then',
    slip_m=_aside,
)
DUPLICATE_ID = Fault(
    'duplicate_id',
    happens='its label is that of the box before',
    noticed='the induct knows that label',
    ends='the second one goes to the reject lane, under the name that the stream gives it',
    code='`REASON_DUPLICATE_ID`',
    has_label_of_last=True,
)
FALLEN = Fault(
    'fallen',
    happens='it falls off while the belt moves, not while it is held at the pick point',
    noticed='a light barrier',
    ends='out of the cell, with an event, so that it does not count as lost',
    code='`REASON_FAULT`, "fell off the belt"',
    falls=True,
)

#: In the order in which ``all`` names them, on which it depends what befalls which box.
FAULTS = (
    NO_READ,
    WRONG_SIZE,
    TOUCHING,
    OVERSIZE,
    OVERWEIGHT,
    DAMAGED,
    EMPTY_PICK,
    DUPLICATE_ID,
    FALLEN,
)


def fault_names() -> str:
    """The names of all faults, for messages and help."""
    return ', '.join(fault.name for fault in FAULTS)


def faults_table() -> str:
    """The faults as a table for docs/faults.md."""
    lines = [
        '| fault | what happens | how it is noticed | where the box ends | code |',
        '|---|---|---|---|---|',
    ]
    lines += [
        f'| `{fault.name}` | {fault.happens} | {fault.noticed} | {fault.ends} | {fault.code} |'
        for fault in FAULTS
    ]
    return '\n'.join(lines) + '\n'
