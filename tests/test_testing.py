"""The example of docs/testing.md, run by a pytest of its own as it is printed there."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.cell

PAGE = Path(__file__).resolve().parents[1] / 'docs' / 'testing.md'
(EXAMPLE,) = re.findall(r'^```python\n(.*?)^```', PAGE.read_text(), re.MULTILINE | re.DOTALL)


def test_the_example_of_the_page_passes(tmp_path: Path) -> None:
    (tmp_path / 'test_mine.py').write_text(EXAMPLE)
    command = [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', 'test_mine.py']
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0, ended.stdout
    assert '2 passed' in ended.stdout
