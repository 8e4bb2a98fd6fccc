"""What the options of a run mean for its nodes: their parameters, and whether it can be run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from arm_executor.arms.registry import find_arm
from arm_executor.bins.start_bins import check_start_bins, read_start_bins
from arm_executor.reach.layout_file import find_layout, layout_for
from conveyor_sim.streams import destination_names
from pack_cell.options.declaration import declared_options
from pack_cell.options.run_options import RunOptions, open_stream
from pack_cell.options.usual import GRASP_FACES, SCAN_SIGMA_DEG, SCAN_SIGMA_KG
from pack_cell.recording.reading import next_recording
from pack_cell.report.ended_run import execution_profile
from pack_msgs_py.orientation import TRAY_HEIGHT_MM
from pack_msgs_py.profiles import adapted, find_profile
from pack_msgs_py.values import STATIONS, Box
from pack_planner.algorithms import find_algorithm
from pack_planner.algorithms.tuned_tables import check_table, read_table
from pack_planner.algorithms.tuned_weights import unlike
from pack_planner.parameters import PlannerParameters


def check_cell(options: RunOptions) -> None:
    """Refuse, before the start, what no single option can tell.

    Raises
    ------
    ValueError
        The layout cannot be built or the robot cannot serve it; tuned weights are not for the
        algorithm; bins to begin with cannot be gone on with.
    """
    orders = [name for name in first_orders(options) if ',' in name]
    if orders:
        msg = f'order {orders[0]!r} holds a comma, which separates the names that bins serve'
        raise ValueError(msg)
    bins = dict.fromkeys(STATIONS[: options.open_bins], options.bin_spec)
    if options.grasp_faces == 'tray' and options.belt_mode == 'continuous':
        msg = (
            '--grasp-faces tray needs --belt-mode stop_at_pick: on a belt that runs all the time '
            'boxes pass the pick point, and no tray stands there'
        )
        raise ValueError(msg)
    if find_arm(options.arm).has_driver and options.speed <= 0:
        msg = (
            f'--arm {options.arm} moves a robot, which has its own speed: give --speed 1 '
            '(0 is for arms that only exist here)'
        )
        raise ValueError(msg)
    path = str(options.layout) if options.layout else ''
    layout = layout_for(path, options.robot, bins, must_reach=find_arm(options.arm).moves_robot)
    room_mm = 1000 * layout.conveyor.tallest_box
    if options.grasp_faces == 'tray' and room_mm < TRAY_HEIGHT_MM:
        msg = (
            f'--grasp-faces tray needs {TRAY_HEIGHT_MM:g} mm above the belt for tipped boxes, but '
            f'{layout.robot} waits above conveyor.tallest_box of {room_mm:g} mm: take '
            '--grasp-faces top, or another layout or robot'
        )
        raise ValueError(msg)
    if options.start_bins is not None:
        start, rules = read_start_bins(options.start_bins), execution_profile(options)
        check_start_bins(start, options.bin_spec, options.open_bins, rules)
    if options.tuned is not None:
        algorithm = find_algorithm(options.algorithm)
        check_table(read_table(str(options.tuned)), algorithm.name, algorithm.weights)


def tuned_note(options: RunOptions) -> str:
    """What the tuned weights were made for, where that is not this run; else empty."""
    if options.tuned is None:
        return ''
    profile = adapted(find_profile(options.profile), orientations=GRASP_FACES[options.grasp_faces])
    name = find_algorithm(options.algorithm).name
    entry = read_table(str(options.tuned)).nearest(name, options.bin_spec, profile)
    told = '' if entry is None else unlike(entry, options.bin_spec, profile)
    return f'{options.tuned} was {told}' if told else ''


def node_parameters(folder: Path, options: RunOptions) -> dict[str, dict[str, Any]]:
    """Parameters of each node that differ from its defaults, by node name."""
    state = str(folder / 'state')
    parameters: dict[str, dict[str, Any]] = {
        'conveyor': {
            'weight_sigma': SCAN_SIGMA_KG if options.scan_sigma_mm else 0.0,
            'yaw_sigma': SCAN_SIGMA_DEG if options.scan_sigma_mm else 0.0,
            'tilt_tray': options.grasp_faces == 'tray',
            'state_dir': state,
        },
        'planner': {
            'budget_s': planning_budget_s(options),
            'max_payload_kg': _payload(options),
            'max_passed_over': most_passed_over(options),
        },
        'arm_executor': {
            'destinations': served_at_start(options),
            'state_dir': state,
        },
    }
    for named in declared_options(RunOptions):
        value = getattr(options, named.key)
        if named.declaration.as_parameter is not None:
            value = named.declaration.as_parameter(value)
        for parameter in named.declaration.parameters:
            node, _, name = parameter.partition('.')
            parameters[node][name] = value
    parameters['planner'].update(options.planner)
    parameters['arm_executor'].update(options.executor)
    return parameters


def recorder_parameters(folder: Path, record: str) -> dict[str, Any]:
    """Parameters of the node that records; empty where there is to be none."""
    if record == 'nothing':
        return {}
    file = str(next_recording(folder)) if record == 'all' else ''
    return {'file': file, 'state_dir': str(folder / 'state')}


def served_at_start(options: RunOptions) -> str:
    """What the bins serve at the start, with commas between the names."""
    orders = first_orders(options)
    return options.serve or ','.join(orders or destination_names(options.destinations))


def first_orders(options: RunOptions) -> list[str]:
    """The orders whose boxes come first, one for each open bin; none when they are not kept apart.

    Raises
    ------
    ValueError
        The box file cannot be used with these options.
    """
    stream = open_stream(options)
    if not options.order_by:
        return []
    boxes = (entry for entry in stream.first_round if isinstance(entry, Box))
    names = dict.fromkeys(box.destination for box in boxes)
    return list(names)[: options.open_bins]


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
