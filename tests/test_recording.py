"""A run leaves a recording of all that was said, and does not depend on who writes it."""

from __future__ import annotations

from collections import Counter

import pytest
from run_checks import TIMED, StartCell, assert_every_box_in_one_place

from pack_cell.recording.reading import read_messages

pytestmark = pytest.mark.cell


def test_a_run_records_every_decision_and_outcome(start_cell: StartCell) -> None:
    cell = start_cell('--count', '12', *TIMED)
    assert cell.wait() == 0, cell.text()
    said = Counter(message.topic.name for message in read_messages(cell.out / 'run.mcap'))
    assert said['/placements'] >= 12
    assert said['/placement_report'] >= 12
    assert min(said[name] for name in ('/box_scan', '/bin_state', '/clock', '/diagnostics')) > 0


def test_a_run_goes_on_when_its_recorder_is_killed(start_cell: StartCell) -> None:
    cell = start_cell('--count', '12', *TIMED)
    cell.wait_for_placements(4)
    cell.kill_node('topic_recorder')
    assert cell.wait() == 0, cell.text()
    assert 'the cell goes on without it' in cell.text()
    assert_every_box_in_one_place(cell, 12)
    # Up to the last whole chunk; where there is none yet, the file is empty but no wreck.
    list(read_messages(cell.out / 'run.mcap'))
