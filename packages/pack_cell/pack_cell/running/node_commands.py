"""The commands that start the nodes, and the parameter files they are given."""

from __future__ import annotations

import sys
from pathlib import Path

import yaml

from pack_cell.files import naming
from pack_cell.options.run_options import RunOptions
from pack_cell.ros.executables import NODES, executable
from pack_cell.running.node_parameters import node_parameters, recorder_parameters
from pack_cell.running.supervisor import NodeSpec

#: Name of the node that records.
RECORDER = 'topic_recorder'


def write_parameters(folder: Path, options: RunOptions) -> dict[str, Path]:
    """Write one ROS parameter file per node into ``folder/config``; return their paths."""
    paths = {}
    target = folder / 'config'
    target.mkdir(parents=True, exist_ok=True)
    recorder = recorder_parameters(folder, options.record)
    every = node_parameters(folder, options) | ({RECORDER: recorder} if recorder else {})
    for name, values in every.items():
        path = target / f'{name}.param.yaml'
        with naming(path):
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
            # What it says is in the folder of the run already, and is kept short there.
            '--disable-external-lib-logs',
            *('--params-file', str(parameters[name])),
        ]
        specs.append(NodeSpec(name, command, folder / 'log' / f'{name}.log'))
    if RECORDER in parameters:
        command = [
            sys.executable,
            *('-m', 'pack_cell.ros.topic_recorder'),
            *('--ros-args', '--disable-external-lib-logs'),
            *('--params-file', str(parameters[RECORDER])),
        ]
        log = folder / 'log' / f'{RECORDER}.log'
        specs.append(NodeSpec(RECORDER, command, log, attendant=True))
    return specs
