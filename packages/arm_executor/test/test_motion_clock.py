"""Robot time: what the arm moved, and what it stood still."""

import pytest

from arm_executor.goals.motion_clock import MotionClock


class Wall:
    """A steady clock that stands until it is set."""

    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.mark.parametrize('speed', [0.0, 1.0, 2.0])
def test_a_motion_takes_its_own_time_however_long_it_took_on_the_wall(speed: float) -> None:
    wall = Wall()
    clock = MotionClock(speed, wall)
    start_s = clock.at(5.0)
    wall.now_s += 0.3
    assert clock.at(7.0) - start_s == pytest.approx(2.0)


@pytest.mark.parametrize(('speed', 'passed_s'), [(0.0, 0.0), (1.0, 3.0), (2.0, 6.0)])
def test_standing_still_takes_as_long_as_on_the_wall_at_that_speed(
    speed: float, passed_s: float
) -> None:
    wall = Wall()
    clock = MotionClock(speed, wall)
    start_s = clock.at(5.0)
    wall.now_s += 3.0
    assert clock.at(5.0) - start_s == pytest.approx(passed_s)


def test_an_arm_that_counts_no_time_lives_by_the_wall() -> None:
    wall = Wall()
    clock = MotionClock(0.0, wall)
    start_s = clock.at(None)
    wall.now_s += 3.0
    assert clock.at(None) - start_s == pytest.approx(3.0)
