"""The packages as wheels: without ROS, each imports with what it asks for and nothing else."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import venv
import zipfile
from collections.abc import Iterable, Iterator
from importlib.metadata import Distribution, distribution, distributions
from pathlib import Path, PurePosixPath

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ('pack_msgs_py', 'conveyor_sim', 'pack_planner', 'arm_executor', 'pack_cell')
#: What starts or looks for nodes, and so needs ROS.
NODES = ('.ros', '.running', '.chaos', '.testing', '.cli', '.__main__')
#: What only an extra asks for: a module that needs one of them says so when it is imported.
OPTIONAL = {'distributed', 'matplotlib', 'ortools', 'pinocchio', 'pybullet', 'toppra'}

IMPORT_ALL = """
import importlib, pkgutil, sys

package, nodes, optional = sys.argv[1], sys.argv[2].split(), sys.argv[3].split()
top = importlib.import_module(package)
print(top.__file__)
for module in pkgutil.walk_packages(top.__path__, package + '.', onerror=lambda name: None):
    if module.name.removeprefix(package).startswith(tuple(nodes)):
        continue
    try:
        importlib.import_module(module.name)
    except ModuleNotFoundError as error:
        if error.name.split('.')[0] not in optional:
            raise
"""


def run(*command: object) -> str:
    """What the command prints; what it says when it fails is the reason of the failure."""
    environment = {key: value for key, value in os.environ.items() if key != 'PYTHONPATH'}
    done = subprocess.run(
        [str(word) for word in command],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope='module')
def wheels(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A wheel of each package, built from a copy and without a network."""
    folder = tmp_path_factory.mktemp('wheels')
    ignore = shutil.ignore_patterns('test', '__pycache__', '*.egg-info', 'build')
    for package in PACKAGES:
        shutil.copytree(ROOT / 'packages' / package, folder / 'packages' / package, ignore=ignore)
    run(
        sys.executable, '-m', 'pip', 'wheel', '--quiet', '--no-index', '--no-deps',
        '--no-build-isolation', '--wheel-dir', folder,
        *(folder / 'packages' / package for package in PACKAGES),
    )  # fmt: skip
    return {path.name.split('-')[0]: path for path in folder.glob('*.whl')}


def asked_for(of: Distribution) -> Iterator[str]:
    """Names of the distributions that it needs, without those of extras."""
    for requirement in of.requires or ():
        if 'extra ==' not in requirement:
            yield re.split(r'[^\w.-]', requirement, maxsplit=1)[0]


def with_theirs(names: Iterable[str]) -> dict[str, Distribution]:
    """Those that are installed here, with all that they need in turn."""
    needed: dict[str, Distribution] = {}
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name not in needed and name not in PACKAGES:
            try:
                needed[name] = distribution(name)
            except ModuleNotFoundError:  # for another Python, or for another system
                continue
            waiting += asked_for(needed[name])
    return needed


def link(needed: Distribution, site: Path) -> None:
    """Let the environment have a distribution of this one."""
    for top in {PurePosixPath(str(path)).parts[0] for path in needed.files or ()}:
        target = Path(str(needed.locate_file(top)))
        if top != '..' and target.exists() and not (site / top).exists():
            (site / top).symlink_to(target)


@pytest.mark.parametrize('package', PACKAGES)
def test_a_wheel_imports_without_ros_in_an_environment_of_what_it_asks_for(
    wheels: dict[str, Path], tmp_path: Path, package: str
) -> None:
    venv.create(tmp_path, with_pip=False)
    (site,) = tmp_path.glob('lib/python3.*/site-packages')
    asked, waiting = set(), [package]
    while waiting:
        name = waiting.pop()
        if name in PACKAGES and not (site / name).exists():
            run(
                sys.executable, '-m', 'pip', 'install', '--quiet', '--no-index', '--no-deps',
                '--no-warn-script-location', '--ignore-installed', '--prefix', tmp_path,
                wheels[name],
            )  # fmt: skip
            (own,) = (d for d in distributions(path=[str(site)]) if d.metadata['Name'] == name)
            waiting += asked_for(own)
        asked.add(name)
    for needed in with_theirs(asked).values():
        link(needed, site)
    said = run(
        tmp_path / 'bin' / 'python',
        '-I',
        '-c',
        IMPORT_ALL,
        package,
        ' '.join(NODES),
        ' '.join(OPTIONAL),
    )
    assert said.startswith(str(site))
    with pytest.raises(AssertionError, match="No module named 'rclpy'"):
        run(tmp_path / 'bin' / 'python', '-I', '-c', 'import rclpy')


def test_the_wheel_of_the_cell_carries_what_its_pages_are_made_of(wheels: dict[str, Path]) -> None:
    package = ROOT / 'packages' / 'pack_cell'
    made_of = {
        str(path.relative_to(package))
        for kind in ('css', 'html', 'js', 'csv')
        for path in (package / 'pack_cell').rglob(f'*.{kind}')
    }
    assert len(made_of) > 6
    with zipfile.ZipFile(wheels['pack_cell']) as wheel:
        assert made_of <= set(wheel.namelist())
