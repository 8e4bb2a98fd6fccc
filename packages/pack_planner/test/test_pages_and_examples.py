"""What docs/algorithms.md shows is run as it stands there, and so is every example."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from pack_planner.algorithms import BUILT_IN, find_algorithm

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / 'docs' / 'algorithms.md'
EXAMPLES = sorted((ROOT / 'examples').glob('*.py'))

#: What each example must print.
SAID = {
    '01_pack_a_csv.py': ['100 boxes in', 'broken rules: []', 'bin 1 at (0, 0, 0) mm'],
    '02_compare_algorithms.py': ['first_fit', 'rollout               5'],
    '03_own_algorithm.py': ['snug: 120 boxes', 'mpack_lite: 120 boxes'],
    '04_own_profile.py': ['paper: 120 boxes', 'careful: 120 boxes', 'broken rules: []'],
    '05_draw_a_bin.py': ['boxes into bin.png'],
}


def own_algorithm() -> str:
    """The page's block that registers an algorithm."""
    blocks = re.findall(r'(?ms)^```python\n(.*?)^```', PAGE.read_text())
    (block,) = [text for text in blocks if "@algorithm('my_rule')" in text]
    return block


def run(script: Path, folder: Path) -> str:
    return subprocess.run(
        [sys.executable, str(script)], cwd=folder, capture_output=True, text=True, check=True
    ).stdout


def test_the_algorithm_of_the_page_has_twenty_lines_and_packs(tmp_path):
    assert own_algorithm().count('\n') <= 20
    (tmp_path / 'mine.py').write_text(own_algorithm())
    printed = run(tmp_path / 'mine.py', tmp_path)
    assert printed.count('200 boxes in') == 3 and 'Traceback' not in printed
    assert find_algorithm(f'{tmp_path}/mine.py:my_rule').name == 'mine.py:my_rule'


def test_the_page_lists_every_built_in_algorithm():
    table = PAGE.read_text().split('## The built-in ones')[1]
    assert set(re.findall(r'`(\w+)`', table)) >= set(BUILT_IN)


@pytest.mark.parametrize('page', [PAGE, ROOT / 'packages' / 'pack_planner' / 'README.md'],
                         ids=lambda page: page.name)  # fmt: skip
def test_the_first_steps_of_a_page_can_be_taken(page, tmp_path):
    blocks = re.findall(r'(?ms)^```python\n(.*?)^```', page.read_text())
    (tmp_path / 'first.py').write_text(blocks[0])
    assert '50 boxes in' in run(tmp_path / 'first.py', tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize('script', EXAMPLES, ids=lambda script: script.name)
def test_an_example_runs_and_fits_on_a_screen(script, tmp_path):
    assert script.read_text().count('\n') <= 50
    printed = run(script, tmp_path)
    for text in SAID[script.name]:
        assert text in printed
    page = (ROOT / 'examples' / 'README.md').read_text()
    assert f'({script.name})' in page
