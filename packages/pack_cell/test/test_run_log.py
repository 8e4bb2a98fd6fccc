"""What was heard is on disk, session by session."""

from __future__ import annotations

import time

import pytest

from pack_cell.report.run_log import RunLog, RunLogError


def test_a_later_session_is_told_what_earlier_ones_heard(tmp_path):
    first = RunLog(tmp_path, time.monotonic())
    first.add('box_event', b'one')
    first.add('placements', b'two')
    assert list(first.messages()) == []
    second = RunLog(tmp_path, time.monotonic())  # the first was killed: nothing was closed
    second.add('box_event', b'three')
    third = RunLog(tmp_path, time.monotonic())
    heard = [('box_event', b'one'), ('placements', b'two'), ('box_event', b'three')]
    assert list(third.messages()) == heard


def test_a_session_that_was_cut_lasted_until_the_last_that_was_heard(tmp_path):
    now = time.monotonic()
    cut = RunLog(tmp_path, now - 20.0)
    cut.decided()
    cut.add('box_event', b'')
    whole = RunLog(tmp_path, now - 7.0)
    whole.ended()
    lasted = [session.wall_s for session in whole.sessions()]
    assert lasted == pytest.approx([20.0, 7.0], abs=5.0)
    assert [session.working_s for session in whole.sessions()] == pytest.approx([0, 0], abs=5.0)
    assert whole.sessions()[1].first_decision_s is None


def test_a_file_that_is_no_log_is_refused_by_its_name(tmp_path):
    (tmp_path / 'recorder.sqlite').write_bytes(b'no database, and long enough to tell' * 20)
    with pytest.raises(RunLogError, match=r'recorder\.sqlite'):
        RunLog(tmp_path, 0.0)
