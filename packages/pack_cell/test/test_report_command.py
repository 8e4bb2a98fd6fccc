"""``cell report`` from the command line."""

import pytest
from report_folders import ROW, write_folder

from pack_cell.cli import main


def test_the_report_of_a_run_lies_in_its_folder(tmp_path, capsys):
    folder = write_folder(tmp_path / 'r')
    assert main(['report', str(folder)]) == 0
    assert {path.name for path in folder.glob('report.*')} == {'report.html', 'report.csv'}
    assert 'wrote' in capsys.readouterr().out


def test_several_runs_are_compared_where_one_stands(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folders = [str(write_folder(tmp_path / name)) for name in ('one', 'two')]
    assert main(['report', *folders]) == 0
    assert 'Runs compared' in (tmp_path / 'comparison.html').read_text()
    assert len((tmp_path / 'comparison.csv').read_text().splitlines()) == 3


def test_the_page_goes_where_one_says(tmp_path):
    folder = write_folder(tmp_path / 'r')
    assert main(['report', str(folder), '--out', str(tmp_path / 'deep' / 'p.html')]) == 0
    assert {path.name for path in (tmp_path / 'deep').iterdir()} == {'p.html', 'p.csv'}


@pytest.mark.parametrize('out', ['page.txt', 'page.csv'])
def test_a_page_that_is_none_is_refused(tmp_path, capsys, out):
    folder = write_folder(tmp_path / 'r')
    assert main(['report', str(folder), '--out', str(tmp_path / out)]) == 2
    assert 'must end in .html' in capsys.readouterr().err


def test_a_folder_without_a_run_is_told_in_one_line(tmp_path, capsys):
    write_folder(tmp_path / 'r', [ROW])
    assert main(['report', str(tmp_path / 'r'), str(tmp_path)]) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith('cell report:') and 'no folder of a finished run' in line
