"""How far a box sinks that was let go a little above what carries it."""

from __future__ import annotations

import pytest

from arm_executor.arms.sinking import MOST_M, sunk
from pack_msgs_py.geometry.pose import Pose

FLOOR = ((0.4, 0.3, 0.198), Pose((0.2, 0.15, 0.099)))
SIZE = (0.4, 0.3, 0.1)


@pytest.mark.parametrize(
    ('x', 'z', 'others', 'rests_at'),
    [
        (0.2, 0.052, [], 0.05),  # on the floor
        (0.2, 0.250, [FLOOR], 0.248),  # on a box that is lower than it was scanned
        (0.2, 0.250, [FLOOR, ((0.4, 0.3, 0.199), Pose((0.5, 0.15, 0.0995)))], 0.249),  # the higher
        (0.2, 0.248, [FLOOR], 0.248),
        (0.2, 0.246, [FLOOR], 0.246),  # into it: not for this to say
        # One of two that carry it is higher than the other, and than it was scanned.
        (0.2, 0.246, [FLOOR, ((0.2, 0.3, 0.18), Pose((0.1, 0.15, 0.09)))], 0.246),
        (0.2, 0.062, [((0.1, 0.3, 0.013), Pose((0.2, 0.15, 0.0065)))], 0.062),
        (0.2, 0.248 + MOST_M + 0.001, [FLOOR], 0.248 + MOST_M + 0.001),
        (0.598, 0.250, [FLOOR], 0.250),  # beside it: on two millimetres nothing stands
    ],
)
def test_a_box_sinks_onto_the_highest_that_carries_it(x, z, others, rests_at):
    pose = sunk(Pose((x, 0.15, z)), SIZE, others)
    assert pose.position == pytest.approx((x, 0.15, rests_at))
