"""Times, vectors, poses: the parts that messages are made of."""

from __future__ import annotations

from math import floor

from builtin_interfaces.msg import Duration as DurationMsg
from builtin_interfaces.msg import Time as TimeMsg
from geometry_msgs.msg import Pose as PoseMsg
from geometry_msgs.msg import Vector3

from pack_msgs_py.checks import REACH_M, check_pose, check_range, check_seconds, check_vec3
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Vec3

#: Whole seconds of builtin_interfaces/Duration and Time are an int32.
_LONGEST_S = 2.0**31 - 1
_LAST_SECOND, _LAST_NANOSECOND = 2**31 - 1, 999_999_999
#: A difference of two times that should be zero may be so little below it.
_ROUNDING_S = 1e-3


def time_to_ros(seconds: float) -> TimeMsg:
    """Seconds since the epoch as builtin_interfaces/Time."""
    whole = floor(seconds)
    nanoseconds = min(999_999_999, round((seconds - whole) * 1e9))
    return TimeMsg(sec=whole, nanosec=nanoseconds)


def time_from_ros(msg: TimeMsg, name: str = 'stamp') -> float:
    """builtin_interfaces/Time as seconds since the epoch; refuses what is before it."""
    check_range(f'{name}.sec', msg.sec, 0, _LAST_SECOND)
    check_range(f'{name}.nanosec', msg.nanosec, 0, _LAST_NANOSECOND)
    return float(msg.sec) + 1e-9 * float(msg.nanosec)


def duration_to_ros(seconds: float) -> DurationMsg:
    """Seconds as builtin_interfaces/Duration, which ends at 68 years either way."""
    total = round(max(-_LONGEST_S, min(_LONGEST_S, seconds)) * 1e9)
    return DurationMsg(sec=total // 1_000_000_000, nanosec=total % 1_000_000_000)


def duration_from_ros(msg: DurationMsg, name: str = 'duration', low: float = -_ROUNDING_S) -> float:
    """builtin_interfaces/Duration as seconds, from ``low`` on; refuses what nothing takes."""
    check_range(f'{name}.nanosec', msg.nanosec, 0, _LAST_NANOSECOND)
    return check_seconds(name, float((msg.sec * 1_000_000_000 + msg.nanosec) / 1e9), low=low)


def vector_to_ros(value: Vec3, scale: float = 1.0) -> Vector3:
    """Three numbers times ``scale`` as geometry_msgs/Vector3."""
    return Vector3(x=float(value[0] * scale), y=float(value[1] * scale), z=float(value[2] * scale))


def vector_from_ros(name: str, msg: Vector3, scale: float = 1.0) -> Vec3:
    """geometry_msgs/Vector3 times ``scale``; refuses what is not finite, or beyond all reach."""
    x, y, z = check_vec3(name, (msg.x, msg.y, msg.z), REACH_M)
    return (x * scale, y * scale, z * scale)


def pose_to_ros(pose: Pose) -> PoseMsg:
    """A pose as geometry_msgs/Pose."""
    msg = PoseMsg()
    msg.position.x, msg.position.y, msg.position.z = (float(v) for v in pose.position)
    orientation = msg.orientation
    orientation.x, orientation.y, orientation.z, orientation.w = (float(v) for v in pose.quaternion)
    return msg


def pose_from_ros(name: str, msg: PoseMsg) -> Pose:
    """geometry_msgs/Pose as a value; refuses what is not finite or not a unit quaternion."""
    position, orientation = msg.position, msg.orientation
    return check_pose(
        name,
        Pose(
            (position.x, position.y, position.z),
            (orientation.x, orientation.y, orientation.z, orientation.w),
        ),
    )


def tidy(value: Vec3) -> Vec3:
    """Millimetres without the noise of the trip through metres (kept to 1 nm)."""
    x, y, z = (round(v, 6) for v in value)
    return (x, y, z)
