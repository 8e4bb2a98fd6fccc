"""What a run is begun with is kept in its folder, and only as it was begun is it gone on with."""

from __future__ import annotations

import json

import pytest

from conveyor_sim.ledger.ledger import Ledger
from pack_cell.cli import main
from pack_cell.options.option_texts import options_from, texts_of
from pack_cell.options.run_options import open_stream, parse_run_options, run_options
from pack_cell.report.run_log import RunLog, is_complete
from pack_cell.running.folder_lock import FolderLock, FolderTaken
from pack_cell.running.kept_run import KeptRun, NotResumable, is_begun, kept_run

ROWS = 'id,length_mm,width_mm,height_mm,weight_kg\na,300,200,150,2\nb,310,210,160,3\n'


@pytest.fixture
def boxes(tmp_path):
    path = tmp_path / 'orders.csv'
    path.write_text(ROWS)
    return path


def begun(folder, *arguments):
    kept = KeptRun(folder.resolve(), parse_run_options(arguments), ('cell', 'run', *arguments))
    kept.write()
    return kept


@pytest.mark.parametrize(
    'arguments',
    [
        [],
        ['--bin', '120x80x150:pallet', '--count', '7', '--seed', '3', '--respawn', '--quiet'],
        ['--planner', 'cep=true', '--planner', 'weights=2,1,100', '--robot', 'ur30'],
        ['--profile', 'dense', '--scan-sigma', '0.5', '--arrivals', 'bursts:3,20', '--speed', '1'],
    ],
)
def test_options_survive_being_written_down(arguments):
    options = parse_run_options(arguments)
    assert options_from(json.loads(json.dumps(texts_of(options)))) == options


def test_the_boxes_are_the_same_when_their_file_has_changed_or_gone(tmp_path, boxes):
    kept = begun(tmp_path / 'run', '--boxes', str(boxes), '--count', '5', '--seed', '2')
    before = open_stream(kept.used).fingerprint
    assert before == open_stream(kept.asked).fingerprint
    boxes.unlink()
    again = kept_run(tmp_path / 'run', {})
    assert open_stream(again.used).fingerprint == before
    assert again.asked.boxes == str(boxes)
    assert again.command == kept.command


def test_every_file_that_options_name_is_kept(tmp_path, boxes):
    boxes.with_name('orders.csv.yaml').write_text('units: mm,kg\n')
    times, layout = tmp_path / 'times.txt', tmp_path / 'cell.yaml'
    times.write_text('0\n3\n5\n')
    layout.write_text('robot: ur20\n')
    kept = begun(
        *(tmp_path / 'run', '--boxes', f'draw:{boxes}', '--count', '4'),
        *('--arrivals', f'recorded:{times}', '--layout', str(layout)),
    )
    for path in (boxes, times, layout):
        path.unlink()
    used = kept_run(tmp_path / 'run', {}).used
    assert len(open_stream(used)) == 4
    assert kept.folder.as_posix() in used.arrivals
    assert used.layout.read_text() == 'robot: ur20\n'
    assert (tmp_path / 'run' / 'config' / 'kept' / 'boxes' / 'orders.csv.yaml').exists()


def test_a_folder_that_was_moved_is_gone_on_with_where_it_is(tmp_path, boxes):
    begun(tmp_path / 'run', '--boxes', str(boxes))
    boxes.unlink()
    (tmp_path / 'run').rename(tmp_path / 'moved')
    assert len(open_stream(kept_run(tmp_path / 'moved', {}).used)) == 2


def test_what_is_not_as_it_was_begun_is_refused_by_name_and_value(tmp_path):
    begun(tmp_path / 'run', '--count', '7', '--seed', '3')
    given = {'count': 9, 'seed': 3, 'out': tmp_path / 'other'}
    with pytest.raises(NotResumable) as caught:
        kept_run(tmp_path / 'run', given)
    assert '--count is 7 there and 9 here; --out is' in str(caught.value)
    assert '--seed' not in str(caught.value)


def test_how_it_is_watched_may_change(tmp_path):
    begun(tmp_path / 'run', '--count', '7')
    given = {'quiet': True, 'respawn': True, 'stall_timeout_s': 33.0}
    assert kept_run(tmp_path / 'run', given).asked == run_options({'count': 7} | given)


@pytest.mark.parametrize(
    ('content', 'text'),
    [
        (None, 'holds no run to go on with'),
        ('{"format": 99}', 'it has format 99'),
        ('{"format": 1, "command": [], "options": {"warp": "9"}}', 'options warp are not known'),
        ('{"format": 1, "command": [], "options": {"count": "-1"}}', '-1 is out of range'),
        ('{', 'run.json'),
    ],
)
def test_a_folder_without_a_run_is_refused_in_one_sentence(tmp_path, capsys, content, text):
    if content is not None:
        (tmp_path / 'config').mkdir()
        (tmp_path / 'config' / 'run.json').write_text(content)
    assert main(['run', '--resume', str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert text in error
    assert error.count('\n') == 1


def test_a_folder_that_holds_a_run_is_not_begun_again(tmp_path, capsys):
    begun(tmp_path / 'run')
    assert is_begun(tmp_path / 'run')
    assert main(['run', '--out', str(tmp_path / 'run')]) == 2
    assert f'--resume {tmp_path / "run"}' in capsys.readouterr().err


def test_a_complete_run_is_not_gone_on_with(tmp_path, capsys):
    folder = tmp_path / 'run'
    begun(folder)
    (folder / 'state').mkdir()
    log = RunLog(folder / 'state', 0.0)
    assert not is_complete(folder / 'state')
    log.completed()
    log.close()
    assert main(['run', '--resume', str(folder)]) == 0
    assert 'is complete' in capsys.readouterr().out


def test_a_run_whose_books_were_changed_is_not_gone_on_with(tmp_path, capsys):
    begun(tmp_path / 'run')
    ledger = Ledger(tmp_path / 'run' / 'state', 'f', 'boxes')
    ledger._db.execute("UPDATE meta SET value = 'g' WHERE key = 'stream'")
    ledger.close()
    assert main(['run', '--resume', str(tmp_path / 'run')]) == 2
    error = capsys.readouterr().err
    assert "conveyor.sqlite: meta 'stream' was changed: value is now 'g'" in error
    assert 'not as they were written' in error


def test_two_do_not_work_in_one_folder(tmp_path):
    lock = FolderLock(tmp_path / 'state')
    with pytest.raises(FolderTaken, match='another cell run'):
        FolderLock(tmp_path / 'state')
    lock.release()
    FolderLock(tmp_path / 'state').release()
