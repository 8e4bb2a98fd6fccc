"""Options of a run: what comes on the belt."""

from __future__ import annotations

from dataclasses import dataclass

from conveyor_sim.belt.jams import FORMS as JAMS
from conveyor_sim.belt.jams import find_jams
from conveyor_sim.induct.arrivals import FORMS as ARRIVALS
from conveyor_sim.induct.arrivals import find_arrivals
from conveyor_sim.scanning.fault_plan import parse_faults
from conveyor_sim.scanning.faults import fault_names
from pack_cell.options.declaration import option
from pack_cell.options.parsers import NumberRange, OneOf, checked, whole
from pack_cell.options.usual import SCAN_SIGMA_MM

_GROUP = 'what comes on the belt'


@dataclass(frozen=True)
class WhatComes:
    """Of a run: what comes on the belt. Lengths in millimetres, times in seconds."""

    scan_sigma_mm: float = option(
        '',
        'standard deviation of each edge that the scanner measures; with one, weight and angle '
        'are a little off too',
        _GROUP,
        name='scan_sigma',
        read=NumberRange(0, 50, 'mm'),
        metavar='MM',
        by_profile=SCAN_SIGMA_MM,
        see='scanner.md',
        parameters=('conveyor.size_sigma',),
        in_summary=True,
    )
    pose_noise_mm: float = option(
        '0',
        'how far, at most, boxes lie beside the middle of the belt, and behind its guide; the '
        'scanner sees it',
        _GROUP,
        name='pose_noise',
        read=NumberRange(0, 100, 'mm'),
        metavar='MM',
        see='scanner.md',
        parameters=('conveyor.pose_noise',),
        in_summary=True,
    )
    yaw_noise_deg: float = option(
        '0',
        'how far, at most, boxes lie turned on the belt; the scanner sees it',
        _GROUP,
        name='yaw_noise',
        read=NumberRange(0, 45, 'degrees'),
        metavar='DEG',
        see='scanner.md',
        parameters=('conveyor.yaw_noise',),
        in_summary=True,
    )
    faults: str = option(
        '',
        'what goes wrong with how many of the boxes',
        _GROUP,
        read=checked(parse_faults),
        metavar='RATES',
        values=f'`no_read=0.01,touching=0.005`, or `all=0.01` for each of {fault_names()}',
        see='faults.md',
        parameters=('conveyor.faults',),
        in_summary=True,
    )
    belt_mode: str = option(
        'stop_at_pick',
        'how the belt moves',
        _GROUP,
        read=OneOf(
            lambda: {
                'stop_at_pick': 'turns either way and waits',
                'continuous': 'runs all the time',
            }
        ),
        parameters=('conveyor.belt_mode',),
    )
    arrivals: str = option(
        'saturated',
        'when boxes come',
        _GROUP,
        read=checked(find_arrivals),
        metavar='WHEN',
        values=ARRIVALS,
        parameters=('conveyor.arrivals',),
    )
    jams: str = option(
        '',
        'when the belt jams',
        _GROUP,
        read=checked(find_jams),
        metavar='WHEN',
        values=JAMS,
        parameters=('conveyor.jams',),
    )
    max_laps: int = option(
        '100',
        'a box passed over more often is rejected; 0 for any number',
        _GROUP,
        read=whole(0, 1_000_000),
        metavar='N',
        parameters=('conveyor.max_laps',),
    )
