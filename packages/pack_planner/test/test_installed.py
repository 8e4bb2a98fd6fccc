"""Built as wheels and installed alone, the library works where there is no ROS and no network."""

from __future__ import annotations

import importlib.metadata
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

PACKAGES = Path(__file__).resolve().parents[2]
NAMES = ('pack_msgs_py', 'pack_planner')
#: What the library needs of others, with what numba needs.
NEEDED = ('numpy', 'numba', 'llvmlite')

PROBE = """
import importlib.util, sys
from pathlib import Path
import pack_msgs_py, pack_planner
from pack_planner import Box, pack
for package in (pack_msgs_py, pack_planner):
    assert Path(package.__file__).is_relative_to(sys.prefix), package.__file__
for missing in ('rclpy', 'pack_msgs', 'ortools', 'matplotlib', 'conveyor_sim', 'pack_cell'):
    assert importlib.util.find_spec(missing) is None, missing
boxes = [Box(str(number), (200.0, 200.0, 100.0)) for number in range(8)]
for algorithm in ('first_fit', 'mpack_lite', 'rollout'):
    print(algorithm, pack(boxes, '60x40x40', algorithm, look_ahead=3, open_bins=1).finish())
"""

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


def wheel(package: str, folder: Path) -> Path:
    """A wheel of a package that is built from its folder alone, as from an sdist."""
    copy = folder / f'alone_{package}' / package
    shutil.copytree(PACKAGES / package, copy, ignore=shutil.ignore_patterns('build', '*.egg-info'))
    subprocess.run(
        [
            sys.executable, '-m', 'pip', 'wheel', '--quiet', '--no-deps', '--no-index',
            '--no-build-isolation', '--wheel-dir', folder, copy,
        ],
        check=True,
    )  # fmt: skip
    (built,) = folder.glob(f'{package}-*.whl')
    return built


@pytest.fixture(scope='module')
def wheels(tmp_path_factory):
    folder = tmp_path_factory.mktemp('wheels')
    return {package: wheel(package, folder) for package in NAMES}


@pytest.fixture(scope='module')
def python(wheels, tmp_path_factory):
    """The interpreter of an environment with the wheels and what they need, and nothing else."""
    folder = tmp_path_factory.mktemp('venv')
    subprocess.run([sys.executable, '-m', 'venv', '--without-pip', folder], check=True)
    (site,) = folder.glob('lib/python*/site-packages')
    for name in NEEDED:
        distribution = importlib.metadata.distribution(name)
        here = Path(str(distribution.locate_file('')))
        for part in {Path(str(file)).parts[0] for file in distribution.files or ()} - {'..'}:
            (site / part).symlink_to(here / part)
    for built in wheels.values():
        with zipfile.ZipFile(built) as archive:
            archive.extractall(site)
    return folder / 'bin' / 'python'


def test_a_wheel_says_what_it_needs(wheels):
    with zipfile.ZipFile(wheels['pack_planner']) as archive:
        (name,) = [name for name in archive.namelist() if name.endswith('/METADATA')]
        lines = archive.read(name).decode().splitlines()
    needed = {line.removeprefix('Requires-Dist: ') for line in lines if 'Requires-Dist' in line}
    always = {requirement for requirement in needed if 'extra ==' not in requirement}
    assert always == {'pack_msgs_py', 'numpy', 'numba>=0.58'}
    assert {'Provides-Extra: plot', 'Provides-Extra: solvers'} <= set(lines)


def test_the_library_packs_where_nothing_else_is_installed(python, tmp_path):
    # uncompiled: what is compiled is tested elsewhere, and takes a minute to compile here
    environment = {'PATH': os.environ['PATH'], 'NUMBA_DISABLE_JIT': '1'}
    printed = subprocess.run(
        [python, '-c', PROBE], cwd=tmp_path, env=environment, capture_output=True, text=True,
        check=True,
    ).stdout  # fmt: skip
    assert printed.count('8 boxes in 1 bin, 0 unplaced') == 3


def test_the_node_says_that_it_needs_ros(python, tmp_path):
    start = 'from pack_planner.main import main; main()'
    ended = subprocess.run(
        [python, '-c', start], cwd=tmp_path, env={'PATH': os.environ['PATH']}, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 1
    assert ended.stderr == (
        'planner: the node needs ROS 2; `from pack_planner import pack` does not\n'
    )
