"""The ledger: what was saved is there after a crash, and nobody else's is taken."""

from __future__ import annotations

import sqlite3
import subprocess
import sys

import pytest

from conveyor_sim.ledger.ledger import (
    FILE_NAME,
    INSERTED_FROM,
    BoxRecord,
    Ledger,
    LedgerError,
    Whereabouts,
)
from pack_msgs_py.codes import Reason
from pack_msgs_py.values import Box

RECORDS = [
    BoxRecord(0, 'a', Whereabouts.PICKED, 0, 2, stamp_ns=1_700_000_000_000_000_001, returned=True),
    BoxRecord(1, 'b', Whereabouts.REJECTED, None, 0, Reason.OVERSIZE, 'too wide'),
    BoxRecord(2, 'c', Whereabouts.ON_BELT, 1),
]
SETTINGS = {'belt': '{"offset_um": 1800000}', 'robot_s': '3.5'}


def make(folder, fingerprint='f', description='cartons, 40 boxes'):
    return Ledger(folder, fingerprint, description)


def test_what_was_saved_is_read_back(tmp_path):
    ledger = make(tmp_path / 'new' / 'folder')
    ledger.save(RECORDS, SETTINGS)
    ledger.close()
    again = make(tmp_path / 'new' / 'folder')
    assert again.records() == RECORDS
    assert {key: again.setting(key) for key in SETTINGS} == SETTINGS
    assert again.setting('scan_sequence', '0') == '0'


def test_a_killed_process_loses_nothing_that_it_had_saved(tmp_path):
    code = (
        'import os, sys\n'
        'from conveyor_sim.ledger.ledger import *\n'
        'ledger = Ledger(sys.argv[1], "f", "d")\n'
        'ledger.save([BoxRecord(0, "a", Whereabouts.ON_BELT, 3)], {"belt": "x"})\n'
        'ledger._db.execute("BEGIN")\n'
        'ledger._db.execute("UPDATE boxes SET place = \'lost\'")\n'
        'os.kill(os.getpid(), 9)\n'
    )
    done = subprocess.run([sys.executable, '-c', code, str(tmp_path)], timeout=30, check=False)
    assert done.returncode == -9
    ledger = make(tmp_path)
    assert ledger.records() == [BoxRecord(0, 'a', Whereabouts.ON_BELT, 3)]
    assert ledger.setting('belt') == 'x'


def test_a_save_that_fails_writes_nothing(tmp_path):
    ledger = make(tmp_path)
    ledger.save(RECORDS, SETTINGS)
    bad = BoxRecord(4, None, Whereabouts.ON_BELT)
    with pytest.raises(LedgerError, match='cannot be used'):
        ledger.save([BoxRecord(3, 'd', Whereabouts.ON_BELT), bad], {})
    assert ledger.records() == RECORDS
    assert {key: ledger.setting(key) for key in SETTINGS} == SETTINGS


def test_counts_add_up_to_what_was_given_out():
    ledger = make('')
    assert sum(ledger.counts().values()) == 0
    ledger.save(RECORDS, SETTINGS)
    assert ledger.counts()[Whereabouts.REJECTED] == 1
    assert sum(ledger.counts().values()) == 3


def test_the_ledger_of_another_stream_is_refused(tmp_path):
    make(tmp_path).close()
    with pytest.raises(LedgerError, match='another stream') as caught:
        make(tmp_path, fingerprint='g', description='pallets')
    for part in (str(tmp_path), 'cartons, 40 boxes', 'pallets', 'state_dir'):
        assert part in str(caught.value)


def test_two_conveyors_cannot_share_a_ledger(tmp_path):
    ledger = make(tmp_path)
    with pytest.raises(LedgerError, match='in use by another conveyor'):
        make(tmp_path)
    ledger.close()
    make(tmp_path).close()


def test_a_damaged_or_foreign_file_is_refused_with_its_name(tmp_path):
    (tmp_path / FILE_NAME).write_bytes(b'not a database' * 100)
    with pytest.raises(LedgerError, match=r'conveyor\.sqlite'):
        make(tmp_path)


def test_a_ledger_of_another_format_is_refused(tmp_path):
    make(tmp_path).close()
    with sqlite3.connect(tmp_path / FILE_NAME) as db:
        db.execute("UPDATE meta SET value = '99' WHERE key = 'schema'")
    db.close()
    with pytest.raises(LedgerError, match='format 99'):
        make(tmp_path)


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(LedgerError, match='file'):
        make(tmp_path / 'file' / 'state')


def test_a_box_inserted_by_release_0_1_is_read_and_a_damaged_one_is_named(tmp_path):
    ledger = make(tmp_path)
    row = (
        '{"id": "plain", "size_mm": [300.0, 200.0, 100.0], "weight_kg": 1.5, '
        '"com_offset_mm": [0.0, 0.0, 0.0], "allowed_up": 63, "max_top_load_n": null, '
        '"destination": "", "size_stddev_mm": [0.0, 0.0, 0.0], "extra": [["row", "7"]]}'
    )
    ledger._db.execute('INSERT INTO inserted VALUES (?, ?)', (INSERTED_FROM, row))
    [box] = ledger.inserted().values()
    assert box == Box('plain', (300.0, 200.0, 100.0), 1.5)
    assert box.extra == (('row', '7'),)
    assert ledger.insert(Box('next', (1.0, 2.0, 3.0))) == INSERTED_FROM + 1
    ledger._db.execute("UPDATE inserted SET box = '{}'")
    with pytest.raises(LedgerError, match='cannot be used: box record lacks id, size_mm'):
        ledger.inserted()
