"""Options of ``cell run`` and ``cell demo``: one place for names, defaults, ranges and texts."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from arm_executor.arms.registry import ARMS_IN_WORDS, DEFAULT_ARM, find_arm
from arm_executor.model.robot_data import ROBOTS
from conveyor_sim.belt.jams import FORMS as JAMS
from conveyor_sim.induct.arrivals import FORMS as ARRIVALS
from conveyor_sim.streams import SYNTAX
from pack_cell.planner_options import planner_value
from pack_msgs_py.parameter_fields import Value
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import BinSpec, parse_bin

#: Error of the scanner by profile: what one can buy, and none, as in the paper.
SCAN_SIGMA_MM = {'cell': 2.0, 'paper': 0.0}
#: Orientation rule of planner and executor by the faces that the arm takes boxes by.
GRASP_FACES = {'top': 'upright', 'any': 'upright_or_front_up'}
#: What else is off when the sizes are, in kilograms and degrees.
SCAN_SIGMA_KG, SCAN_SIGMA_DEG = 0.02, 0.3


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors are one line on stderr, with exit code 2."""

    def error(self, message: str) -> NoReturn:
        """Print ``message`` and where to look, and leave with code 2."""
        self.exit(2, f'{self.prog}: {message} (see {self.prog} --help)\n')


@dataclass(frozen=True)
class RunOptions:
    """Everything that fixes a run. Lengths in millimetres, times in seconds."""

    boxes: str
    count: int
    bin_spec: BinSpec
    open_bins: int
    look_ahead: int
    algorithm: str
    profile: str
    deadline_s: float
    speed: float
    seed: int
    out: Path | None
    arm: str
    robot: str
    layout: Path | None
    respawn: bool
    stall_timeout_s: float
    quiet: bool
    destinations: int
    serve: str
    belt_mode: str
    arrivals: str
    jams: str
    max_laps: int
    scan_sigma_mm: float
    size_sigmas: float
    faults: str
    grasp_faces: str = 'top'
    planner: tuple[tuple[str, Value], ...] = ()


def number(low: float, high: float, what: str, *, whole: bool, above: bool = False):  # type: ignore[no-untyped-def]
    """An argparse type: a finite number in [low, high] (or above low), named in the error."""

    def parse(text: str) -> float:
        try:
            value = int(text) if whole else float(text)
        except ValueError:
            kind = 'a whole number' if whole else 'a number'
            msg = f'{text!r} is not {kind}'
            raise argparse.ArgumentTypeError(msg) from None
        if not math.isfinite(value) or value < low or value > high or (above and value == low):
            msg = f'{text} is out of range: {what}'
            raise argparse.ArgumentTypeError(msg)
        return value

    return parse


def bin_kind(text: str) -> BinSpec:
    """An argparse type: a kind of bin."""
    try:
        return parse_bin(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def arm_name(text: str) -> str:
    """An argparse type: an arm, by its name or by where it stands."""
    try:
        find_arm(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def add_run_options(parser: argparse.ArgumentParser, algorithms: tuple[str, ...]) -> None:
    """Add every option of ``cell run`` to ``parser``."""
    work = parser.add_argument_group('what to pack')
    work.add_argument(
        '--boxes',
        default='',
        metavar='BOXES',
        help=f"{SYNTAX}; default: cartons, the project's own stream of 40",
    )
    work.add_argument(
        '--count',
        type=number(0, 1_000_000, 'it must be 0 to 1000000', whole=True),
        default=0,
        metavar='N',
        help='number of boxes; more than the file holds repeats it, or more are made; 0 (default): '
        'all of it once',
    )
    work.add_argument(
        '--seed',
        type=number(0, 2**31 - 1, 'it must be 0 to 2147483647', whole=True),
        default=0,
        metavar='N',
        help='0 (default): boxes in the order of the file; else they are shuffled with this seed',
    )
    work.add_argument(
        '--bin',
        type=bin_kind,
        default='LDC',
        dest='bin_spec',
        metavar='KIND',
        help='LDC (default), RC, PAL, EQ, SYN, or LxBxH in centimetres such as 100x60x60',
    )
    work.add_argument(
        '--open-bins',
        type=number(1, 3, 'it must be 1, 2 or 3', whole=True),
        default=2,
        metavar='N',
        help='bins open at a time, 1 to 3 (default 2)',
    )
    work.add_argument(
        '--destinations',
        type=number(0, 1000, 'it must be 0 to 1000', whole=True),
        default=0,
        metavar='N',
        help='give each box that has none one of N destinations, D1 to DN, at random, and the bins '
        'to them in turn; 0 (default): none, any box goes into any bin',
    )
    work.add_argument(
        '--serve',
        default='',
        metavar='NAMES',
        help='destinations that the bins serve at the start, with commas between them, where the '
        'boxes bring their own; default those of --destinations',
    )
    plan = parser.add_argument_group('how to decide')
    plan.add_argument(
        '--look-ahead',
        type=number(1, 6, 'it must be 1 to 6', whole=True),
        default=5,
        metavar='N',
        help='boxes the planner may choose from, 1 to 6 (default 5)',
    )
    plan.add_argument(
        '--algorithm', choices=algorithms, default='mpack_lite', help='default mpack_lite'
    )
    plan.add_argument(
        '--profile',
        choices=tuple(PROFILES),
        default='cell',
        help='packing rules: cell (default) has the margins that an arm needs, paper has none',
    )
    plan.add_argument(
        '--size-sigmas',
        type=number(0, 10, 'it must be 0 to 10', whole=False),
        default=-1.0,
        metavar='K',
        help='standard deviations of the scanner that are kept free around a box; default 2 with '
        'profile cell, 0 with paper',
    )
    plan.add_argument(
        '--planner',
        type=planner_value,
        action='append',
        default=[],
        metavar='NAME=VALUE',
        help='a parameter of the planner such as cep=true, selection=largest, closing=oldest, '
        'max_passed_over=10 or weights=2,1,100; more than once for several',
    )
    _add_belt_options(parser.add_argument_group('what comes on the belt'))
    act = parser.add_argument_group('how to act')
    act.add_argument(
        '--arm',
        type=arm_name,
        default=DEFAULT_ARM,
        metavar='NAME',
        help=f'{ARMS_IN_WORDS} (default {DEFAULT_ARM})',
    )
    act.add_argument(
        '--robot',
        choices=tuple(ROBOTS),
        default='',
        help="robot of an arm that moves one, instead of the layout's own (ur20)",
    )
    act.add_argument(
        '--layout',
        type=Path,
        metavar='FILE',
        help='YAML file that says where everything stands; `cell layout` prints and checks one',
    )
    act.add_argument(
        '--grasp-faces',
        choices=tuple(GRASP_FACES),
        default='top',
        help='top (default): boxes stay upright; any: they may also be taken by the front, which '
        'comes up',
    )
    act.add_argument(
        '--deadline',
        type=number(0, 3600, 'it must be above 0 and at most 3600 s', whole=False, above=True),
        default=5.5,
        dest='deadline_s',
        metavar='S',
        help='seconds a box may take, unhidden planning and motion together (default 5.5)',
    )
    act.add_argument(
        '--speed',
        type=number(0, 100, 'it must be 0 to 100', whole=False),
        default=0.0,
        metavar='X',
        help='robot time against wall time: 1 real time, 0 (default) as fast as possible',
    )
    act.add_argument(
        '--respawn',
        action='store_true',
        help='start a node again when it dies, instead of ending the run',
    )
    act.add_argument(
        '--stall-timeout',
        type=number(5, 3600, 'it must be 5 to 3600 s', whole=False),
        default=120.0,
        dest='stall_timeout_s',
        metavar='S',
        help='end the run with an error when nothing happens for so long (default 120)',
    )
    output = parser.add_argument_group('output')
    output.add_argument(
        '--out',
        type=Path,
        metavar='DIR',
        help='folder for summary.json, placements.jsonl, logs (default runs/<time>)',
    )
    output.add_argument('--quiet', action='store_true', help='no progress, only the summary')


def _add_belt_options(belt: argparse._ArgumentGroup) -> None:
    belt.add_argument(
        '--scan-sigma',
        type=number(0, 50, 'it must be 0 to 50 mm', whole=False),
        default=-1.0,
        dest='scan_sigma_mm',
        metavar='MM',
        help='standard deviation of each edge that the scanner measures; with one, weight and '
        'angle are a little off too; default 2 with profile cell, 0 with paper',
    )
    belt.add_argument(
        '--faults',
        default='',
        metavar='RATES',
        help='what goes wrong with how many of the boxes: no_read=0.01,touching=0.005, or all=0.01 '
        'for each of no_read, wrong_size, touching, oversize, overweight, damaged, empty_pick, '
        'duplicate_id, fallen; default none',
    )
    belt.add_argument(
        '--belt-mode',
        choices=('stop_at_pick', 'continuous'),
        default='stop_at_pick',
        help='stop_at_pick (default) turns either way and waits; continuous runs all the time',
    )
    belt.add_argument(
        '--arrivals', default='saturated', metavar='WHEN', help=f'{ARRIVALS} (default saturated)'
    )
    belt.add_argument('--jams', default='', metavar='WHEN', help=f'{JAMS} (default none)')
    belt.add_argument(
        '--max-laps',
        type=number(0, 1_000_000, 'it must be 0 to 1000000', whole=True),
        default=100,
        metavar='N',
        help='a box passed over more often is rejected; 0 for any number (default 100)',
    )


def run_options(arguments: argparse.Namespace) -> RunOptions:
    """The parsed options as a value; what depends on the profile is filled in."""
    given = dict(vars(arguments))
    if given['scan_sigma_mm'] < 0:
        given['scan_sigma_mm'] = SCAN_SIGMA_MM[given['profile']]
    if given['size_sigmas'] < 0:
        given['size_sigmas'] = PROFILES[given['profile']].size_sigmas
    given['planner'] = tuple(given['planner'])
    return RunOptions(**{name: given[name] for name in RunOptions.__dataclass_fields__})
