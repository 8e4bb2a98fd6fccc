"""When boxes arrive and when the belt jams: models, files, and what is refused."""

from __future__ import annotations

import itertools
import math

import pytest

from conveyor_sim.belt.jams import find_jams
from conveyor_sim.belt.robot_clock import RobotClock
from conveyor_sim.induct.arrivals import find_arrivals


def times(text, number, seed=0):
    arrivals, times_s = find_arrivals(text, seed), []
    while len(times_s) < number:
        at_s = arrivals.next_s(len(times_s), times_s[-1] if times_s else -1.0)
        times_s += [at_s] * int(arrivals.arrived(at_s) - len(times_s))
    return times_s[:number]


def test_a_saturated_induct_has_always_another_box():
    arrivals = find_arrivals('saturated')
    assert arrivals.arrived(0.0) == math.inf
    assert arrivals.next_s(10**9, 0.0) is None


def test_poisson_arrivals_have_the_rate_and_the_spread_of_a_poisson_process():
    times_s = times('poisson:720', 4000, seed=3)
    gaps = [later_s - time_s for time_s, later_s in itertools.pairwise(times_s)]
    mean = sum(gaps) / len(gaps)
    assert mean == pytest.approx(5.0, rel=0.06)
    deviation = math.sqrt(sum((gap - mean) ** 2 for gap in gaps) / len(gaps))
    assert deviation == pytest.approx(mean, rel=0.08)
    assert times('poisson:720', 50, seed=3) == times_s[:50]
    assert times('poisson:720', 50, seed=4) != times_s[:50]


def test_bursts_come_together():
    assert times('bursts:3,20', 7) == [0.0, 0.0, 0.0, 20.0, 20.0, 20.0, 40.0]


def test_recorded_times_begin_at_the_first_and_begin_again_after_the_last(tmp_path):
    path = tmp_path / 'times.csv'
    path.write_text('stamp,box\n# a shift\n100.5,a\n\n101.5,b\n104.5,c\n')
    assert times(f'recorded:{path}', 6) == [0.0, 1.0, 4.0, 4.0, 5.0, 8.0]


@pytest.mark.parametrize(
    ('content', 'words'),
    [
        ('0\n1\nx\n', "line 3: 'x'"),
        ('0\n5\n4\n', 'before the line above'),
        ('0\nnan\n', 'not finite'),
        ('7\n', 'two different times'),
        ('', 'two different times'),
    ],
)
def test_a_file_of_times_that_cannot_be_used_is_refused_with_its_line(tmp_path, content, words):
    path = tmp_path / 'times.csv'
    path.write_text(content)
    with pytest.raises(ValueError, match=words):
        find_arrivals(f'recorded:{path}')


@pytest.mark.parametrize(
    'content',
    [
        '\ufeff0.0\n1.75\n3.5\n9.25\n',
        'time_s\n0,0\n1,75\n3,50\n9,25\n',
        '0,00\n1,75\n3,50\n9,25\n5009,05\n',
        'time;box\r\n0;1\r\n1.75;2\r\n3.5;3\r\n9.25;4\r\n',
        'Zeit;Box\n0,0;1\n1,75;2\n3,5;3\n9,25;4\n',
        't|box\n0|1\n1.75|2\n3.5|3\n9.25|4\n',
        '0.0,1\n1.75,2\n3.5,3\n9.25,4\n',
    ],
    ids=['bom', 'comma', 'zero', 'semicolon', 'comma-semicolon', 'bar', 'point'],
)
def test_recorded_times_are_read_as_they_are_written(tmp_path, content):
    path = tmp_path / 'times.csv'
    path.write_text(content, encoding='utf-8', newline='')
    assert times(f'recorded:{path}', 4) == [0.0, 1.75, 3.5, 9.25]


def test_a_header_says_that_commas_separate_columns(tmp_path):
    path = tmp_path / 'times.csv'
    path.write_text('time_s,box\n0,1\n5,2\n9,3\n')
    assert times(f'recorded:{path}', 3) == [0.0, 5.0, 9.0]


@pytest.mark.parametrize(
    ('header', 'second_s'),
    [('ms', 0.0015), ('Zeit (min)', 90), ('time_s', 1.5), ('time in h, of the day', 5400)],
)
def test_the_unit_of_a_header_counts(tmp_path, header, second_s):
    path = tmp_path / 'times.csv'
    path.write_text(f'{header}\n0\n1.5\n')
    assert times(f'recorded:{path}', 2) == [0.0, pytest.approx(second_s)]


def test_points_between_thousands_are_no_decimal_points(tmp_path):
    path = tmp_path / 'times.csv'
    path.write_text('0,5\n1.000,5\n')
    with pytest.raises(ValueError, match='points between thousands'):
        find_arrivals(f'recorded:{path}')


def test_commas_that_may_mean_either_are_refused_with_both_readings(tmp_path):
    path = tmp_path / 'times.csv'
    path.write_text('0,0\n1,75\n3,50\n9,25\n')
    with pytest.raises(ValueError, match=r'9\.25 s, or the time 9 s and a second column 25'):
        find_arrivals(f'recorded:{path}')


@pytest.mark.parametrize(
    'text',
    ['', 'often', 'saturated:3', 'poisson', 'poisson:0', 'poisson:nan', 'poisson:-1', 'bursts:3',
     'bursts:0,5', 'bursts:2.5,5', 'bursts:3,inf', 'recorded:', 'recorded:/nowhere.csv'],
)  # fmt: skip
def test_nonsense_is_refused(text):
    with pytest.raises(ValueError, match='arrivals'):
        find_arrivals(text)


def test_jams_at_given_times():
    jams = find_jams('at:30+10,90+5')
    assert [jams.next_change_s(at) for at in (0.0, 29.9, 30.0, 39.9, 40.0)] == [30, 30, 40, 40, 90]
    assert jams.jammed(92.0)
    assert not jams.jammed(95.0)
    assert jams.next_change_s(95.0) == math.inf
    assert find_jams('').next_change_s(0.0) == math.inf


def test_random_jams_come_at_their_rate_and_last_as_long_as_they_should():
    jams, at_s, begun = find_jams('random:60,5', seed=2), 0.0, []
    while len(begun) < 400:
        at_s = jams.next_change_s(at_s)
        assert jams.jammed(at_s)
        begun.append(at_s)
        assert jams.next_change_s(at_s) == pytest.approx(at_s + 5.0)
        at_s = jams.next_change_s(at_s)
    assert begun[-1] / 400 == pytest.approx(65.0, rel=0.15)


@pytest.mark.parametrize(
    'text', ['now', 'random:2', 'random:0,5', 'random:2,nan', 'at:5', 'at:5+0', 'at:5+9,8+1', 'at:']
)
def test_jams_that_make_no_sense_are_refused(text):
    with pytest.raises(ValueError, match='jams'):
        find_jams(text)


def test_robot_time_passes_at_its_speed_and_at_speed_0_only_when_it_is_told():
    clock = RobotClock(4.0)
    clock.restore(10.0, 100.0)
    assert clock.at(101.0) == 14.0
    clock.pass_by(5.0)
    assert clock.at(101.0) == 14.0
    assert clock.wall_s(18.0, 101.0) == 102.0
    clock.set_speed(0.0, 101.0)
    assert clock.at(500.0) == 14.0
    clock.pass_by(2.5)
    clock.skip_to(3.0)
    assert clock.at(500.0) == 16.5
    assert clock.wall_s(20.0, 500.0) is None
