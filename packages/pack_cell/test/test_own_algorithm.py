"""An algorithm of one's own file in ``cell bench`` and ``cell run``."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from pack_cell.bench.simulator import pack_collection
from pack_cell.bench.values import Case, CollectionSource
from pack_cell.cli import main
from pack_cell.options.run_options import parse_run_options
from pack_msgs_py.values import parse_bin

RULE = """
from pack_planner import find_algorithm

def my_rule(problem):
    return find_algorithm('{name}')(problem)

def late(problem):
    if len(problem.bins[0].boxes) > 1:
        raise RuntimeError('no more')
    return my_rule(problem)

def floats(problem):
    from dataclasses import replace
    choice = my_rule(problem)
    placed = replace(choice.candidate.placed, corner_mm=(0, 0, 100))
    return replace(choice, candidate=replace(choice.candidate, placed=placed))
"""
FEW = ('--bins', '60x40x40', '--look-ahead', '2', '--collections', '2')


@pytest.fixture
def mine(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / 'mine.py'
    path.write_text(RULE.format(name='dbl'))
    return path


def bench(*arguments):
    """Exit code of ``cell bench``, whether it returns or leaves."""
    try:
        return main(['bench', *FEW, *map(str, arguments)])
    except SystemExit as leaving:
        return leaving.code


def outcome(record):
    """What came of the boxes, without times and who it was."""
    return {key: record[key] for key in ('placed', 'closed_bins', 'fill_closed', 'fill_all')}


@pytest.mark.parametrize('jobs', [1, 2])
def test_it_stands_beside_the_others_wherever_it_is_packed(mine, jobs, capsys):
    assert bench('--algorithms', './mine.py:my_rule,dbl', '--jobs', jobs, '--json', 'r.json') == 0
    own, dbl = json.loads((mine.parent / 'r.json').read_text())
    assert (own['algorithm'], dbl['algorithm']) == ('mine.py:my_rule', 'dbl')
    assert own['backend'] is None and outcome(own) == outcome(dbl)
    assert 'algorithm_digest' not in dbl['settings']
    assert 'mine.py:my_rule' in capsys.readouterr().out


def test_it_is_packed_again_after_an_edit_and_only_then(mine):
    for name in ('dbl', 'dbl', 'mpack_lite'):
        mine.write_text(RULE.format(name=name))
        # each run of the command line is a process of its own
        assert bench_apart(mine.parent, '--algorithms', 'mine.py:my_rule', '--json', 'r.json') == 0
    first, second = json.loads((mine.parent / 'r.json').read_text())
    assert first['algorithm'] == second['algorithm']
    assert first['settings']['algorithm_digest'] != second['settings']['algorithm_digest']
    assert outcome(first) != outcome(second)


def bench_apart(folder, *arguments):
    import subprocess
    import sys

    command = [sys.executable, '-m', 'pack_cell', 'bench', *FEW, *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, check=False).returncode


@pytest.mark.parametrize(('where', 'code', 'said'), [
    ('./mine.py:nothing', 2, "mine.py has no 'nothing'"),
    ('./nowhere.py:rule', 2, 'nowhere.py cannot be read: No such file'),
    ('./mine.py', 2, 'or ./mine.py:FUNCTION'),
    ('./mine.py:late', 1, "'mine.py:late' failed: RuntimeError: no more (line"),
    ('./mine.py:floats', 1, "'mine.py:floats' chose a placement that the rules forbid"),
])  # fmt: skip
def test_what_is_wrong_with_it_is_one_line(mine, where, code, said, capsys):
    assert bench('--algorithms', where) == code
    error = capsys.readouterr().err
    assert said in error and error.count('\n') == 1, error


def test_it_has_no_backend(mine, capsys):
    assert bench('--algorithms', './mine.py:my_rule', '--backend', 'cp_sat') == 2
    assert 'name mpack_lite and mpack alone' in capsys.readouterr().err


def test_a_worker_that_reads_another_version_says_so(mine):
    from pack_cell.bench.values import BenchSettings
    from pack_msgs_py.profiles import PROFILES

    case = Case(f'{mine}:my_rule', parse_bin('SYN'), 1, 1, CollectionSource('SYN'))
    settings = BenchSettings(PROFILES['paper'], boxes_per_bin=4)
    with pytest.raises(ValueError, match='has changed since it was asked for'):
        pack_collection(replace(case, digest='0123456789ab'), settings, 0)


def test_run_hands_the_planner_an_absolute_path(mine):
    options = parse_run_options(['--algorithm', './mine.py:my_rule'])
    assert options.algorithm == f'{mine}:my_rule'


@pytest.mark.parametrize(('where', 'said'), [
    ('./mine.py:nothing', "has no 'nothing'"), ('./nowhere.py:rule', 'cannot be read'),
])  # fmt: skip
def test_run_refuses_what_is_no_algorithm_before_anything_starts(mine, where, said, capsys):
    with pytest.raises(SystemExit):
        parse_run_options(['--algorithm', where])
    error = capsys.readouterr().err
    assert said in error and error.count('\n') == 1
