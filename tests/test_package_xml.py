"""What a package imports is what its package.xml, or the recipe for a plain Jazzy, installs."""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ('pack_msgs_py', 'conveyor_sim', 'pack_planner', 'arm_executor', 'pack_cell')
#: The key of rosdep, or the package of pip, by the module where they are called otherwise.
CALLED = {
    'jinja2': 'python3-jinja2',
    'joblib': 'python3-joblib',
    'markupsafe': 'python3-jinja2',
    'matplotlib': 'python3-matplotlib',
    'numba': 'python3-numba',
    'numpy': 'python3-numpy',
    'openpyxl': 'python3-openpyxl',
    'PIL': 'python3-pil',
    'pybullet': 'python3-pybullet-pip',
    'pytest': 'python3-pytest',
    'rich': 'python3-rich',
    'scipy': 'python3-scipy',
    'toppra': 'python3-toppra-pip',
    'websockets': 'viser',
    'yaml': 'python3-yaml',
}
#: Asked for by a sentence when they are needed.
ON_DEMAND = {'distributed'}


def imported(package: str) -> set[str]:
    """Modules, other than Python's own, that the code of a package imports."""
    names: set[str] = set()
    for path in (ROOT / 'packages' / package / package).rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names.add(node.module.partition('.')[0])
            elif isinstance(node, ast.Import):
                names |= {alias.name.partition('.')[0] for alias in node.names}
    return names - set(sys.stdlib_module_names) - {package} - ON_DEMAND


@pytest.mark.parametrize('package', PACKAGES)
def test_a_package_says_all_that_it_needs(package: str) -> None:
    xml = (ROOT / 'packages' / package / 'package.xml').read_text()
    declared = set(re.findall(r'<\w*depend>([^<]+)<', xml))
    recipe = (ROOT / 'docs' / 'running.md').read_text()
    by_pip = set(' '.join(re.findall(r'^pip install ([^#\n]+)', recipe, re.M)).split())
    needed = {CALLED.get(name, name) for name in imported(package)}
    assert needed - declared - by_pip == set()
