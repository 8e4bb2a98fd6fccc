"""The layouts for RViz and Foxglove name topics, frames and panels that there are."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import ROBOTS
from arm_executor.model.tree import ROOT, described_joints
from pack_msgs_py.ros import qos
from pack_msgs_py.values import STATIONS, frame_name

CONFIG = Path(__file__).resolve().parents[1] / 'config'
FRAMES = {
    ROOT,
    'belt',
    *(frame_name(station) for station in STATIONS),
    *(joint.child for joint in described_joints(ROBOTS['ur20'], Layout())),
}
TOPICS = {
    '/robot_description',
    '/arm_executor/markers',
    '/joint_states',
    '/diagnostics',
    *(f'/{topic}' for topic in qos.TOPICS),
}


def test_rviz_shows_topics_and_frames_of_the_cell() -> None:
    manager = yaml.safe_load((CONFIG / 'cell.rviz').read_text())['Visualization Manager']
    assert manager['Global Options']['Fixed Frame'] == ROOT
    shown = {display['Class'].rpartition('/')[2]: display for display in manager['Displays']}
    assert shown['MarkerArray']['Topic']['Value'] in TOPICS
    assert shown['RobotModel']['Description Topic']['Value'] in TOPICS
    for display, key in (('MarkerArray', 'Topic'), ('RobotModel', 'Description Topic')):
        assert shown[display][key]['Durability Policy'] == 'Transient Local', 'sent but once'
    assert set(shown['TF']['Frames']) - {'All Enabled'} <= FRAMES


def panels(layout: Any) -> Iterator[str]:
    if isinstance(layout, str):
        yield layout
    else:
        yield from (*panels(layout['first']), *panels(layout['second']))


def test_foxglove_lays_out_every_panel_once_on_topics_of_the_cell() -> None:
    layout = json.loads((CONFIG / 'foxglove_layout.json').read_text())
    assert sorted(panels(layout['layout'])) == sorted(layout['configById'])
    for panel in layout['configById'].values():
        named = [
            *panel.get('topics', ()),
            *(path['value'] for path in panel.get('paths', ())),
            *(panel[key] for key in ('topicPath', 'topicToRender') if key in panel),
        ]
        assert {name.partition('.')[0] for name in named} <= TOPICS
        frames = {name.removeprefix('frame:') for name in panel.get('transforms', ())}
        assert frames <= FRAMES
