"""The commands that start the nodes, and the parameter files they are given."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import yaml

from arm_executor.arms.registry import find_arm
from arm_executor.reach.layout_file import find_layout
from conveyor_sim.streams import destination_names, resolved
from pack_cell.options import GRASP_FACES, SCAN_SIGMA_DEG, SCAN_SIGMA_KG, RunOptions
from pack_cell.ros.executables import executable
from pack_cell.running.supervisor import NodeSpec
from pack_planner.parameters import PlannerParameters

#: Node name to (package, executable).
NODES = {
    'conveyor': ('conveyor_sim', 'conveyor'),
    'planner': ('pack_planner', 'planner'),
    'arm_executor': ('arm_executor', 'arm_executor'),
}


def node_parameters(folder: Path, options: RunOptions) -> dict[str, dict[str, Any]]:
    """Parameters of each node that differ from its defaults, by node name."""
    state = str(folder / 'state')
    return {
        'conveyor': {
            'boxes_file': resolved(options.boxes),
            'count': options.count,
            'seed': options.seed,
            'destinations': options.destinations,
            'size_sigma': options.scan_sigma_mm,
            'weight_sigma': SCAN_SIGMA_KG if options.scan_sigma_mm else 0.0,
            'yaw_sigma': SCAN_SIGMA_DEG if options.scan_sigma_mm else 0.0,
            'faults': options.faults,
            'look_ahead': options.look_ahead,
            'belt_mode': options.belt_mode,
            'arrivals': options.arrivals,
            'jams': options.jams,
            'max_laps': options.max_laps,
            'speed': options.speed,
            'state_dir': state,
        },
        'planner': {
            'algorithm': options.algorithm,
            'profile': options.profile,
            'orientations': GRASP_FACES[options.grasp_faces],
            'size_sigmas': options.size_sigmas,
            'look_ahead': options.look_ahead,
            'deadline_s': options.deadline_s,
            'budget_s': planning_budget_s(options),
            'max_payload_kg': _payload(options),
            'max_passed_over': most_passed_over(options),
            **dict(options.planner),
        },
        'arm_executor': {
            'arm': options.arm,
            'robot': options.robot,
            'layout': str(options.layout.resolve()) if options.layout else '',
            'bin_type': options.bin_spec.name,
            'destinations': options.serve or ','.join(destination_names(options.destinations)),
            'open_bins': options.open_bins,
            'profile': options.profile,
            'orientations': GRASP_FACES[options.grasp_faces],
            'size_sigmas': options.size_sigmas,
            'speed': options.speed,
            'state_dir': state,
        },
    }


def most_passed_over(options: RunOptions) -> int:
    """When the planner must take a box, so that the conveyor does not reject it for its laps.

    On a belt that runs all the time a box passes up to three times while another one is picked, and
    all others of the look-ahead may be due as well.
    """
    usual = PlannerParameters().max_passed_over
    if not options.max_laps:
        return usual
    reserve = 3 * options.look_ahead if options.belt_mode == 'continuous' else 0
    return min(usual, max(1, options.max_laps - reserve))


def planning_budget_s(options: RunOptions) -> float:
    """How long a decision may take, wall seconds.

    Planning that no motion hides counts against the deadline: a tenth of it may be spent so, beside
    three seconds of robot time, which nearly every motion takes. As fast as possible (speed 0) a
    motion hides next to nothing.
    """
    hidden_s = 3.0 / options.speed if options.speed else 0.0
    return min(PlannerParameters().budget_s, options.deadline_s / 10 + hidden_s)


def _payload(options: RunOptions) -> float:
    """What the arm lifts, kg; 0 for one that lifts any box."""
    lifting_limit = find_arm(options.arm).lifting_limit
    if lifting_limit is None:
        return 0.0
    path = str(options.layout) if options.layout else ''
    return lifting_limit(find_layout(path, options.robot))


def write_parameters(folder: Path, options: RunOptions) -> dict[str, Path]:
    """Write one ROS parameter file per node into ``folder/config``; return their paths."""
    paths = {}
    target = folder / 'config'
    target.mkdir(parents=True, exist_ok=True)
    for name, values in node_parameters(folder, options).items():
        path = target / f'{name}.param.yaml'
        path.write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}, sort_keys=False))
        paths[name] = path
    return paths


def node_specs(folder: Path, parameters: dict[str, Path]) -> list[NodeSpec]:
    """How to start each node of a run whose files live in ``folder``."""
    specs = []
    for name, (package, program) in NODES.items():
        command = [
            sys.executable,
            str(executable(package, program)),
            '--ros-args',
            '--params-file',
            str(parameters[name]),
        ]
        specs.append(NodeSpec(name, command, folder / 'log' / f'{name}.log'))
    return specs
