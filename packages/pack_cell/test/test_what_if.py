"""``cell compare``: what is packed, what is recommended, and what a reader gets to see."""

import csv
import json
import subprocess
from dataclasses import replace

import pytest

from pack_cell.cli import main
from pack_cell.options.parsers import OneLineParser
from pack_cell.what_if import outcomes as packed
from pack_cell.what_if.options import Combination, add_compare, combinations_of
from pack_cell.what_if.outcomes import Outcome
from pack_cell.what_if.page import compare_page
from pack_cell.what_if.recommendation import chosen, recommendations
from pack_msgs_py.values import parse_bin

BOXES = 'id,length_mm,width_mm,height_mm,weight_kg\n' + ''.join(
    f'box-{n},{300 + 20 * (n % 4)},{200 + 20 * (n % 3)},{150 + 10 * (n % 5)},2\n' for n in range(40)
)


def parsed(*words):
    parser = OneLineParser(prog='cell')
    add_compare(parser.add_subparsers())
    return parser.parse_args(['compare', *words])


def outcome(fill, *, bin_name='RC', open_bins=2, look_ahead=5, by_hand=0.0, misses=None, **more):
    combination = Combination(parse_bin(bin_name), 'rollout', open_bins, look_ahead)
    return Outcome(
        combination, fill, 0.4, fill, 9.0, by_hand, 0.02, deadline_misses=misses, **more
    )  # fmt: skip


def test_every_combination_is_tried_once():
    words = ['--bins', 'RC,LDC', '--open-bins', '2,3', '--look-ahead', '3-5,4']
    combinations = combinations_of(parsed(*words))
    assert len(combinations) == len(set(combinations)) == 2 * 2 * 3
    assert {combination.look_ahead for combination in combinations} == {3, 4, 5}


@pytest.mark.parametrize(
    ('words', 'told'),
    [
        (['--look-ahead', '0-3'], 'out of range'),
        (['--look-ahead', '5-3'], 'a range goes upwards'),
        (['--open-bins', '4'], 'out of range'),
        (['--bins', 'BUCKET'], 'unknown bin'),
        (['--bins', ','], 'names nothing'),
        (['--out', 'page.txt'], 'must end in .html'),
    ],
)
def test_a_wrong_option_is_told_in_one_line(words, told, capsys):
    with pytest.raises(SystemExit, match='2'):
        parsed(*words)
    [line] = capsys.readouterr().err.splitlines()
    assert told in line


def test_an_unknown_algorithm_or_box_file_is_told_in_one_line(tmp_path, capsys):
    assert main(['compare', '--algorithms', 'magic', '--out', str(tmp_path / 'p.html')]) == 2
    assert main(['compare', '--boxes', str(tmp_path / 'no.csv')]) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert 'magic' in first and 'no.csv' in second


def test_the_fullest_is_recommended():
    best = outcome(61.2, look_ahead=6, by_hand=2.0, boxes_per_hour=820.0)
    others = [outcome(57.0, look_ahead=5), outcome(60.0, look_ahead=6, open_bins=3)]
    assert chosen([*others, best], 2.0) is best
    [text] = recommendations([best], 2.0)
    assert text == (
        'Roller cages (RC): rollout, look-ahead 6, 2 open bins: 61.2 % full (± 0.4), '
        '820 boxes an hour, 2.0 % to be packed by hand.'
    )


def test_half_a_point_is_worth_no_longer_look_ahead_and_no_other_bin():
    cheap = outcome(60.8, look_ahead=4)
    assert chosen([outcome(61.2, look_ahead=6), cheap, outcome(61.0, open_bins=3)], 2.0) is cheap


def test_a_wide_interval_is_said_to_be_one():
    [wide], [narrow] = (
        recommendations([replace(outcome(58.0), fill_ci=half)], 2.0) for half in (12.0, 2.0)
    )
    assert '(± 12.0)' in wide and '--orders' in wide
    assert '(± 2.0)' in narrow and '--orders' not in narrow


def test_what_leaves_more_for_people_is_not_taken_for_its_fill():
    modest = outcome(58.0, by_hand=1.0)
    full = outcome(66.0, by_hand=9.0, look_ahead=6)
    assert chosen([modest, full], 2.0) is modest
    [text] = recommendations([modest, full], 2.0)
    assert 'look-ahead 6, 2 open bins would be 8.0 points fuller and leave 9.0 % by hand' in text
    assert chosen([outcome(58.0, by_hand=5.0), full], 2.0).by_hand == 5.0


def test_what_misses_deadlines_is_not_taken_for_its_fill():
    punctual = outcome(58.0, misses=0)
    assert chosen([outcome(66.0, misses=4), punctual], 2.0) is punctual


def test_the_fullest_kind_of_bin_comes_first_and_too_few_boxes_last():
    texts = recommendations(
        [outcome(None, bin_name='PAL'), outcome(50.0), outcome(70.0, bin_name='EQ')], 2.0
    )
    assert [text.split(':')[0] for text in texts] == [
        'Bins (EQ)',
        'Roller cages (RC)',
        'Pallets (PAL)',
    ]
    assert 'give more' in texts[-1]


def test_the_page_escapes_what_others_wrote():
    page = compare_page([outcome(60.0), outcome(61.0, look_ahead=6)], 2.0, '<b>', ['<i>boxes'])
    assert '<b>' not in page and '<i>boxes' not in page
    assert page.count('class="picked"') == 1
    assert '<script' not in page


@pytest.mark.timeout(400)  # the engine may have to be compiled first
def test_it_packs_the_same_boxes_with_every_combination(tmp_path, capsys):
    (tmp_path / 'boxes.csv').write_text(BOXES)
    words = [
        '--boxes', tmp_path / 'boxes.csv', '--bins', '60x60x50', '--algorithms', 'first_fit',
        '--open-bins', '1,2', '--orders', '2', '--out', tmp_path / 'p.html',
    ]  # fmt: skip
    assert main(['compare', *map(str, words)]) == 0
    assert 'first_fit, look-ahead 5' in capsys.readouterr().out
    with (tmp_path / 'p.csv').open(newline='') as file:
        rows = list(csv.DictReader(file))
    assert [row['open_bins'] for row in rows] == ['1', '2']
    assert all(0 < float(row['fill_closed']) <= 100 for row in rows)
    assert 'Which setting for these boxes' in (tmp_path / 'p.html').read_text()


SUMMARY = {
    'fill_closed': 60.0, 'fill_all': 50.0, 'boxes_supplied': 40, 'rejected': 2, 'closed_bins': 3,
    'planning_s': {'p95': 0.1}, 'boxes_per_hour': 800.0, 'deadline_misses': 1,
}  # fmt: skip


def test_with_an_arm_each_combination_is_a_run_and_none_is_run_twice(tmp_path, monkeypatch):
    runs = []

    def cell_run(command, **_):
        folder = command[command.index('--out') + 1]
        runs.append((folder, (tmp_path / folder / 'given.csv').read_text()))
        (tmp_path / folder / 'summary.json').write_text(json.dumps(SUMMARY))
        return subprocess.CompletedProcess(command, 0, '', '')

    monkeypatch.setattr(packed.subprocess, 'run', cell_run)
    (tmp_path / 'boxes.csv').write_text(BOXES)
    words = [
        'compare', '--boxes', str(tmp_path / 'boxes.csv'), '--arm', 'timed', '--open-bins', '1,2',
        '--orders', '2', '--out', str(tmp_path / 'p.html'),
    ]  # fmt: skip
    assert main(words) == main(words) == 0
    assert len({folder for folder, _ in runs}) == len(runs) == 4
    # The same orders for every combination, and each its own.
    assert len({text for _, text in runs}) == 2
    page = (tmp_path / 'p.html').read_text()
    assert '800 boxes an hour, 5.0 % to be packed by hand' in page
    assert '2 deadlines were missed' in page.replace('</p>', '').lower()


#: Neither units nor what the comma means can be told from it.
UNCLEAR = 'id\tl\tw\th\tkg\tlot\n' + ''.join(
    f'b{n}\t{30 + n},250\t20,500\t15,125\t2,500\tlot{n % 2}\n' for n in range(6)
)


def test_a_box_list_is_read_with_the_same_options_as_by_a_run(tmp_path, monkeypatch):
    runs = []

    def cell_run(command, **_):
        folder = tmp_path / command[command.index('--out') + 1]
        runs.append((command, (folder / 'given.csv').read_text()))
        (folder / 'summary.json').write_text(json.dumps(SUMMARY))
        return subprocess.CompletedProcess(command, 0, '', '')

    monkeypatch.setattr(packed.subprocess, 'run', cell_run)
    (tmp_path / 'boxes.tsv').write_text(UNCLEAR)
    words = ['compare', '--boxes', str(tmp_path / 'boxes.tsv'), '--orders', '1',
             '--out', str(tmp_path / 'p.html'), '--order-by', 'lot']  # fmt: skip
    assert main([*words, '--arm', 'timed']) == 2
    told = ['--units', 'cm,kg', '--decimal', 'comma']
    assert main([*words, *told]) == 2
    assert main([*words, *told, '--arm', 'timed']) == 0
    ((command, given),) = runs
    assert '312.5,205.0,151.25,2.5' in given and 'lot1' in given
    assert command[-2:] == ['--order-by', 'destination']


def test_a_run_that_comes_to_nothing_is_told_with_its_last_words(tmp_path, monkeypatch, capsys):
    def cell_run(command, **_):
        return subprocess.CompletedProcess(command, 3, '', 'much\ncell run: a node died\n')

    monkeypatch.setattr(packed.subprocess, 'run', cell_run)
    assert main(['compare', '--arm', 'timed', '--out', str(tmp_path / 'p.html')]) == 1
    assert 'a node died' in capsys.readouterr().err
