"""Arguments of the launch file: those of ``cell run``, as parameters of the nodes.

Knows nothing of launch, so that it can be tested where launch is not installed.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from arm_executor.arms.registry import ARMS_IN_WORDS, DEFAULT_ARM
from arm_executor.model.robot_data import ROBOTS
from pack_cell.cli import check_boxes, check_cell
from pack_cell.options import OneLineParser, add_run_options, run_options
from pack_cell.running.node_commands import node_parameters
from pack_planner.algorithms import ALGORITHMS

#: Argument to (option of ``cell run``, default, what it is); empty: the option's own default.
ARGUMENTS = {
    'boxes_file': ('--boxes', '', 'what to pack, as for `cell run --boxes`; empty: the cartons'),
    'count': ('--count', '0', 'number of boxes; 0: the whole stream'),
    'seed': ('--seed', '0', 'seed of the shuffle; 0: as listed'),
    'bin_type': ('--bin', 'LDC', 'LDC, RC, PAL, EQ, SYN or LxBxH in centimetres'),
    'open_bins': ('--open-bins', '2', 'bins open at a time, 1 to 3'),
    'destinations': ('--destinations', '0', 'destinations of boxes and bins; 0: none'),
    'serve': ('--serve', '', 'destinations that the bins serve, where boxes bring their own'),
    'look_ahead': ('--look-ahead', '5', 'boxes the planner may choose from, 1 to 6'),
    'algorithm': ('--algorithm', 'mpack_lite', 'packing algorithm'),
    'profile': ('--profile', 'cell', 'packing rules: paper or cell'),
    'size_sigmas': ('--size-sigmas', '', "sigmas kept free around a box; empty: the profile's"),
    'deadline_s': ('--deadline', '5.5', 'seconds a box may take'),
    'speed': ('--speed', '1.0', 'robot time against wall time; 0: as fast as possible'),
    'scan_sigma': ('--scan-sigma', '', 'error of a measured edge, mm; empty: 2, paper 0'),
    'faults': ('--faults', '', 'what goes wrong, such as all=0.01 or no_read=0.02'),
    'belt_mode': ('--belt-mode', 'stop_at_pick', 'stop_at_pick or continuous'),
    'arrivals': ('--arrivals', 'saturated', 'when boxes come, such as poisson:900'),
    'jams': ('--jams', '', 'when the belt jams, such as random:600,20'),
    'max_laps': ('--max-laps', '100', 'a box passed over more often is rejected; 0: never'),
    'arm': ('--arm', DEFAULT_ARM, ARMS_IN_WORDS),
    'robot': ('--robot', '', f'{", ".join(ROBOTS)}; empty: that of the layout'),
    'grasp_faces': ('--grasp-faces', 'top', 'top: boxes stay upright; any: by the front too'),
    'layout': ('--layout', '', 'YAML file of the layout; empty: the default'),
}


def launched_nodes(values: Mapping[str, str], state_dir: str = '') -> dict[str, dict[str, Any]]:
    """Parameters of each node, by its name, for ``values`` of :data:`ARGUMENTS`.

    ``state_dir`` is the folder of the journals; with an empty one state is lost with the node.

    Raises
    ------
    SystemExit
        A value is no value of its option; the message is on stderr.
    ValueError, OSError
        The cell cannot be run so.
    """
    parser = OneLineParser(prog='cell.launch.py')
    add_run_options(parser, tuple(ALGORITHMS))
    given = [f'{ARGUMENTS[name][0]}={value}' for name, value in values.items() if value]
    options = run_options(parser.parse_args(given))
    check_boxes(options)
    check_cell(options)
    found = node_parameters(Path(), options)
    for parameters in found.values():
        if 'state_dir' in parameters:
            parameters['state_dir'] = state_dir
    return found
