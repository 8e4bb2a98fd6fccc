"""Options of a run: how to act."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from arm_executor.arms.registry import ARMS, DEFAULT_ARM, find_arm
from arm_executor.model.robot_data import ROBOTS
from pack_cell.options.declaration import option
from pack_cell.options.executor_values import executor_value
from pack_cell.options.parsers import NumberRange, OneOf, checked, optional_path
from pack_cell.options.usual import GRASP_FACES, USUAL_FACES
from pack_msgs_py.orientation import TILT_TIME_S
from pack_msgs_py.parameter_fields import Value

_GROUP = 'how to act'


@dataclass(frozen=True)
class HowToAct:
    """Of a run: how to act. Lengths in millimetres, times in seconds."""

    arm: str = option(
        DEFAULT_ARM,
        'which arm',
        _GROUP,
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
        _GROUP,
        read=OneOf(lambda: tuple(ROBOTS)),
        default_text='that of the layout, `ur20`',
        parameters=('arm_executor.robot',),
    )
    layout: Path | None = option(
        '',
        'YAML file that says where everything stands; `cell layout` prints and checks one',
        _GROUP,
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
        _GROUP,
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
        _GROUP,
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
        _GROUP,
        name='tilt_time',
        read=NumberRange(0.1, 60, 's'),
        metavar='S',
        see='cell_layout.md#the-tilt-tray',
        parameters=('conveyor.tilt_time', 'arm_executor.tilt_time'),
    )
    deadline_s: float = option(
        '5.5',
        'seconds a box may take, unhidden planning and motion together',
        _GROUP,
        name='deadline',
        read=NumberRange(0, 3600, 's', above=True),
        metavar='S',
        parameters=('planner.deadline_s',),
    )
    speed: float = option(
        '0',
        'robot time against wall time: 1 real time, 0 as fast as possible',
        _GROUP,
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
        _GROUP,
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
        _GROUP,
        flag=True,
        launched=False,
        resumable=True,
    )
    stall_timeout_s: float = option(
        '120',
        'end the run with an error when nothing happens for so long',
        _GROUP,
        name='stall_timeout',
        read=NumberRange(5, 3600, 's'),
        metavar='S',
        launched=False,
        resumable=True,
    )
