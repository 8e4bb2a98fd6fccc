"""The code of docs/integration.md, run as it is printed there, against the real other nodes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pack_cell.testing import NodeGroup
from pack_msgs_py.codes import BoxEventKind

pytestmark = pytest.mark.cell

PAGE = Path(__file__).resolve().parents[1] / 'docs' / 'integration.md'
SCANNER, ARM, EXECUTOR = re.findall(
    r'^```python\n(.*?)^```', PAGE.read_text(), re.MULTILINE | re.DOTALL
)


def placed(group: NodeGroup) -> int:
    return group.record.count(BoxEventKind.PLACED)


def test_a_scanner_of_ones_own_feeds_the_cell(group: NodeGroup) -> None:
    group.start('arm_executor', arm='timed', speed=0.0, orientations='upright')
    group.start('planner', orientations='upright')
    group.run('scanner', SCANNER)
    group.wait_until(lambda record: record.complete() and record.all_reported(), 60)
    assert placed(group) == 8, group.text()
    assert group.record.unaccounted() == []


def test_an_arm_of_ones_own_packs_boxes(group: NodeGroup, tmp_path: Path) -> None:
    (tmp_path / 'mine.py').write_text(ARM)
    arm = f'{tmp_path}/mine.py:MY_ARM'
    group.start('arm_executor', arm=arm, speed=0.0, orientations='upright')
    group.start('planner', orientations='upright')
    group.start('conveyor', count=8, speed=0.0)
    group.wait_until(lambda record: record.complete() and record.all_reported(), 60)
    assert placed(group) == 8, group.text()
    assert group.record.unaccounted() == []


def test_an_executor_of_ones_own_packs_boxes(group: NodeGroup) -> None:
    group.run('my_executor', EXECUTOR)
    group.start('planner', orientations='upright')
    group.start('conveyor', count=8, speed=0.0)
    group.wait_until(lambda record: record.complete() and record.all_reported(), 60)
    assert placed(group) == 8, group.text()
    assert group.record.unaccounted() == []


def test_the_scanner_is_as_short_as_the_page_says() -> None:
    code = [line for line in SCANNER.splitlines() if line.strip()]
    assert len(code) <= 30
