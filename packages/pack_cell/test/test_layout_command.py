"""``cell layout`` prints, judges and draws a layout; ``cell run`` refuses one that cannot work."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip('pybullet')
pytest.importorskip('toppra')

from arm_executor.model.layout import Layout, Rail
from arm_executor.reach.layout_file import default_layout, find_layout, load_layout
from arm_executor.reach.reach import probe_places
from pack_cell.cli import main
from pack_cell.layout.verdict import judge
from pack_msgs_py.values import parse_bin

pytestmark = pytest.mark.physics


def test_printed_layout_is_a_file_that_can_be_read_again(capsys, tmp_path):
    assert main(['layout', '--robot', 'ur30']) == 0
    path = tmp_path / 'layout.yaml'
    path.write_text(capsys.readouterr().out)
    assert load_layout(path) == default_layout('ur30')


def test_check_prints_a_row_for_each_station_and_draws_a_picture(capsys, tmp_path):
    picture = tmp_path / 'deep' / 'reach.png'
    code = main(['layout', '--check', '--bin', 'SYN', '--samples', '4', '--png', str(picture)])
    lines = capsys.readouterr().out.splitlines()
    assert code == 0
    assert 'ur20' in lines[0]
    rows = [line.split() for line in lines[2:5]]
    assert [row[:3] for row in rows] == [['SYN', station, '72'] for station in 'ABC']
    assert all(row[3] == '100%' for row in rows)
    assert picture.read_bytes().startswith(b'\x89PNG')


def test_short_arm_is_refused_with_the_reason_and_code_1(capsys):
    assert main(['layout', '--check', '--robot', 'ur5e', '--bin', 'PAL', '--samples', '0']) == 1
    text = capsys.readouterr().out
    assert 'refused: layout: ur5e (reach 0.85 m) reaches' in text
    assert 'take a longer arm than ur5e' in text


def test_the_arm_that_reaches_farthest_is_not_told_to_be_longer(capsys):
    assert (
        main(['layout', '--check', '--bin', '400x120x80', '--samples', '0', '--least', '99']) == 1
    )
    text = capsys.readouterr().out
    assert 'no arm that is known reaches farther: change rail' in text
    assert 'longer arm' not in text


@pytest.mark.parametrize('robot', ['ur5e', 'ur16e'])
def test_short_arm_in_its_own_layout_packs_small_bins(robot):
    verdict = judge(find_layout('', robot), parse_bin('SYN'), samples=2, least=0.9)
    assert verdict.refusal == ''
    assert all(reach.within(8.0) == 1.0 for reach in verdict.stations)


def test_share_below_the_threshold_is_refused_with_both_shares(capsys):
    options = ['--robot', 'ur30', '--bin', 'PAL', '--samples', '0', '--least', '99']
    assert main(['layout', '--check', *options]) == 1
    assert 'reaches 63% of bin A (PAL), at least 99% are needed' in capsys.readouterr().out


@pytest.mark.parametrize(
    ('content', 'message'),
    [
        ('stations: {gap_x: 0.1}', 'overlaps bin A'),
        ('rail: {speed: .nan}', 'rail.speed is nan; it must be finite'),
        ('robot: kuka', "unknown robot 'kuka'"),
    ],
)
def test_bad_layout_is_named_by_layout_and_by_run_before_anything_starts(
    tmp_path, capsys, content, message
):
    path = tmp_path / 'layout.yaml'
    path.write_text(content)
    assert main(['layout', '--check', '--layout', str(path), '--bin', 'EQ']) == 1
    said = capsys.readouterr()
    assert message in said.out + said.err
    assert main(['run', '--layout', str(path), '--out', str(tmp_path / 'run')]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / 'run').exists()


@pytest.mark.parametrize(
    ('options', 'message'),
    [
        (['--png', 'reach.gif'], 'must end in .png'),
        (['--bin', 'LDX'], 'unknown bin'),
        (['--robot', 'ur7'], 'invalid choice'),
        (['--least', '101'], '0 to 100'),
    ],
)
def test_wrong_option_is_one_line_and_code_2(options, message, capsys):
    with pytest.raises(SystemExit) as caught:
        main(['layout', '--check', *options])
    assert caught.value.code == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count('\n') == 1


def test_places_cover_the_bin_every_ten_centimetres_from_wall_to_wall():
    places = probe_places(parse_bin('EQ'))
    assert places[:, 0].min() == pytest.approx(0.154)
    assert places[:, 0].max() == pytest.approx(0.646)
    assert np.diff(np.unique(places[:, 1].round(6))).max() <= 0.1 + 1e-9
    assert set(places[:, 2].round(6)) == {0.1, 0.4, 0.7}


def test_floor_of_a_deep_bin_is_in_reach_of_the_joints_but_behind_its_wall():
    low = Layout(rail=Rail(base_height=1.30))
    verdict = judge(low, parse_bin('80x80x160'), samples=0, least=0.0)
    station = verdict.stations[0]
    floor = station.places[:, 2] < 0.2
    assert not station.free[floor].any()
    assert station.free[~floor].all()
    assert station.blocked_by['upper_arm_link and bin A front wall'] > 10
    assert sum(station.blocked_by.values()) == np.count_nonzero(~station.free)
