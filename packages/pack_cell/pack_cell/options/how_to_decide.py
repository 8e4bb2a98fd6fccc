"""Options of a run: how to decide."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pack_cell.options.declaration import DEFAULT_PROFILE, option
from pack_cell.options.parsers import CLEARANCE, RESOLUTION, NumberRange, OneOf, whole
from pack_cell.options.planner_values import algorithm_name, planner_value, tuned_file
from pack_cell.options.usual import USUAL_ALGORITHM
from pack_msgs_py.parameter_fields import Value
from pack_msgs_py.profiles import PROFILES
from pack_planner.algorithms import BUILT_IN

_GROUP = 'how to decide'


@dataclass(frozen=True)
class HowToDecide:
    """Of a run: how to decide. Lengths in millimetres, times in seconds."""

    look_ahead: int = option(
        '5',
        'boxes the planner may choose from',
        _GROUP,
        read=whole(1, 6),
        metavar='N',
        parameters=('conveyor.look_ahead', 'planner.look_ahead'),
        in_summary=True,
    )
    algorithm: str = option(
        '',
        'packing algorithm',
        _GROUP,
        read=algorithm_name,
        metavar='NAME',
        values=f'{", ".join(f"`{name}`" for name in BUILT_IN)}, or one of your own as '
        '`FILE.py:FUNCTION`',
        by_profile=USUAL_ALGORITHM,
        see='algorithms.md',
        parameters=('planner.algorithm',),
        in_summary=True,
    )
    tuned: Path | None = option(
        '',
        'file of `cell tune` with the weights of the algorithm',
        _GROUP,
        read=tuned_file,
        metavar='FILE',
        default_text='those that are shipped',
        see='algorithms.md#tune-it-for-your-boxes',
        parameters=('planner.tuned',),
        as_parameter=lambda path: str(path) if path else '',
    )
    profile: str = option(
        DEFAULT_PROFILE,
        'packing rules: cell has the margins that an arm needs, paper has none; dense fills most: '
        'boxes stand by mechanics instead of on three corners',
        _GROUP,
        read=OneOf(lambda: tuple(PROFILES)),
        parameters=('planner.profile', 'arm_executor.profile'),
        in_summary=True,
    )
    size_sigmas: float = option(
        '',
        'standard deviations of the scanner that are kept free around a box',
        _GROUP,
        read=NumberRange(0, 10),
        metavar='K',
        by_profile={name: profile.size_sigmas for name, profile in PROFILES.items()},
        see='scanner.md',
        parameters=('planner.size_sigmas', 'arm_executor.size_sigmas'),
        in_summary=True,
    )
    clearance_mm: float = option(
        '',
        'air that is kept free between two boxes, and half of it to a wall',
        _GROUP,
        name='clearance',
        read=CLEARANCE,
        metavar='MM',
        by_profile={name: profile.clearance_mm for name, profile in PROFILES.items()},
        see='scanner.md',
        parameters=('planner.clearance_mm', 'arm_executor.clearance_mm'),
        in_summary=True,
    )
    resolution_mm: int = option(
        '',
        'grid to which x, y, and the lengths and breadths of boxes with their margins are rounded '
        'up',
        _GROUP,
        name='resolution',
        read=RESOLUTION,
        metavar='MM',
        by_profile={name: profile.resolution_mm for name, profile in PROFILES.items()},
        see='scanner.md',
        parameters=('planner.resolution_mm', 'arm_executor.resolution_mm'),
        in_summary=True,
    )
    planner: tuple[tuple[str, Value], ...] = option(
        '',
        'a parameter of the planner such as cep=true, selection=largest, closing=oldest, '
        'max_passed_over=10 or weights=2,1,100; more than once for several',
        _GROUP,
        read=planner_value,
        metavar='NAME=VALUE',
        see='../packages/pack_planner/README.md#parameters',
        repeated=True,
        launched=False,
    )
