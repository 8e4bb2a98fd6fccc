"""What the arm `trajectory` has to know of its robot: names, pins, tolerances.

The defaults are those of the driver of Universal Robots on Jazzy (docs/real_arm.md).
"""

from __future__ import annotations

from dataclasses import dataclass

from pack_msgs_py.parameter_fields import parameter

#: Limit of jerk where `joint_jerk` says none, rad/s3.
USUAL_JERK = 500.0


@dataclass(frozen=True)
class TrajectoryParameters:
    """Parameters `trajectory.*` of node `arm_executor`; names are relative to its namespace."""

    controller: str = parameter(
        'scaled_joint_trajectory_controller',
        'Controller with an action `follow_joint_trajectory` (control_msgs/FollowJointTrajectory) '
        'for the six joints; `passthrough_trajectory_controller` is another.',
        read_only=True,
    )
    stop_by: str = parameter(
        'ramp',
        'How a motion is stopped: `ramp` replaces its trajectory by one that slows down along the '
        'path as fast as the load bears; `cancel` cancels it and leaves that to the controller, as '
        'one that refuses a second trajectory (passthrough) needs.',
        choices=('ramp', 'cancel'),
        read_only=True,
    )
    rail_controller: str = parameter(
        '',
        'Controller of the rail, the same kind of action for one joint; the name of `controller` '
        'for one that takes all seven. Empty: there is no rail, and the layout has it fixed.',
        read_only=True,
    )
    rail_joint: str = parameter('rail_joint', 'Name of that joint.', read_only=True)
    joint_prefix: str = parameter(
        '', 'What stands before the names of the six joints, `tf_prefix` of the driver.',
        read_only=True,
    )  # fmt: skip
    joint_states: str = parameter(
        'joint_states', 'Topic of the measured joints (sensor_msgs/JointState).', read_only=True
    )
    status: str = parameter(
        'io_and_status_controller',
        'Controller that publishes `robot_mode`, `safety_mode`, `robot_program_running` and '
        '`io_states`, and serves `set_io` and `set_payload`; empty for a robot without one.',
        read_only=True,
    )
    speed_scaling: str = parameter(
        'speed_scaling_state_broadcaster/speed_scaling',
        'Topic that says how fast trajectories are run, in percent (std_msgs/Float64); empty for a '
        'robot that always runs them at full speed.',
        read_only=True,
    )
    vacuum_output: int = parameter(
        0, 'Digital output that switches the vacuum on.', low=0, high=17, read_only=True
    )
    vacuum_input: int = parameter(
        0,
        'Digital input that is on while the vacuum holds.',
        low=0,
        high=17,
        read_only=True,
    )
    blow_off_output: int = parameter(
        -1,
        'Digital output that blows the box off the pad while the vacuum goes; -1 for none.',
        low=-1,
        high=17,
        read_only=True,
    )
    vacuum_service: str = parameter(
        '',
        'Service that switches the vacuum (std_srvs/SetBool), instead of `set_io`.',
        read_only=True,
    )
    vacuum_topic: str = parameter(
        '',
        'Topic that is true while the vacuum holds (std_msgs/Bool), instead of `io_states`.',
        read_only=True,
    )
    grip_timeout_s: float = parameter(
        1.5, 'Time in which the vacuum must build up.', unit='s', low=0.05, high=30.0,
        read_only=True,
    )  # fmt: skip
    release_timeout_s: float = parameter(
        1.5, 'Time in which it must be gone.', unit='s', low=0.05, high=30.0, read_only=True
    )
    point_period_s: float = parameter(
        0.02, 'Time between two points of a trajectory.', unit='s', low=0.004, high=0.2,
        read_only=True,
    )  # fmt: skip
    path_tolerance: float = parameter(
        0.2, 'Farthest that a joint may be from its path, metres for the rail; a robot lags behind '
        'by some hundredths of a second.', unit='rad',
        low=0.001, high=1.0, read_only=True,
    )  # fmt: skip
    goal_tolerance: float = parameter(
        0.01, 'The same at the end of it.', unit='rad', low=0.0005, high=0.2, read_only=True
    )
    goal_time_tolerance_s: float = parameter(
        1.0,
        'How much later than planned a joint may come there, at the speed that the robot runs at.',
        unit='s',
        low=0.05,
        high=60.0,
        read_only=True,
    )
    start_tolerance: float = parameter(
        0.01,
        'A motion begins only when every joint is so near to where it was planned from.',
        unit='rad',
        low=0.001,
        high=0.1,
        read_only=True,
    )
    robot_description: str = parameter(
        'robot_description',
        'Topic of the URDF of the driver (std_msgs/String), which is held against the model of the '
        'robot; empty: it is not looked at.',
        read_only=True,
    )
    model_tolerance: float = parameter(
        0.03,
        'Farthest that the flange of that URDF may be from where the model has it; more is another '
        'robot, or another mounting, and refused.',
        unit='m',
        low=0.0001,
        high=1.0,
        read_only=True,
    )
    silent_s: float = parameter(
        1.0, 'Measured joints older than this are no longer believed.', unit='s', low=0.05,
        high=10.0, read_only=True,
    )  # fmt: skip
    connect_timeout_s: float = parameter(
        60.0, 'How long the driver is waited for at the start.', unit='s', low=1.0, high=3600.0,
        read_only=True,
    )  # fmt: skip
