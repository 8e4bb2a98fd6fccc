"""The options of ``cell run``, of ``cell demo`` and of the launch file, each declared once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from arm_executor.arms.registry import DEFAULT_ARM, find_arm
from conveyor_sim.streams import Reading, Stream
from pack_cell.options.declaration import DEFAULT_PROFILE, add_options, declared_options
from pack_cell.options.how_to_act import HowToAct
from pack_cell.options.how_to_decide import HowToDecide
from pack_cell.options.output import Output
from pack_cell.options.parsers import OneLineParser
from pack_cell.options.usual import usual_faces
from pack_cell.options.what_comes import WhatComes
from pack_cell.options.what_to_pack import WhatToPack


@dataclass(frozen=True)
class RunOptions(Output, HowToAct, WhatComes, HowToDecide, WhatToPack):
    """Everything that fixes a run, in the order of its bases from last to first."""


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
