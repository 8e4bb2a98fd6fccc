"""The layouts for RViz and Foxglove are what these programs load, and fit what the cell says.

The programs are not here. What they know is written down below, from the sources of RViz
(ros2/rviz, branch jazzy) and of Lichtblick 1.28 (lichtblick-suite/lichtblick), which is Foxglove
Studio gone on with as open source.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

pytest.importorskip('rclpy')

from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)

from arm_executor.model.layout import Layout
from arm_executor.model.robot_data import ROBOTS
from arm_executor.model.tree import ROOT, described_joints
from arm_executor.ros.markers import NAMESPACES
from pack_cell.ros.message_definitions import message_class
from pack_msgs_py.ros import qos
from pack_msgs_py.values import STATIONS, frame_name

CONFIG = Path(__file__).resolve().parents[1] / 'config'
FRAMES = {
    ROOT,
    'belt',
    *(frame_name(station) for station in STATIONS),
    *(joint.child for joint in described_joints(ROBOTS['ur20'], Layout())),
}
#: Topics that are shown: type, and what its publisher offers.
TOPICS = {
    '/robot_description': ('std_msgs/msg/String', qos.STATE),
    '/arm_executor/markers': ('visualization_msgs/msg/MarkerArray', qos.STATE),
    '/joint_states': ('sensor_msgs/msg/JointState', QoSProfile(depth=10)),
    '/diagnostics': ('diagnostic_msgs/msg/DiagnosticArray', QoSProfile(depth=10)),
    '/executor_state': ('pack_msgs/msg/ExecutorState', qos.TOPICS['executor_state']),
    '/placements': ('pack_msgs/msg/PlacementDecision', qos.TOPICS['placements']),
    '/placement_report': ('pack_msgs/msg/PlacementReport', qos.TOPICS['placement_report']),
}

# -- RViz ------------------------------------------------------------------------------------------

#: What a subscription of a display is made of: `rviz_common/properties/qos_profile_property.cpp`.
RVIZ_TOPIC = {
    'Value': None,
    'Depth': None,
    'History Policy': {
        'Keep Last': HistoryPolicy.KEEP_LAST,
        'Keep All': HistoryPolicy.KEEP_ALL,
        'System Default': HistoryPolicy.SYSTEM_DEFAULT,
    },
    'Reliability Policy': {
        'Reliable': ReliabilityPolicy.RELIABLE,
        'Best Effort': ReliabilityPolicy.BEST_EFFORT,
        'System Default': ReliabilityPolicy.SYSTEM_DEFAULT,
    },
    'Durability Policy': {
        'Transient Local': DurabilityPolicy.TRANSIENT_LOCAL,
        'Volatile': DurabilityPolicy.VOLATILE,
        'System Default': DurabilityPolicy.SYSTEM_DEFAULT,
    },
}
#: Displays of `rviz_default_plugins/plugins_description.xml`, and their properties by the sources.
RVIZ_DISPLAYS: dict[str, set[str]] = {
    'rviz_default_plugins/Grid': {
        'Reference Frame', 'Plane Cell Count', 'Normal Cell Count', 'Cell Size', 'Line Style',
        'Color', 'Alpha', 'Plane', 'Offset',
    },
    'rviz_default_plugins/RobotModel': {
        'Visual Enabled', 'Collision Enabled', 'Mass Properties', 'Update Interval', 'Alpha',
        'Description Source', 'Description File', 'Description Topic', 'TF Prefix', 'Links',
    },
    'rviz_default_plugins/MarkerArray': {'Topic', 'Namespaces'},
    'rviz_default_plugins/TF': {
        'Show Names', 'Show Axes', 'Show Arrows', 'Marker Scale', 'Update Interval',
        'Frame Timeout', 'Filter (whitelist)', 'Filter (blacklist)', 'Frames', 'Tree',
    },
}  # fmt: skip
#: Of every display: `rviz_common/display.cpp`.
RVIZ_ALWAYS = {'Class', 'Name', 'Enabled', 'Value'}
RVIZ_TOOLS = {
    f'rviz_default_plugins/{name}'
    for name in (
        'MoveCamera', 'PublishPoint', 'Select', 'SetGoal', 'Measure', 'FocusCamera',
        'SetInitialPose', 'Interact',
    )
}  # fmt: skip
RVIZ_VIEWS = {
    f'rviz_default_plugins/{name}'
    for name in ('FPS', 'Orbit', 'TopDownOrtho', 'XYOrbit', 'ThirdPersonFollower')
}
RVIZ_PANELS = {
    f'rviz_common/{name}'
    for name in ('Displays', 'Help', 'Selection', 'Time', 'Tool Properties', 'Transformation',
                 'Views')
}  # fmt: skip


@pytest.fixture(scope='module')
def rviz() -> dict[str, Any]:
    config: dict[str, Any] = yaml.safe_load((CONFIG / 'cell.rviz').read_text())
    return config


def test_rviz_knows_every_display_tool_view_and_panel_and_each_property(
    rviz: dict[str, Any],
) -> None:
    manager = rviz['Visualization Manager']
    for display in manager['Displays']:
        assert set(display) - RVIZ_ALWAYS <= RVIZ_DISPLAYS[display['Class']], display['Name']
        assert display['Enabled'] is display['Value'] is True
    assert {tool['Class'] for tool in manager['Tools']} <= RVIZ_TOOLS
    assert manager['Views']['Current']['Class'] in RVIZ_VIEWS
    assert manager['Transformation']['Current']['Class'] == 'rviz_default_plugins/TF'
    assert {panel['Class'] for panel in rviz['Panels']} <= RVIZ_PANELS
    assert set(rviz) <= {'Panels', 'Visualization Manager', 'Window Geometry'}


def test_rviz_shows_frames_and_markers_of_the_cell(rviz: dict[str, Any]) -> None:
    manager = rviz['Visualization Manager']
    assert manager['Global Options']['Fixed Frame'] == ROOT
    assert manager['Views']['Current']['Target Frame'] == ROOT
    shown = {display['Class'].rpartition('/')[2]: display for display in manager['Displays']}
    assert set(shown['TF']['Frames']) - {'All Enabled'} <= FRAMES
    assert set(shown['MarkerArray']['Namespaces']) == set(NAMESPACES)
    assert shown['RobotModel']['Description Source'] == 'Topic'


def test_what_rviz_subscribes_to_is_offered_so_also_to_one_that_comes_late(
    rviz: dict[str, Any],
) -> None:
    subscriptions = [
        value
        for display in rviz['Visualization Manager']['Displays']
        for value in display.values()
        if isinstance(value, dict) and 'Durability Policy' in value
    ]
    assert len(subscriptions) == 2
    for subscription in subscriptions:
        assert set(subscription) == set(RVIZ_TOPIC)
        words = {key: known[subscription[key]] for key, known in RVIZ_TOPIC.items() if known}
        asked = QoSProfile(
            depth=subscription['Depth'],
            history=words['History Policy'],
            reliability=words['Reliability Policy'],
            durability=words['Durability Policy'],
        )
        _, offered = TOPICS[subscription['Value']]
        compatible, why = qos_check_compatible(offered, asked)
        assert compatible is not QoSCompatibility.ERROR, why
        assert asked.durability is DurabilityPolicy.TRANSIENT_LOCAL, 'sent but once'


# -- Foxglove --------------------------------------------------------------------------------------

#: Panels by `panelType`, and what may stand in the configuration of each: `panels/*/types.ts`,
#: `Plot/utils/config.ts`, `ThreeDeeRender/IRenderer.ts`. The title is a key of either program.
TITLES = {'foxglovePanelTitle', 'lichtblickPanelTitle'}
FOXGLOVE_PANELS: dict[str, set[str]] = {
    '3D': {
        'cameraState', 'followTf', 'followMode', 'scene', 'publish', 'transforms', 'topics',
        'layers', 'imageMode',
    },
    'Plot': {
        'paths', 'minXValue', 'maxXValue', 'minYValue', 'maxYValue', 'showLegend', 'legendDisplay',
        'showPlotValuesInLegend', 'showXAxisLabels', 'showYAxisLabels', 'isSynced', 'xAxisVal',
        'xAxisPath', 'xAxisLabel', 'yAxisLabel', 'followingViewWidth', 'sidebarDimension',
    },
    'RawMessages': {
        'diffEnabled', 'diffMethod', 'diffTopicPath', 'showFullMessageForDiff', 'topicPath',
        'fontSize', 'expansion',
    },
    'DiagnosticSummary': {
        'minLevel', 'pinnedIds', 'topicToRender', 'hardwareIdFilter', 'sortByLevel',
        'secondsUntilStale',
    },
}  # fmt: skip
CAMERA = {
    'distance', 'perspective', 'phi', 'target', 'targetOffset', 'targetOrientation', 'thetaOffset',
    'fovy', 'near', 'far',
}  # fmt: skip
PLOT_PATH = {
    'value', 'enabled', 'color', 'label', 'timestampMethod', 'showLine', 'lineSize',
}  # fmt: skip


@pytest.fixture(scope='module')
def foxglove() -> dict[str, Any]:
    layout: dict[str, Any] = json.loads((CONFIG / 'foxglove_layout.json').read_text())
    return layout


def panels(layout: Any) -> Iterator[str]:
    if isinstance(layout, str):
        yield layout
        return
    assert set(layout) <= {'direction', 'first', 'second', 'splitPercentage'}
    assert layout['direction'] in ('row', 'column')
    yield from (*panels(layout['first']), *panels(layout['second']))


def test_foxglove_knows_every_panel_and_each_key_of_its_configuration(
    foxglove: dict[str, Any],
) -> None:
    known = {'configById', 'layout', 'globalVariables', 'userNodes', 'playbackConfig', 'version'}
    assert set(foxglove) <= known
    assert sorted(panels(foxglove['layout'])) == sorted(foxglove['configById'])
    for name, panel in foxglove['configById'].items():
        kind = name.partition('!')[0]
        assert set(panel) - TITLES <= FOXGLOVE_PANELS[kind], name
        if kind == '3D':
            assert set(panel['cameraState']) == CAMERA
            assert panel['followMode'] in ('follow-pose', 'follow-position', 'follow-none')
        for path in panel.get('paths', ()):
            assert set(path) <= PLOT_PATH
            assert path['timestampMethod'] in ('receiveTime', 'headerStamp')


def test_foxglove_shows_topics_frames_and_fields_of_the_cell(foxglove: dict[str, Any]) -> None:
    for panel in foxglove['configById'].values():
        whole = [*panel.get('topics', ())]
        whole += [panel[key] for key in ('topicPath', 'topicToRender') if key in panel]
        assert set(whole) <= set(TOPICS)
        frames = {name.removeprefix('frame:') for name in panel.get('transforms', ())}
        assert frames | {panel.get('followTf', ROOT)} <= FRAMES
        for path in panel.get('paths', ()):
            topic, _, fields = path['value'].partition('.')
            kind = message_class(TOPICS[topic][0])
            if path['timestampMethod'] == 'headerStamp':
                assert 'header' in kind.get_fields_and_field_types()
            type_of(kind, fields)


def type_of(kind: type, path: str) -> str:
    """Type of the field of a message that a path such as `motion_time.sec` or `velocity[0]` names;
    ``KeyError`` for one that it has not."""
    name, _, rest = path.partition('.')
    found: str = kind.get_fields_and_field_types()[re.sub(r'\[\d+\]$', '', name)]  # type: ignore[attr-defined]
    if name.endswith(']'):
        assert found.startswith('sequence<')
    if not rest:
        return found
    package, _, message = found.partition('/')
    return type_of(message_class(f'{package}/msg/{message}'), rest)
