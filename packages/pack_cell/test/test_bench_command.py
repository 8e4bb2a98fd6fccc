"""The verb ``cell bench``: what it prints and writes, and one clear line for every wrong input."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from pack_cell.cli import main

QUICK = ['--algorithms', 'first_fit,mpack_lite', '--bins', '60x40x40', '--look-ahead', '2',
         '--collections', '1']  # fmt: skip


def bench(*arguments):
    """Exit code of ``cell bench``, whether it returns or leaves."""
    try:
        return main(['bench', *map(str, arguments)])
    except SystemExit as leaving:
        return leaving.code


@pytest.fixture
def box_file(tmp_path: Path) -> Path:
    path = tmp_path / 'boxes.csv'
    path.write_text(
        'id,length_mm,width_mm,height_mm\na,300,200,100\nb,250,200,150\nlong,900,100,100\n'
        'bad,-1,2,3\nc,300,300,300\n'
    )
    return path


def test_it_prints_and_writes_all_it_is_asked_for(tmp_path, capsys):
    outputs = {name: tmp_path / name for name in ('r.json', 'p.jsonl', 'r.html', 'f.svg')}
    assert bench(*QUICK, '--json', outputs['r.json'], '--plan', outputs['p.jsonl'],
                 '--html', outputs['r.html'], '--figure', outputs['f.svg']) == 0  # fmt: skip
    printed = capsys.readouterr().out
    assert 'mpack_lite' in printed and 'first_fit' in printed and 'closed fill %' in printed
    assert '1 collections of built-in cartons, drawn with replacement' in printed
    records = json.loads(outputs['r.json'].read_text())
    assert [record['algorithm'] for record in records] == ['first_fit', 'mpack_lite']
    lines = [json.loads(line) for line in outputs['p.jsonl'].read_text().splitlines()]
    assert len(lines) == sum(record['placed'] + record['closed_bins'] for record in records)
    place = next(line for line in lines if line['event'] == 'place')
    assert {'collection', 'step', 'box', 'bin_serial', 'position_mm', 'placed_size_mm',
            'objective', 'status', 'seconds'} <= place.keys()  # fmt: skip
    assert './cell bench --algorithms first_fit,mpack_lite' in outputs['r.html'].read_text()
    assert outputs['f.svg'].read_text().lstrip().startswith('<?xml')


def test_a_box_file_is_packed_and_what_does_not_fit_is_said(box_file, tmp_path, capsys):
    assert bench('--algorithms', 'mpack_lite', '--bins', '60x40x40', '--boxes', box_file,
                 '--json', tmp_path / 'r.json') == 0  # fmt: skip
    (record,) = json.loads((tmp_path / 'r.json').read_text())
    assert (record['boxes'], record['placed']) == (5, 3)
    assert [entry['id'] for entry in record['unplaced']] == ['bad', 'long']
    output = capsys.readouterr()
    assert "box 'long' 900x100x100 mm fits no empty 60x40x40 bin" in output.out
    assert 'column length_mm' in output.err and 'left out' in output.err
    assert 'look-ahead 5 sees all 4 boxes' in output.err


def test_units_and_decimal_mark_of_a_box_file_can_be_said(tmp_path):
    path = tmp_path / 'boxes.csv'
    path.write_text('id;l;w;h\n' + ''.join(f'{n};30,125;20,250;{n + 10},500\n' for n in range(4)))
    few = ('--bins', '60x40x40', '--algorithms', 'first_fit', '--boxes', path,
           '--plan', tmp_path / 'p.jsonl')  # fmt: skip
    assert bench(*few) == 2
    assert bench(*few, '--units', 'cm', '--decimal', 'comma') == 0
    places = map(json.loads, (tmp_path / 'p.jsonl').read_text().splitlines())
    sizes = [place['box']['size_mm'] for place in places if place['event'] == 'place']
    assert [301.25, 202.5, 105.0] in sizes


def test_margins_of_ones_own_are_part_of_the_record(tmp_path):
    path = tmp_path / 'r.json'
    few = ('--bins', '60x40x40', '--collections', '1', '--profile', 'dense', '--json', path)
    assert bench(*few, '--algorithms', 'first_fit') == 0
    assert bench(*few, '--algorithms', 'first_fit', '--clearance', '0', '--resolution', '1') == 0
    usual, tight = (record['settings'] for record in json.loads(path.read_text()))
    assert (tight['clearance_mm'], tight['resolution_mm']) == (0, 1)
    assert 'clearance_mm' not in usual


def test_paper_prints_table_1(capsys):
    few = ('--bins', 'SYN', '--look-ahead', '1', '--collections', '1', '--boxes-per-bin', '8')
    assert bench('--paper', *few, '--algorithms', 'o_first_fit', 'mpack_lite') == 0
    output = capsys.readouterr().out
    assert "orientations 'any'" in output and 'arXiv:2111.01072' in output
    assert '[68.71]' in output and '[73.11]' in output


@pytest.mark.parametrize(('options', 'expected'), [
    ([], [('first_fit', False), ('mpack_lite', False), ('mpack', False)]),
    (['--cep'], [('first_fit', False), ('mpack_lite', True), ('mpack', True)]),
    (['--paper'], [('first_fit', False), ('mpack_lite', False), ('mpack', True)]),
    (['--cep', 'off', 'on'], [
        ('first_fit', False), ('mpack_lite', False), ('mpack_lite', True), ('mpack', False),
        ('mpack', True)]),
], ids=lambda words: ' '.join(words) if words and isinstance(words[0], str) else None)  # fmt: skip
def test_contact_constraints_are_as_asked_or_as_in_the_paper(options, expected, tmp_path, capsys):
    few = ('--bins', '60x40x40', '--look-ahead', '2', '--collections', '1',
           '--budget-nodes', '50')  # fmt: skip
    path = tmp_path / 'r.json'
    assert bench(*few, '--algorithms', 'first_fit,mpack_lite,mpack', *options, '--json', path) == 0
    records = json.loads(path.read_text())
    assert [(record['algorithm'], record['settings']['cep']) for record in records] == expected
    assert ('mpack, CEP' in capsys.readouterr().out) == (('mpack', True) in expected)


WRONG = {
    'unknown algorithm': (['--algorithms', 'magic'], "unknown algorithm 'magic': use one of"),
    'no algorithm': (['--algorithms', ','], '--algorithms names nothing'),
    'unknown bin': (['--bins', 'BOX'], "unknown bin 'BOX'"),
    'zero collections': (['--collections', '0'], '0 is out of range'),
    'not a number': (['--collections', 'many'], "'many' is not a whole number"),
    'budget nan': (['--budget', 'nan'], 'nan is out of range'),
    'budget zero': (['--budget', '0'], '0 is out of range'),
    'no nodes': (['--budget-nodes', '0'], '0 is out of range'),
    'weight nan': (['--weights', '1,nan,100'], 'weight w2 is nan'),
    'two weights': (['--weights', '1,2'], "weights '1,2' are not w1,w2,w3"),
    'look-ahead 7': (['--look-ahead', '7'], 'look-ahead 7 is out of range: it must be 1 to 6'),
    'look-ahead 0': (['--look-ahead', '0'], 'look-ahead 0 is out of range'),
    'look-ahead 3-1': (['--look-ahead', '3-1'], 'look-ahead 3-1 is out of range'),
    'look-ahead x': (['--look-ahead', 'x'], "look-ahead 'x' is neither"),
    'no grid': (['--resolution', '0'], '0 is out of range: it must be 1 to 100 mm'),
    'wide air': (['--clearance', '101'], '101 is out of range: it must be 0 to 100 mm'),
    'four bins': (['--open-bins', '4'], '4 is out of range'),
    'no profile': (['--profile', 'lab'], "invalid choice: 'lab'"),
    'no file': (['--boxes', '/no/such.csv'], 'box file /no/such.csv cannot be read'),
    'shuffle alone': (['--shuffle', '1'], '--shuffle needs --boxes'),
    'one box per bin': (['--boxes-per-bin', '1'], '1 is out of range'),
    'no folder': (['--json', '/proc/nowhere/x.json'], '/proc/nowhere/x.json cannot be written'),
    'same file': (['--json', 'x.json', '--plan', './x.json'], 'two outputs have the same'),
    'unknown backend': (['--backend', 'gurobi'], "unknown backend 'gurobi': use one of search"),
    'no such backend': (['--algorithms', 'walle', '--backend', 'milp'], "'walle' has no backend"),
    'no destination': (['--destinations', '0'], '0 is out of range'),
    'figure format': (['--figure', '/tmp/x.txt'], 'must end in .svg, .png or .pdf'),
}  # fmt: skip


@pytest.mark.parametrize('name', WRONG)
def test_wrong_input_is_one_line_and_exit_code_2(name, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments, text = WRONG[name]
    assert bench(*arguments) == 2
    error = capsys.readouterr().err
    assert text in error and error.count('\n') == 1, error


def test_a_file_without_usable_boxes_is_refused(tmp_path, capsys):
    empty = tmp_path / 'empty.csv'
    empty.write_text('')
    assert bench('--boxes', empty) == 2
    assert 'is empty' in capsys.readouterr().err
    bad = tmp_path / 'bad.csv'
    bad.write_text('length_mm,width_mm,height_mm\n0,1,1\n')
    assert bench('--boxes', bad) == 2
    assert 'holds no usable box' in capsys.readouterr().err


def test_other_verbs_do_not_load_the_benchmark():
    code = (
        'import sys, pack_cell.cli; pack_cell.cli.build_parser();'
        "print([m for m in sys.modules if m.startswith('pack_cell.bench.') or m in ('joblib',"
        " 'matplotlib')])"
    )
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['pack_cell.bench.options']"
