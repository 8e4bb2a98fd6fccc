"""Options that several verbs without a running cell have, each declared once.

Each goes into a parser or a group of it; how a box list is read is as ``cell run`` has it.
"""

from __future__ import annotations

import argparse

from arm_executor.model.robot_data import ROBOTS
from conveyor_sim.streams import Reading
from pack_cell.options.declaration import add_option, declared_options
from pack_cell.options.parsers import CLEARANCE, RESOLUTION, NumberRange, whole
from pack_cell.options.what_to_pack import WhatToPack
from pack_msgs_py.orientation import ORIENTATION_RULES
from pack_msgs_py.profiles import PROFILES


def add_reading(options: argparse._ActionsContainer, *, orders: bool = False) -> None:
    """How a box list is read that does not say so itself; with ``orders`` also what keeps apart."""
    keys = ('units', 'decimal', *(['order_by'] if orders else []))
    for named in declared_options(WhatToPack):
        if named.key in keys:
            add_option(options, named)


def reading_of(arguments: argparse.Namespace) -> Reading:
    """What the options of :func:`add_reading` say."""

    def said(key: str) -> str:
        return str(getattr(arguments, key, ''))

    return Reading(said('units'), said('decimal'), said('order_by'))


def add_profile(options: argparse._ActionsContainer, default: str) -> None:
    """The packing rules."""
    options.add_argument(
        '--profile', choices=tuple(PROFILES), default=default,
        help=f'packing rules (default {default})',
    )  # fmt: skip


def add_rules(options: argparse._ActionsContainer, profile: str, orientations: str = '') -> None:
    """The packing rules, and what to have otherwise; ``orientations`` are usual without them."""
    add_profile(options, profile)
    options.add_argument(
        '--orientations', choices=tuple(ORIENTATION_RULES),
        help=f"orientation rule instead of the profile's own{orientations}",
    )  # fmt: skip
    options.add_argument(
        '--clearance', type=CLEARANCE, default=-1.0, metavar='MM',
        help="air between two boxes, and half of it to a wall, instead of the profile's own "
        f'({CLEARANCE})',
    )  # fmt: skip
    options.add_argument(
        '--resolution', type=RESOLUTION, default=0, metavar='MM',
        help="grid to which positions and sizes are rounded up along x and y, instead of the "
        f"profile's own ({RESOLUTION})",
    )  # fmt: skip


def add_scan_sigma(options: argparse._ActionsContainer, default: float) -> None:
    """How far off the scanner is."""
    options.add_argument(
        '--scan-sigma', type=NumberRange(0, 50, 'mm'), default=default, metavar='MM',
        help=f'standard deviation of each edge that the scanner measures (default {default:g})',
    )  # fmt: skip


def add_seed(options: argparse._ActionsContainer, what: str = '', *, low: int = 0) -> None:
    """The seed of all that is drawn."""
    options.add_argument(
        '--seed', type=whole(low, 2**31 - 1), default=1, metavar='N',
        help=f'{what} (default 1)' if what else 'default 1',
    )  # fmt: skip


def add_jobs(options: argparse._ActionsContainer, more: str = '', *, cluster: bool = False) -> None:
    """Where to compute; ``more`` is said of the number of processes."""
    options.add_argument(
        '--jobs', type=whole(1, 1024), default=1, metavar='N',
        help=f'processes{more} (default 1)',
    )  # fmt: skip
    if cluster:
        options.add_argument(
            '--cluster', metavar='tcp://HOST:PORT',
            help='a running Dask scheduler instead; needs dask and distributed',
        )  # fmt: skip


def add_cell_layout(options: argparse._ActionsContainer) -> None:
    """The layout of the cell, and the robot in it."""
    options.add_argument(
        '--layout', default='', metavar='FILE', help='YAML file; default: the built-in layout'
    )
    options.add_argument(
        '--robot', choices=tuple(ROBOTS), default='', help="robot instead of the layout's own"
    )
