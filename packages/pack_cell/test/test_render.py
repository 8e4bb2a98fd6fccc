"""Pictures and films of a run, drawn without a screen."""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from test_replay_moments import carried_box

from arm_executor.arms.physics.render import Camera
from pack_cell.options.parsers import BadValue
from pack_cell.recording.heard import FixedFrame, JointPositions, RobotText
from pack_cell.render.command import _moments, picture_size
from pack_cell.render.files import check_kind, write_film
from pack_cell.render.pictures import Filming
from pack_msgs_py.geometry.pose import Pose


def colours(shades: int):
    return iter(np.full((20, 30, 3), 40 * n, dtype=np.uint8) for n in range(shades))


def test_a_film_has_every_frame_and_a_picture_the_first(tmp_path: Path) -> None:
    write_film(tmp_path / 'deep' / 'film.gif', colours(5), 10.0)
    with Image.open(tmp_path / 'deep' / 'film.gif') as film:
        assert (film.n_frames, film.size, film.info['duration']) == (5, (30, 20), 100)
    write_film(tmp_path / 'one.png', colours(5), 10.0)
    with Image.open(tmp_path / 'one.png') as picture:
        assert picture.getpixel((0, 0)) == (0, 0, 0)


@pytest.mark.skipif(not shutil.which('ffprobe'), reason='no ffmpeg here')
def test_a_film_is_an_mp4_of_every_frame_that_any_player_shows(tmp_path: Path) -> None:
    path = tmp_path / 'deep' / 'film.mp4'
    write_film(path, iter(np.full((64, 96, 3), 40 * n, dtype=np.uint8) for n in range(6)), 10.0)
    entries = 'stream=codec_name,width,height,pix_fmt,r_frame_rate,nb_frames'
    command = ['ffprobe', '-v', 'error', '-show_entries', entries, '-of', 'json', str(path)]
    told = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert json.loads(told.stdout)['streams'] == [
        {
            'codec_name': 'h264', 'width': 96, 'height': 64, 'pix_fmt': 'yuv420p',
            'r_frame_rate': '10/1', 'nb_frames': '6',
        }
    ]  # fmt: skip


@pytest.mark.skipif(not shutil.which('ffmpeg'), reason='no ffmpeg here')
def test_what_ffmpeg_cannot_write_is_told(tmp_path: Path) -> None:
    (tmp_path / 'film.mp4').mkdir()
    frames = iter(np.zeros((640, 960, 3), dtype=np.uint8) for _ in range(9))
    with pytest.raises(OSError, match='could not write'):
        write_film(tmp_path / 'film.mp4', frames, 10.0)


def test_a_file_that_cannot_be_written_is_told_before_anything_is_drawn(monkeypatch) -> None:
    with pytest.raises(ValueError, match='must end in'):
        check_kind(Path('film.avi'))
    monkeypatch.setenv('PATH', '')
    with pytest.raises(ValueError, match='ffmpeg'):
        check_kind(Path('film.mp4'))


def test_a_size_is_read_or_refused() -> None:
    assert picture_size('960x640') == (960, 640)
    for text in ('960', '961x640', '96000x640', '0x0'):
        with pytest.raises(BadValue):
            picture_size(text)


def options(**given: object) -> argparse.Namespace:
    usual = {'from_s': None, 'to_s': None, 'fps': 10.0, 'speed': 2.0}
    return argparse.Namespace(**(usual | given))


def test_the_moments_of_a_film_lie_as_far_apart_as_speed_and_rate_say() -> None:
    assert _moments(options(from_s=1.0, to_s=2.0), 2.0, 9.0, one=False) == pytest.approx(
        [1.0, 1.2, 1.4, 1.6, 1.8, 2.0]
    )
    assert _moments(options(from_s=8.9), 2.0, 9.0, one=False) == [8.9]
    assert _moments(options(), 2.0, 9.0, one=True) == [9.0]
    assert _moments(options(), 2.0, 9.0, one=False)[0] == 2.0, 'where the first decision is'
    with pytest.raises(ValueError, match='ends at 9 s'):
        _moments(options(from_s=10.0), 2.0, 9.0, one=False)


@pytest.mark.physics
def test_a_run_is_drawn_and_what_moves_is_seen_to_move() -> None:
    urdf = (
        '<robot name="r"><link name="cell"/><link name="tcp"><inertial><mass value="1"/>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial><visual><geometry>'
        '<sphere radius="0.2"/></geometry></visual></link><joint name="rail" type="prismatic">'
        '<parent link="cell"/><child link="tcp"/><origin xyz="0 0 1"/><axis xyz="1 0 0"/>'
        '<limit lower="-1" upper="1" effort="9" velocity="9"/></joint></robot>'
    )
    run = carried_box(
        (0.0, RobotText(urdf)),
        (0.0, FixedFrame('belt', 'cell', Pose((0.0, 0.55, 0.75)))),
        *((when, JointPositions(('rail',), (at,))) for when, at in ((0.0, -0.5), (4.0, 0.5))),
    )
    filming = Filming(run)
    try:
        before, same, after = (filming.picture(t, 96, 64, Camera()) for t in (0.2, 0.2, 5.0))
    finally:
        filming.close()
    assert before.shape == (64, 96, 3)
    assert np.array_equal(before, same)
    assert np.abs(before.astype(int) - after).max() > 30
