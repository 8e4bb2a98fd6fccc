"""The code of docs/camera.md, run as it is printed there, against the real nodes of the cell."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pack_cell.testing import NodeGroup
from pack_msgs_py.codes import BoxEventKind

pytestmark = pytest.mark.cell

PAGE = Path(__file__).resolve().parents[1] / 'docs' / 'camera.md'
(CAMERA,) = re.findall(r'^```python\n(.*?)^```', PAGE.read_text(), re.MULTILINE | re.DOTALL)
SCANNER = """from pack_cell.ros.detection_scanner import main
main(['--ros-args', '-p', 'articles:={list}'])
"""
ARTICLES = """sku,length_mm,width_mm,height_mm,weight_kg,aisle
TIN-7,400,300,150,6.5,4
"""


def test_boxes_that_a_camera_detects_are_packed_and_keep_what_it_read(
    group: NodeGroup, tmp_path: Path
) -> None:
    articles = tmp_path / 'articles.csv'
    articles.write_text(ARTICLES)
    group.start('arm_executor', arm='timed', speed=0.0, orientations='upright')
    group.start('planner', orientations='upright', look_ahead=3)
    group.run('detection_scanner', SCANNER.format(list=articles))
    group.run('camera', CAMERA)
    group.wait_until(
        lambda record: record.count(BoxEventKind.PLACED) == 8 and not record.unaccounted(), 90
    )
    (first, *_) = [placed for content in group.record.bins.values() for placed in content.boxes]
    assert first.box.id.startswith('4006381') and first.box.weight_kg == 6.5
    known = dict(first.box.extra)
    assert (known['sku'], known['aisle']) == ('TIN-7', '4')
    assert (known['scan_confidence'], known['scan_status']) == ('0.930', 'ok')
