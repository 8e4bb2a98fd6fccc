"""A run leaves a recording of all that was said, and does not depend on who writes it."""

from __future__ import annotations

from collections import Counter

import pytest
from rosbag2_rules import bag_topics
from rosbags.highlevel import AnyReader
from run_checks import TIMED, StartCell, assert_every_box_in_one_place

from pack_cell.recording.reading import read_messages

pytestmark = pytest.mark.cell


def test_a_run_records_every_decision_and_outcome(start_cell: StartCell) -> None:
    cell = start_cell('--count', '12', *TIMED)
    assert cell.wait() == 0, cell.text()
    recording = cell.out / 'run.mcap'
    said = Counter(message.topic.name for message in read_messages(recording))
    assert said['/placements'] >= 12
    assert said['/placement_report'] >= 12
    assert min(said[name] for name in ('/box_scan', '/bin_state', '/clock', '/diagnostics')) > 0
    of_bag = {topic.name: topic for topic in bag_topics(recording)}
    assert {name: topic.messages for name, topic in of_bag.items()} == said
    assert of_bag['/clock'].type_name == 'rosgraph_msgs/msg/Clock'
    [bins] = of_bag['/bin_state'].offers
    assert (bins['reliability'], bins['durability']) == ('reliable', 'transient_local')
    with AnyReader([recording]) as bag:
        decoded = Counter()
        for connection, _, data in bag.messages():
            bag.deserialize(data, connection.msgtype)
            decoded[connection.topic] += 1
    assert decoded == said, 'a reader that has only the definitions in the file reads every message'


def test_a_run_goes_on_when_its_recorder_is_killed(start_cell: StartCell) -> None:
    cell = start_cell('--count', '12', *TIMED)
    cell.wait_for_placements(4)
    cell.kill_node('topic_recorder')
    assert cell.wait() == 0, cell.text()
    assert 'the cell goes on without it' in cell.text()
    assert_every_box_in_one_place(cell, 12)
    # Up to the last whole chunk; where there is none yet, the file is empty but no wreck.
    list(read_messages(cell.out / 'run.mcap'))
