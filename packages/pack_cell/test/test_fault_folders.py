"""What is kept of the last seconds before a fault, and where."""

from __future__ import annotations

import json
import sqlite3
import subprocess
import sys
import textwrap
from contextlib import closing
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from recorded_messages import message, topic

from pack_cell.recording import faults
from pack_cell.recording.faults import (
    FaultFolders,
    fault_of_event,
    fault_of_mode,
    fault_of_report,
)
from pack_cell.recording.flight import FlightBuffer
from pack_cell.recording.reading import find_recordings, read_messages
from pack_msgs_py.cell_values import BoxEvent, Report
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Mode


@given(
    steps=st.lists(st.tuples(st.floats(0.0, 20.0), st.integers(0, 2)), min_size=1, max_size=40),
    keep_s=st.floats(1.0, 60.0),
)
def test_all_of_the_last_seconds_is_kept_and_of_each_topic_the_last_word(steps, keep_s) -> None:
    topics = [topic(f'/{name}') for name in 'abc']
    flight, heard, now_s = FlightBuffer(keep_s), [], 1000.0
    for pause_s, number in steps:
        now_s += pause_s
        heard.append(message('', now_s, topics[number]))
        flight.add(heard[-1])
    content = flight.content()
    oldest_ns = heard[-1].heard_ns - round(1e9 * keep_s)
    assert [old for old in content if old.heard_ns >= oldest_ns] == [
        old for old in heard if old.heard_ns >= oldest_ns
    ]
    assert {old.topic for old in content} == {old.topic for old in heard}
    assert [old.heard_ns for old in content] == sorted(old.heard_ns for old in content)


def test_a_flood_of_messages_does_not_fill_the_memory(monkeypatch) -> None:
    monkeypatch.setattr('pack_cell.recording.flight.MOST_BYTES', 1000)
    flight = FlightBuffer(30.0)
    for number in range(100):
        flight.add(message('x' * 90, 1.0 + number / 1000))
    assert 5 < len(flight.content()) <= 11


def test_only_what_went_wrong_in_motion_is_a_fault() -> None:
    assert fault_of_report(Report('b', code=ErrorCode.COLLISION)) == 'COLLISION'
    assert fault_of_report(Report('b', code=ErrorCode.UNKNOWN)) == 'UNKNOWN'
    for code in (ErrorCode.NONE, ErrorCode.CANCELED, ErrorCode.PATH_IN_COLLISION):
        assert fault_of_report(Report('b', code=code)) == ''
    assert fault_of_mode(Mode.PROTECTIVE_STOP) == 'ARM_PROTECTIVE_STOP'
    assert fault_of_mode(Mode.IDLE) == ''
    assert fault_of_event(BoxEvent('b', BoxEventKind.LOST)) == 'BOX_LOST'
    assert fault_of_event(BoxEvent('b', BoxEventKind.PLACED)) == ''


def test_a_fault_is_kept_beside_the_journals_with_copies_of_them(tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / 'executor.sqlite')) as journal:
        journal.execute('create table boxes (id text)')
        journal.execute("insert into boxes values ('b-1')")
        journal.commit()
        messages = [message('a', 1.0), message('b', 2.0)]
        folder = FaultFolders(tmp_path).keep('COLLISION', messages, {'planner': {'level': 0}})
    assert folder.parent == tmp_path / 'faults' / 'COLLISION'
    assert list(read_messages(find_recordings(folder)[0])) == messages
    assert json.loads((folder / 'nodes.json').read_text()) == {'planner': {'level': 0}}
    with closing(sqlite3.connect(folder / 'executor.sqlite')) as copy:
        assert copy.execute('select id from boxes').fetchall() == [('b-1',)]


def test_a_journal_that_its_owner_alone_may_open_is_copied_and_not_waited_for(tmp_path: Path):
    holds = textwrap.dedent(f"""
        import sqlite3, sys
        db = sqlite3.connect({str(tmp_path / 'conveyor.sqlite')!r}, isolation_level=None)
        db.execute('PRAGMA locking_mode = EXCLUSIVE')
        db.execute('PRAGMA journal_mode = WAL')
        db.execute('create table boxes (id text)')
        db.execute("insert into boxes values ('b-1')")
        print('held', flush=True)
        sys.stdin.read()
    """)
    # Of another process: locks do not keep a process from itself.
    with subprocess.Popen(
        [sys.executable, '-c', holds], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as owner:
        assert owner.stdout.readline() == b'held\n'
        folder = FaultFolders(tmp_path).keep('COLLISION', [message('a', 1.0)], {})
        assert owner.poll() is None
        owner.stdin.close()
    with closing(sqlite3.connect(folder / 'conveyor.sqlite')) as copy:
        assert copy.execute('select id from boxes').fetchall() == [('b-1',)]
    assert sorted(path.name for path in folder.iterdir()) == [
        'conveyor.sqlite',
        'last_seconds.mcap',
        'nodes.json',
    ]


def test_of_many_faults_of_a_code_the_first_and_the_last_are_kept(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(faults, 'KEPT_PER_CODE', 2)
    folders = FaultFolders(tmp_path)
    kept = [folders.keep('COLLISION', [message(str(n), 1.0 + n)], {}) for n in range(5)]
    assert sorted((tmp_path / 'faults' / 'COLLISION').iterdir()) == [kept[0], *kept[-2:]]


def test_a_fault_that_repeats_itself_is_kept_once_in_a_while(tmp_path: Path) -> None:
    folders = FaultFolders(tmp_path)
    assert folders.is_due('COLLISION', 100.0)
    assert not folders.is_due('COLLISION', 101.0)
    assert folders.is_due('BOX_LOST', 101.0)
    assert folders.is_due('COLLISION', 110.0)
