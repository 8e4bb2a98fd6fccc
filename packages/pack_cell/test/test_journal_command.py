"""`cell journal`: the books of a run shown, checked byte by byte, and exported."""

from __future__ import annotations

import csv
import json
import random
import shutil
import sqlite3
import threading

import pytest

from arm_executor.bins.book import BinBook
from arm_executor.bins.journal import Journal
from arm_executor.bins.operation_log import OperationLog
from arm_executor.bins.records import configuration
from conveyor_sim.ledger.ledger import BoxRecord, Ledger, Whereabouts
from pack_cell.cli import main
from pack_cell.journal.verify import book_errors
from pack_cell.report.record import RunRecord
from pack_cell.running.books_of_bins import books_of_bins
from pack_msgs_py.alarms import Alarm
from pack_msgs_py.cell_values import BinSnapshot, Decision
from pack_msgs_py.codes import Reason
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.operations import Operation
from pack_msgs_py.profiles import find_profile
from pack_msgs_py.values import Box, parse_bin

EQ = parse_bin('EQ')
#: An id that a spreadsheet would take for a formula.
FORMULA = '=1+1'


def box(name):
    return Box(name, (300.0, 200.0, 150.0), 2.5)


@pytest.fixture
def run(tmp_path):
    """The folder of a run with two boxes in a bin, one in the gripper and one rejected."""
    state = tmp_path / 'run' / 'state'
    journal = Journal(state, configuration(EQ, find_profile('cell')))
    book = BinBook(journal, EQ, 1, lambda: 1.7e9)
    book.recover()
    book.settled({})
    for number, name in enumerate(('a', FORMULA, 'c')):
        corner = (310 * (number % 2), 210 * (number // 2), 0)
        pose = Pose((0.15 + corner[0] / 1e3, 0.1 + corner[1] / 1e3, 0.075))
        book.begin(
            Decision(
                box(name),
                *('EQ-1', 1, book.state.bins[0].revision),
                corner_mm=corner,
                size_mm=(310, 210, 150),
                orientation='xyz',
                target=pose,
            )
        )
        book.picked()
        if number < 2:
            book.releasing()
            book.placed()
            book.verified(pose, {})
    log = OperationLog(journal, threading.RLock())
    log.write(Operation(1.7e9, 'SWAP_BIN', 'A', 'anna', 'full', False, 'a box is on its way'))
    log.raise_alarm(Alarm('BOX_LOST', "box 'a' moved 12 mm", box_id='a', raised_s=1.7e9 + 5))
    log.acknowledge(1.7e9 + 65, 'anna', 'box was on the floor')
    journal.close()
    ledger = Ledger(state, 'f', 'four boxes')
    ledger.save(
        [
            BoxRecord(0, 'a', Whereabouts.PLACED, laps=2),
            BoxRecord(1, FORMULA, Whereabouts.PLACED),
            BoxRecord(2, 'c', Whereabouts.PICKED),
            BoxRecord(3, 'd', Whereabouts.REJECTED, reason=Reason.OVERSIZE, text='too long'),
        ],
        {},
    )
    jam = ledger.raise_alarm(Alarm('JAM', 'the belt has jammed', raised_s=1.7e9 - 30))
    ledger.end_alarm(jam, 1.7e9 - 20)
    ledger.write_operation(Operation(1.7e9 - 60, 'DRAIN', '', 'ben', '', True, 'drained'))
    ledger.close()
    return tmp_path / 'run'


def test_show_lists_bins_boxes_and_the_belt(run, capsys):
    assert main(['journal', 'show', str(run)]) == 0
    shown = capsys.readouterr().out
    for text in ('bin EQ-1 at A: 2 boxes', '( 310,    0,    0) mm xyz  verified',
                 'under way: c into EQ-1, picked', 'belt: 4 boxes fed: 1 picked, 2 placed',
                 'd rejected, oversize: too long'):  # fmt: skip
        assert text in shown


def test_show_tells_who_asked_for_what_and_which_alarms_there_were(run, capsys):
    assert main(['journal', 'show', str(run)]) == 0
    shown = capsys.readouterr().out
    asked = shown[shown.index('asked for by people:') :].splitlines()
    assert asked[1].endswith('DRAIN of the belt by ben: drained')
    assert asked[2].endswith('SWAP_BIN A of the arm by anna (full): refused: a box is on its way')
    assert 'alarm JAM of the belt: the belt has jammed; over 2023-11-' in asked[4]
    assert asked[4].endswith(', not acknowledged')
    assert "alarm BOX_LOST of the arm: box 'a' moved 12 mm; acknowledged 2023-11-" in asked[5]
    assert asked[5].endswith(' by anna (box was on the floor)')
    assert main(['journal', 'show', str(run), '--box', 'a']) == 0
    assert "BOX_LOST: box 'a' moved 12 mm" in capsys.readouterr().out


def test_show_tells_all_about_one_box(run, capsys):
    assert main(['journal', 'show', str(run), '--box', 'a']) == 0
    shown = capsys.readouterr().out
    assert 'number 1 of the stream, placed, 2 laps' in shown
    assert shown.index(': planned') < shown.index('PICKED') < shown.index(': verified')
    assert main(['journal', 'show', str(run), '--box', 'x']) == 2
    assert "nothing is written about box 'x'" in capsys.readouterr().err


def test_export_writes_csv_and_json_that_hold_everything(run, capsys):
    assert main(['journal', 'export', str(run)]) == 0
    data = json.loads((run / 'journal' / 'journal.json').read_text())
    assert [placement['step'] for placement in data['placements']] == 2 * ['verified'] + ['picked']
    assert data['bins'][0]['boxes'] == 2
    rows = list(csv.DictReader((run / 'journal' / 'placements.csv').open()))
    assert [row['box_id'] for row in rows] == ['a', f"'{FORMULA}", 'c']
    assert rows[1]['corner_mm'] == '310 0 0'
    assert rows[0]['steps.verified'].startswith('2023-11-14T')
    assert len(list(csv.DictReader((run / 'journal' / 'belt.csv').open()))) == 4
    people = list(csv.DictReader((run / 'journal' / 'operations.csv').open()))
    assert [(row['node'], row['who'], row['done']) for row in people] == [
        ('belt', 'ben', 'True'),
        ('arm', 'anna', 'False'),
    ]
    jam, lost = csv.DictReader((run / 'journal' / 'alarms.csv').open())
    assert (lost['code'], lost['severity'], lost['box_id']) == ('BOX_LOST', 'ALARM', 'a')
    assert (lost['node'], lost['who'], lost['why']) == ('arm', 'anna', 'box was on the floor')
    assert lost['acknowledged'] > lost['raised'] > jam['ended'] > jam['raised']
    assert (jam['node'], jam['acknowledged']) == ('belt', '')


def test_books_as_they_were_written_are_found_right(run, capsys):
    assert main(['journal', 'verify', str(run)]) == 0
    assert 'as they were written, and agree' in capsys.readouterr().out


def test_a_folder_without_books_is_refused(tmp_path, capsys):
    assert main(['journal', 'verify', str(tmp_path)]) == 2
    assert 'holds no books of a run' in capsys.readouterr().err


def test_boxes_that_the_books_do_not_agree_about_are_named(run, capsys):
    ledger = Ledger(run / 'state', 'f', 'four boxes')
    ledger.save([BoxRecord(3, 'd', Whereabouts.PLACED)], {})
    ledger.close()
    assert main(['journal', 'verify', str(run)]) == 1
    assert "box 'd' is in a bin by conveyor.sqlite" in capsys.readouterr().out


@pytest.mark.parametrize('name', ['executor.sqlite', 'conveyor.sqlite'])
def test_a_flipped_byte_of_a_row_is_found_and_named(run, name, tmp_path):
    """Wherever it hits a value or the chain; what SQLite does not use holds nothing."""
    whole = (run / 'state' / name).read_bytes()
    columns = {
        'executor.sqlite': 'SELECT placed || target || goal_id FROM attempt',
        'conveyor.sqlite': 'SELECT box_id || place || text FROM boxes',
    }
    with sqlite3.connect(run / 'state' / name) as db:
        texts = [str(row[0]).encode() for row in db.execute(columns[name])]
        texts += [row[0].encode() for row in db.execute('SELECT written FROM chain')]
        texts += [row[0].encode() for row in db.execute('SELECT hash FROM chain')]
    db.close()
    rng = random.Random(4)
    tried = 0
    for text in texts:
        at = whole.find(text[:40])
        if at < 0:
            continue
        tried += 1
        flipped = bytearray(whole)
        flipped[at + rng.randrange(min(len(text), 40))] ^= 1 << rng.randrange(8)
        state = tmp_path / f'{tried}'
        shutil.copytree(run / 'state', state)
        (state / name).write_bytes(flipped)
        wrong = book_errors(state)
        assert wrong and all(line.startswith(f'{name}: ') for line in wrong), text
    assert tried > 5


def test_a_run_that_goes_on_knows_what_is_in_its_bins_before_the_arm_speaks(run):
    record = RunRecord()
    books_of_bins(run / 'state').tell(record)
    assert record.ids_in_bins() == {'a', FORMULA}
    heard = BinSnapshot(9, 50.0, ())
    record.on_bins(heard)
    assert record.ids_in_bins() == set()
