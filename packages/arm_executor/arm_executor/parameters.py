"""Parameters of the node, and the numbers that the core needs of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from arm_executor.arms.registry import ARMS_IN_WORDS, DEFAULT_ARM
from arm_executor.model.pick_area import PickArea
from arm_executor.model.robot_data import ROBOTS
from pack_msgs_py.geometry.tolerance import Tolerance
from pack_msgs_py.orientation import ORIENTATION_RULES, TILT_TIME_S
from pack_msgs_py.parameter_fields import parameter
from pack_msgs_py.profiles import PROFILES, Profile, adapted
from pack_msgs_py.values import BIN_KINDS


@dataclass(frozen=True)
class ExecutorParameters:
    """Parameters of node `arm_executor`; all are read once, at the start."""

    arm: str = parameter(DEFAULT_ARM, f'What moves the boxes: {ARMS_IN_WORDS}.', read_only=True)
    robot: str = parameter(
        '',
        'Robot of an arm that moves one; empty for that of the layout.',
        choices=('', *ROBOTS),
        read_only=True,
    )
    layout: str = parameter(
        '',
        'File that says where everything stands, like `config/layout.yaml`; empty for the default.',
        read_only=True,
    )
    bin_type: str = parameter('LDC', f'Kind of every bin: {BIN_KINDS}.', read_only=True)
    destinations: str = parameter(
        '',
        'Destinations that the bins serve at the start, separated by commas: the first station the '
        'first one and so on, and round again. Empty: any box goes into any bin.',
        read_only=True,
    )
    open_bins: int = parameter(
        1, 'Bins that stand in the cell at a time.', low=1, high=3, read_only=True
    )
    start_bins: str = parameter(
        '',
        'Bins that are part-filled at the start: folder of a run, or a file of `cell journal '
        'export`; what the journal in `state_dir` holds already goes before. Empty: empty bins.',
        read_only=True,
    )
    profile: str = parameter(
        'cell',
        'Packing rules that every placement must obey.',
        choices=tuple(PROFILES),
        read_only=True,
    )
    orientations: str = parameter(
        '',
        "Orientation rule instead of the profile's own; empty keeps that.",
        choices=('', *ORIENTATION_RULES),
        read_only=True,
    )
    size_sigmas: float = parameter(
        -1.0,
        'Standard deviations of the measured size that a placement keeps free, like the planner; '
        "-1 for the profile's own.",
        low=-1.0,
        high=10.0,
        read_only=True,
    )
    clearance_mm: float = parameter(
        -1.0,
        'Air between two boxes, half of it to a wall, before sizes are rounded up, like the '
        "planner; -1 for the profile's own.",
        unit='mm',
        low=-1.0,
        high=100.0,
        read_only=True,
    )
    resolution_mm: int = parameter(
        0,
        'Grid to which x, y, lengths and breadths are rounded up, like the planner; '
        "0 for the profile's own.",
        unit='mm',
        low=0,
        high=100,
        read_only=True,
    )
    speed: float = parameter(
        1.0,
        'Robot seconds per wall-clock second; 0 is as fast as the machine can, and planning then '
        'counts by what was planned, not by the clock.',
        low=0.0,
        high=1000.0,
        read_only=True,
    )
    joint_jerk: float = parameter(
        -1.0,
        'Limit of jerk for planned motions: of the first three joints, those of wrist and rail in '
        "proportion to their accelerations; 0 for none, -1 for the arm's own.",
        unit='rad/s³',
        low=-1.0,
        high=1e5,
        read_only=True,
    )
    tolerance_mm: float = parameter(
        5.0,
        'Farthest that a corner of a box may rest from where it should, on top of what the scanner '
        'may be wrong by, or another box may move.',
        unit='mm',
        low=0.1,
        high=100.0,
        read_only=True,
    )
    angle_tolerance_deg: float = parameter(
        1.0,
        'Farthest that a box may be turned from how it should rest.',
        unit='degrees',
        low=0.1,
        high=45.0,
        read_only=True,
    )
    present_timeout_s: float = parameter(
        30.0,
        'Wall-clock time after which a box that is not at the pick point is given up.',
        unit='s',
        low=0.1,
        high=3600.0,
        read_only=True,
    )
    enforce_deadline: bool = parameter(
        True,
        'Refuse a goal whose predicted time exceeds its deadline. Off: do it, and report it late.',
        read_only=True,
    )
    tilt_time: float = parameter(
        TILT_TIME_S,
        'Robot time in which the tilt tray at the pick point tips a box; as the conveyor has it.',
        unit='s',
        low=0.1,
        high=60.0,
        read_only=True,
    )
    watchdog_s: float = parameter(
        10.0,
        'Motion that makes no progress for so long is stopped; longer when `speed` is below 1.',
        unit='s',
        low=1.0,
        high=3600.0,
        read_only=True,
    )
    acknowledge: str = parameter(
        'operator',
        'Who acknowledges an alarm before the arm moves again: an `operator`, or the cell '
        '`itself`, where nobody stands by, as in a simulation.',
        choices=('operator', 'itself'),
        read_only=True,
    )
    state_dir: str = parameter(
        '', 'Folder of the journal; empty keeps it in memory.', read_only=True
    )
    frame_prefix: str = parameter(
        '',
        'Stands before the name of every frame on `/tf`, such as `north/`, where several cells '
        'share it; frames in the messages of the cell keep their names.',
        read_only=True,
    )
    publish_clock: bool = parameter(
        False,
        'Publish robot time on `/clock` too, for nodes with `use_sim_time`.',
        read_only=True,
    )


@dataclass(frozen=True)
class ExecutorSettings:
    """How the core works; see :class:`ExecutorParameters` for what each value means."""

    profile: Profile
    tolerance: Tolerance
    present_timeout_s: float = 30.0
    enforce_deadline: bool = True
    watchdog_s: float = 10.0
    speed: float = 1.0
    tilt_time_s: float = TILT_TIME_S
    pick_area: PickArea = field(default_factory=PickArea)
    acknowledges_itself: bool = False

    @property
    def counts(self) -> bool:
        """Whether planning counts by what was planned: as fast as possible, no clock tells."""
        return self.speed == 0


def destinations_from(parameters: ExecutorParameters) -> tuple[str, ...]:
    """What the stations serve at the start, in turn; nothing for any box anywhere."""
    names = (name.strip() for name in parameters.destinations.split(','))
    return tuple(name for name in names if name)


def settings_from(
    parameters: ExecutorParameters, lifting_limit_kg: float | None = None
) -> ExecutorSettings:
    """The core's settings; parameters have been checked before.

    Where the arm lifts less than the profile allows, ``lifting_limit_kg`` is the limit; ``None``
    for an arm that lifts any box.
    """
    profile = adapted(
        PROFILES[parameters.profile],
        orientations=parameters.orientations,
        size_sigmas=parameters.size_sigmas,
        clearance_mm=parameters.clearance_mm,
        resolution_mm=parameters.resolution_mm,
    )
    if lifting_limit_kg is not None:
        lift_kg = min(lifting_limit_kg, profile.max_payload_kg or math.inf)
        profile = replace(profile, max_payload_kg=lift_kg)
    return ExecutorSettings(
        profile=profile,
        tolerance=Tolerance(
            position_m=parameters.tolerance_mm / 1e3,
            angle_rad=math.radians(parameters.angle_tolerance_deg),
            others_m=parameters.tolerance_mm / 1e3,
        ),
        present_timeout_s=parameters.present_timeout_s,
        enforce_deadline=parameters.enforce_deadline,
        watchdog_s=parameters.watchdog_s / (min(1.0, parameters.speed) or 1.0),
        speed=parameters.speed,
        tilt_time_s=parameters.tilt_time,
        acknowledges_itself=parameters.acknowledge == 'itself',
    )
