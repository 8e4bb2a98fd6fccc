"""The options of ``cell run``, of ``cell demo`` and of the launch file, each declared once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from arm_executor.arms.registry import ARMS, DEFAULT_ARM, find_arm
from arm_executor.model.robot_data import ROBOTS
from conveyor_sim.belt.jams import FORMS as JAMS
from conveyor_sim.belt.jams import find_jams
from conveyor_sim.induct.arrivals import FORMS as ARRIVALS
from conveyor_sim.induct.arrivals import find_arrivals
from conveyor_sim.scanning.fault_plan import parse_faults
from conveyor_sim.scanning.faults import fault_names
from conveyor_sim.streams import (
    SYNTAX,
    Reading,
    Stream,
    UnclearBoxFile,
    load_boxes,
    resolved,
)
from pack_cell.options.declaration import (
    DEFAULT_PROFILE,
    add_options,
    declared_options,
    option,
)
from pack_cell.options.executor_values import executor_value
from pack_cell.options.page_address import DEFAULT_PORT
from pack_cell.options.parsers import (
    CLEARANCE,
    RESOLUTION,
    NumberRange,
    OneLineParser,
    OneOf,
    bin_kind,
    checked,
    optional_path,
    whole,
)
from pack_cell.options.planner_values import algorithm_name, planner_value, tuned_file
from pack_cell.options.usual import (
    GRASP_FACES,
    SCAN_SIGMA_MM,
    USUAL_ALGORITHM,
    USUAL_FACES,
    usual_faces,
)
from pack_msgs_py.orientation import TILT_TIME_S
from pack_msgs_py.parameter_fields import Value
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import BIN_KINDS, BinSpec
from pack_planner.algorithms import BUILT_IN

_PACK, _DECIDE, _BELT = 'what to pack', 'how to decide', 'what comes on the belt'
_ACT, _OUTPUT = 'how to act', 'output'


def readable_boxes(choice: str) -> None:
    """Refuse boxes that cannot be read, whatever other options say of their file."""
    with suppress(UnclearBoxFile):
        load_boxes(choice)


@dataclass(frozen=True)
class RunOptions:
    """Everything that fixes a run. Lengths in millimetres, times in seconds."""

    boxes: str = option(
        '',
        'the boxes: a file or a stream by name',
        _PACK,
        read=checked(readable_boxes),
        metavar='BOXES',
        values=SYNTAX,
        default_text="cartons, the project's own stream of 40",
        see='../packages/conveyor_sim/README.md#streams-by-name',
        parameters=('conveyor.boxes_file',),
        as_parameter=resolved,
    )
    units: str = option(
        '',
        'units of a box file that does not say them',
        _PACK,
        read=checked(Reading),
        metavar='UNITS',
        values='a length, a weight or both, such as `cm,kg`, `in,lb` or `g`',
        default_text='as the file says',
        see='box_lists.md',
        parameters=('conveyor.units',),
    )
    decimal: str = option(
        '',
        'decimal mark of a box file, where its numbers do not tell',
        _PACK,
        read=checked(lambda text: Reading(decimal=text)),
        metavar='MARK',
        values='`point` or `comma`',
        default_text='as the file says',
        see='box_lists.md',
        parameters=('conveyor.decimal',),
    )
    order_by: str = option(
        '',
        'column of a box file by whose values orders keep apart: a bin takes boxes of one order, '
        'instead of one destination',
        _PACK,
        metavar='ORDER',
        see='box_lists.md',
        parameters=('conveyor.order_by',),
    )
    count: int = option(
        '0',
        'number of boxes; more than the file holds repeats it, or more are made; 0: all of it once',
        _PACK,
        read=whole(0, 1_000_000),
        metavar='N',
        parameters=('conveyor.count',),
    )
    seed: int = option(
        '0',
        '0: boxes in the order of the file; else they are shuffled with this seed',
        _PACK,
        read=whole(0, 2**31 - 1),
        metavar='N',
        parameters=('conveyor.seed',),
        in_summary=True,
    )
    bin_spec: BinSpec = option(
        'LDC',
        'kind of every bin',
        _PACK,
        name='bin',
        read=bin_kind,
        metavar='KIND',
        values=BIN_KINDS,
        parameters=('arm_executor.bin_type',),
        as_parameter=lambda spec: spec.name,
    )
    start_bins: Path | None = option(
        '',
        'begin with part-filled bins: the open ones of an earlier run, by its folder, or of a file '
        'of `cell journal export`',
        _PACK,
        read=optional_path,
        metavar='DIR|FILE',
        default_text='empty bins',
        see='reliability.md#begin-with-part-filled-bins',
        parameters=('arm_executor.start_bins',),
        as_parameter=lambda path: str(path.resolve()) if path else '',
    )
    open_bins: int = option(
        '2',
        'bins open at a time',
        _PACK,
        read=whole(1, 3),
        metavar='N',
        parameters=('arm_executor.open_bins',),
    )
    destinations: int = option(
        '0',
        'give each box that has none one of N destinations, D1 to DN, at random, and the bins to '
        'them in turn; 0: none, any box goes into any bin',
        _PACK,
        read=whole(0, 1000),
        metavar='N',
        see='destinations.md',
        parameters=('conveyor.destinations',),
    )
    serve: str = option(
        '',
        'destinations that the bins serve at the start, with commas between them, where the boxes '
        'bring their own',
        _PACK,
        metavar='NAMES',
        default_text='those of `--destinations`',
        see='destinations.md',
    )
    look_ahead: int = option(
        '5',
        'boxes the planner may choose from',
        _DECIDE,
        read=whole(1, 6),
        metavar='N',
        parameters=('conveyor.look_ahead', 'planner.look_ahead'),
        in_summary=True,
    )
    algorithm: str = option(
        '',
        'packing algorithm',
        _DECIDE,
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
        _DECIDE,
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
        _DECIDE,
        read=OneOf(lambda: tuple(PROFILES)),
        parameters=('planner.profile', 'arm_executor.profile'),
        in_summary=True,
    )
    size_sigmas: float = option(
        '',
        'standard deviations of the scanner that are kept free around a box',
        _DECIDE,
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
        _DECIDE,
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
        _DECIDE,
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
        _DECIDE,
        read=planner_value,
        metavar='NAME=VALUE',
        see='../packages/pack_planner/README.md#parameters',
        repeated=True,
        launched=False,
    )
    scan_sigma_mm: float = option(
        '',
        'standard deviation of each edge that the scanner measures; with one, weight and angle '
        'are a little off too',
        _BELT,
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
        _BELT,
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
        _BELT,
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
        _BELT,
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
        _BELT,
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
        _BELT,
        read=checked(find_arrivals),
        metavar='WHEN',
        values=ARRIVALS,
        parameters=('conveyor.arrivals',),
    )
    jams: str = option(
        '',
        'when the belt jams',
        _BELT,
        read=checked(find_jams),
        metavar='WHEN',
        values=JAMS,
        parameters=('conveyor.jams',),
    )
    max_laps: int = option(
        '100',
        'a box passed over more often is rejected; 0 for any number',
        _BELT,
        read=whole(0, 1_000_000),
        metavar='N',
        parameters=('conveyor.max_laps',),
    )
    arm: str = option(
        DEFAULT_ARM,
        'which arm',
        _ACT,
        read=checked(find_arm),
        metavar='NAME',
        values=', '.join(f'`{kind.name}` ({kind.summary})' for kind in ARMS)
        + ', or `module:attribute` of an arm of your own',
        see='integration.md',
        parameters=('arm_executor.arm',),
        in_summary=True,
    )
    robot: str = option(
        '',
        "robot of an arm that moves one, instead of the layout's own",
        _ACT,
        read=OneOf(lambda: tuple(ROBOTS)),
        default_text='that of the layout, `ur20`',
        parameters=('arm_executor.robot',),
    )
    layout: Path | None = option(
        '',
        'YAML file that says where everything stands; `cell layout` prints and checks one',
        _ACT,
        read=optional_path,
        metavar='FILE',
        default_text='the built-in layout',
        see='cell_layout.md',
        parameters=('arm_executor.layout',),
        as_parameter=lambda path: str(path.resolve()) if path else '',
    )
    executor: tuple[tuple[str, Value], ...] = option(
        '',
        'a parameter of the executor or its arm such as joint_jerk=500 or '
        'trajectory.vacuum_output=2; more than once for several',
        _ACT,
        read=executor_value,
        metavar='NAME=VALUE',
        see='../packages/arm_executor/README.md#parameters',
        repeated=True,
        launched=False,
    )
    grasp_faces: str = option(
        '',
        'faces by which the arm takes boxes; `top` where no tray can stand: at a continuous belt, '
        'or under an arm that waits low',
        _ACT,
        read=OneOf(
            lambda: {
                'top': 'boxes stay upright',
                'any': 'they may also be taken by the front, which comes up',
                'tray': 'a tilt tray at the pick point brings front or left end up',
            }
        ),
        by_profile=USUAL_FACES,
        see='cell_layout.md#the-tilt-tray',
        parameters=('planner.orientations', 'arm_executor.orientations'),
        as_parameter=GRASP_FACES.__getitem__,
    )
    tilt_time_s: float = option(
        f'{TILT_TIME_S}',
        'robot time in which that tray tips a box, or tips it back',
        _ACT,
        name='tilt_time',
        read=NumberRange(0.1, 60, 's'),
        metavar='S',
        see='cell_layout.md#the-tilt-tray',
        parameters=('conveyor.tilt_time', 'arm_executor.tilt_time'),
    )
    deadline_s: float = option(
        '5.5',
        'seconds a box may take, unhidden planning and motion together',
        _ACT,
        name='deadline',
        read=NumberRange(0, 3600, 's', above=True),
        metavar='S',
        parameters=('planner.deadline_s',),
    )
    speed: float = option(
        '0',
        'robot time against wall time: 1 real time, 0 as fast as possible',
        _ACT,
        read=NumberRange(0, 100),
        metavar='X',
        # Who launches a cell looks at it, or has a real belt beside it.
        launch_default='1',
        parameters=('conveyor.speed', 'arm_executor.speed', 'planner.speed'),
        in_summary=True,
    )
    acknowledge: str = option(
        'itself',
        'who acknowledges an alarm (lost box, collision, jam) before the arm moves again',
        _ACT,
        read=OneOf(
            lambda: {
                'itself': 'nobody need stand by: it is shown, and the cell goes on',
                'operator': 'the cell waits for `cell ack`',
            }
        ),
        default_text='`itself` with a simulated arm, else `operator`',
        see='operations.md#three-kinds-of-trouble',
        # Who launches a cell has an arm or a person beside it.
        launch_default='operator',
        parameters=('conveyor.acknowledge', 'arm_executor.acknowledge'),
    )
    respawn: bool = option(
        '',
        'start a node again when it dies, instead of ending the run',
        _ACT,
        flag=True,
        launched=False,
        resumable=True,
    )
    stall_timeout_s: float = option(
        '120',
        'end the run with an error when nothing happens for so long',
        _ACT,
        name='stall_timeout',
        read=NumberRange(5, 3600, 's'),
        metavar='S',
        launched=False,
        resumable=True,
    )
    out: Path | None = option(
        '',
        'folder for summary.json, placements.jsonl, logs',
        _OUTPUT,
        read=optional_path,
        metavar='DIR',
        default_text='`runs/<time>`',
        launched=False,
    )
    record: str = option(
        'all',
        'what is written down of what the nodes say to each other',
        _OUTPUT,
        read=OneOf(
            lambda: {
                'all': 'every topic into `run.mcap`, and the last 30 s before a fault',
                'faults': 'these alone',
                'nothing': 'no recorder runs',
            }
        ),
        see='recording.md',
        launched=False,
        resumable=True,
    )
    resume: Path | None = option(
        '',
        'go on with the run in this folder, after a power cut or Ctrl-C: same boxes, bins, options '
        'and numbers; a summary of the whole run',
        _OUTPUT,
        read=optional_path,
        metavar='DIR',
        default_text='a new run',
        see='reliability.md#go-on-after-a-power-cut',
        launched=False,
    )
    view: bool = option(
        '',
        'show the run on a page in the browser, on this machine alone',
        _OUTPUT,
        flag=True,
        see='view.md',
        launched=False,
        resumable=True,
    )
    view_port: int = option(
        f'{DEFAULT_PORT}',
        'port of that page, 0 for any free one',
        _OUTPUT,
        read=whole(0, 65535),
        metavar='N',
        launched=False,
        resumable=True,
    )
    quiet: bool = option(
        '', 'no progress, only the summary', _OUTPUT, flag=True, launched=False, resumable=True
    )


def open_stream(options: RunOptions) -> Stream:
    """The boxes of a run; ``ValueError`` when their file cannot be used."""
    reading = Reading(options.units, options.decimal, options.order_by)
    return Stream.open(options.boxes, options.count, options.seed, options.destinations, reading)


def run_options(given: Mapping[str, Any]) -> RunOptions:
    """The options with what is ``given``, by key; the rest are defaults, some by profile."""
    values: dict[str, Any] = {}
    profile = given.get('profile', DEFAULT_PROFILE)
    for named in declared_options(RunOptions):
        if named.key in given:
            values[named.key] = (
                tuple(given[named.key]) if named.declaration.repeated else given[named.key]
            )
        elif named.declaration.by_profile is not None:
            values[named.key] = named.declaration.by_profile[profile]
    if 'acknowledge' not in given and not find_arm(values.get('arm', DEFAULT_ARM)).simulated:
        values['acknowledge'] = 'operator'
    options = RunOptions(**values)
    if 'grasp_faces' in given:
        return options
    faces = usual_faces(profile, options.belt_mode, options.layout, options.robot)
    return replace(options, grasp_faces=faces)


def parse_run_options(arguments: Sequence[str], prog: str = 'cell run') -> RunOptions:
    """The options of a command line; a wrong one ends the process with a line and code 2."""
    parser = OneLineParser(prog=prog)
    add_options(parser, RunOptions)
    return run_options(vars(parser.parse_args(arguments)))
