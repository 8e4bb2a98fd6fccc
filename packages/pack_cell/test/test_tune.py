"""``cell tune``: it finds weights, says honestly what they gain, and goes on where it was."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time

import pytest

from conveyor_sim.streams import Reading
from pack_cell.bench.runner import Workers
from pack_cell.cli import main
from pack_cell.options.run_options import parse_run_options
from pack_cell.running.node_parameters import tuned_note
from pack_cell.tune.checking import Gain
from pack_cell.tune.search import Limits, search
from pack_cell.tune.space import LIMITS, UNIT, WeightSpace
from pack_cell.tune.streams import stream_boxes
from pack_cell.tune.trials import TrialBook
from pack_cell.tune.values import CHECK, TRAINING, TuneSettings
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import parse_bin
from pack_planner import find_algorithm
from pack_planner.algorithms.registry import SPECS
from pack_planner.algorithms.tuned_tables import read_table, write_table
from pack_planner.algorithms.tuned_weights import TunedEntry, TunedTable

#: A rule that uses a bin up to a share of its height, and closes it then.
RULE = """
from dataclasses import dataclass
from pack_planner import all_spots, algorithm, nearest_box, ranked

@dataclass(frozen=True)
class Mine:
    lid: float = 0.4
    lean: float = 0.0

@algorithm('lidded', weights=Mine())
def mine(problem):
    w = problem.weights_or(Mine())
    def rank(spots, _):
        return (spots.corners[:, 2], w.lean * spots.corners[:, :2].sum(axis=1))
    choice = nearest_box(problem, ranked(all_spots, rank))
    if choice is None or choice.candidate.placed.top_mm > w.lid * 400:
        return None
    return choice

def plain(problem):
    return mine(problem)
"""
BOXES = 'id,length_mm,width_mm,height_mm\na,200,200,80\nb,300,200,80\nc,200,100,80\n'
FEW = ('--bin', '60x40x40', '--boxes', 'draw:boxes.csv', '--profile', 'paper', '--orientations',
       'upright', '--scan-sigma', '0', '--check-streams', '3', '--stream-bins', '3', '--streams',
       '1', '--step', '0.15')  # fmt: skip


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'mine.py').write_text(RULE)
    (tmp_path / 'boxes.csv').write_text(BOXES)
    yield tmp_path
    SPECS.pop('lidded', None)


def tune(*arguments):
    """Exit code of ``cell tune``, whether it returns or leaves."""
    try:
        return main(['tune', *FEW, '--algorithm', './mine.py:mine', *map(str, arguments)])
    except SystemExit as leaving:
        return leaving.code


def test_it_finds_better_weights(folder, capsys):
    assert tune('--evaluations', 18, '--json', 'o.json') == 0
    output = capsys.readouterr()
    told = json.loads((folder / 'o.json').read_text())
    assert told['check']['verdict'] == 'better'
    assert told['check']['gain'] > 10.0
    assert told['weights']['lid'] > 0.6 > told['start']['lid']
    assert 'that the search has not seen' in output.out and 'better' in output.out
    assert 'generation 3, 18 candidates' in output.err
    (entry,) = read_table(folder / 'tuned.json').entries
    assert (entry.algorithm, entry.bin_name, entry.profile) == ('mine.py:mine', '60x40x40', 'paper')
    assert entry.made['seed'] == 1


def test_a_benchmark_packs_with_them_in_other_processes_too(folder):
    entry = TunedEntry('mine.py:mine', '60x40x40', (600, 400, 400), 'paper', 'upright',
                       (('lid', 1.0),))  # fmt: skip
    write_table(TunedTable((entry,)), folder / 'tuned.json')
    bench = ['bench', '--algorithms', './mine.py:mine', '--bins', '60x40x40', '--collections', '2',
             '--boxes', 'boxes.csv', '--orientations', 'upright', '--json']  # fmt: skip
    assert main([*bench, 'own.json']) == 0
    assert main([*bench, 'with.json', '--tuned', 'tuned.json', '--jobs', '2']) == 0
    before, after = (
        json.loads((folder / name).read_text())[0] for name in ('own.json', 'with.json')
    )
    assert after['fill_closed'] > before['fill_closed'] + 5.0
    assert after['settings']['tuned_digest']


def test_it_goes_on_where_it_was_and_ends_where_one_run_would(folder, capsys):
    assert tune('--evaluations', 6, '--out', 'once.json') == 0
    known = (folder / 'once.json.trials').read_text()
    with (folder / 'once.json.trials').open('a') as file:
        file.write('{"weights": {"lid"')  # killed while it wrote
    assert tune('--evaluations', 12, '--out', 'once.json') == 0
    assert 'known of earlier runs: ' in capsys.readouterr().err
    assert (folder / 'once.json.trials').read_text().startswith(known)
    assert tune('--evaluations', 12, '--out', 'twice.json', '--quiet') == 0
    assert capsys.readouterr().err == ''
    once, twice = (read_table(folder / name).entries for name in ('once.json', 'twice.json'))
    assert once == twice


@pytest.mark.slow
def test_after_an_interrupt_the_same_command_goes_on(folder):
    command = [sys.executable, '-m', 'pack_cell', 'tune', *FEW, '--algorithm', './mine.py:mine',
               '--evaluations', '36']  # fmt: skip
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    trials = folder / 'tuned.json.trials'
    deadline = time.monotonic() + 100.0
    while not trials.exists() or trials.read_text().count('\n') < 1:
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=100.0)
    assert process.returncode == 130, error
    assert (
        error.splitlines()[-1] == ('cell tune: interrupted; the same command goes on from here')
        and 'Traceback' not in error
    )
    assert not (folder / 'tuned.json').exists()
    known = trials.read_text()
    assert tune('--evaluations', 36) == 0
    assert trials.read_text().startswith(known)


def test_what_a_file_holds_for_others_stays(folder):
    assert tune('--evaluations', 6) == 0
    (folder / 'tuned.json.trials').unlink()
    assert tune('--evaluations', 6, '--bin', '50x40x40') == 0
    assert [entry.bin_name for entry in read_table(folder / 'tuned.json').entries] == [
        '60x40x40', '50x40x40',
    ]  # fmt: skip


def test_what_is_not_better_is_not_written(folder, capsys):
    assert tune('--evaluations', 6) == 0
    before = (folder / 'tuned.json').read_text()
    assert tune('--minutes', 0.000001, '--start', 'tuned.json', '--out', 'again.json') == 1
    assert 'no better' in capsys.readouterr().out
    assert not (folder / 'again.json').exists()
    assert (folder / 'tuned.json').read_text() == before


@pytest.mark.parametrize(('options', 'said'), [
    (['--algorithm', 'rollout'], "algorithm 'rollout' has no weights to tune: use foresight"),
    (['--algorithm', './mine.py:plain'], "'mine.py:plain' has no weights to tune"),
    (['--boxes', 'none.csv'], 'none.csv'),
    (['--start', 'none.json'], 'none.json cannot be read'),
    (['--bin', 'XXL'], 'XXL'),
    (['--only', 'lid,depth'], "no weight 'depth' to search: use some of lid, lean"),
    (['--stream-bins', '1'], 'raise --stream-bins, now 1'),
    (['--seed', '2', '--out', 'other.json'], 'of a tuning with other options'),
    (['--out', 'mine.py'], 'are not JSON'),
])  # fmt: skip
def test_what_cannot_be_tuned_is_said_in_one_line(options, said, folder, capsys):
    if 'other.json' in options:
        (folder / 'other.json.trials').write_text('{"tuning": {"seed": 1}}\n')
    assert tune('--evaluations', 6, *options, '--quiet') == 2
    error = capsys.readouterr().err
    assert said in error and error.count('\n') == 1


def settings(**changes):
    values = {
        'algorithm': 'foresight', 'bin_spec': parse_bin('60x40x40'), 'profile': PROFILES['dense'],
        'boxes': ('draw:cartons',), **changes,
    }  # fmt: skip
    return TuneSettings(**values)


def sizes(boxes):
    return [box.size_mm for box in boxes]


def test_a_stream_is_the_same_again_and_no_other_is_like_it():
    one = stream_boxes(settings(), TRAINING, 0)
    assert one == stream_boxes(settings(), TRAINING, 0)
    others = [stream_boxes(settings(), TRAINING, 1), stream_boxes(settings(), CHECK, 0)]
    assert all(sizes(one)[:5] != sizes(other)[:5] for other in others)
    assert sum(box.volume_mm3 for box in one) >= 6 * parse_bin('60x40x40').volume_mm3
    assert all(box.size_stddev_mm == (2.0, 2.0, 2.0) for box in one)


def test_how_a_list_is_read_is_part_of_what_is_tuned_for(tmp_path):
    path = tmp_path / 'boxes.csv'
    path.write_text('id;l;w;h\n' + ''.join(f'{n};30,125;20,250;{n + 10},500\n' for n in range(9)))
    read = settings(boxes=(str(path),), reading=Reading('cm', 'comma'), scan_sigma_mm=0.0)
    assert {box.size_mm[:2] for box in stream_boxes(read, TRAINING, 0)} == {(301.25, 202.5)}
    assert read.identity['reading']['units'] == 'cm'
    assert 'reading' not in settings().identity


def test_a_list_in_its_order_is_checked_on_its_last_third(tmp_path):
    rows = [f'{number},{300 + number},200,100' for number in range(300)]
    path = tmp_path / 'orders.csv'
    path.write_text('\n'.join(['id,length_mm,width_mm,height_mm', *rows]))
    of_file = settings(boxes=(str(path),), scan_sigma_mm=0.0, stream_bins=1.0)
    for part, low, high in ((TRAINING, 0, 199), (CHECK, 200, 299)):
        firsts = [stream_boxes(of_file, part, number)[:2] for number in range(40)]
        lengths = [first.size_mm[0] - 300 for first, _ in firsts]
        assert low <= min(lengths) and max(lengths) <= high
        assert all((after.size_mm[0] - first.size_mm[0]) % 300 == 1 for first, after in firsts)


def test_boxes_take_turns():
    both = settings(boxes=('draw:cartons', 'syn'), scan_sigma_mm=0.0)
    multiples = [
        all(edge % 10 == 0 for size in sizes(stream_boxes(both, CHECK, number)) for edge in size)
        for number in range(4)
    ]
    assert multiples == [False, True, False, True]


def test_the_limits_are_of_weights_that_there_are():
    own = find_algorithm('foresight').weights
    assert set(LIMITS) <= set(WeightSpace(own).names)
    assert UNIT not in WeightSpace(own).names and hasattr(own, UNIT)


def test_a_point_of_the_space_is_weights_and_the_start_is_one():
    own = find_algorithm('foresight').weights
    space = WeightSpace(own)
    inside = dict(space.weights(space.first))
    limits = {name: LIMITS[name] for name in space.names}
    assert all(
        inside[name] == pytest.approx(value, abs=0.021 * (limits[name][1] - limits[name][0]))
        for name, value in space.start
        if name in limits
    )
    kept = {name: value for name, value in space.start if name not in space.names}
    assert kept.items() <= dict(space.weights(0 * space.first)).items()


def test_only_what_is_asked_for_is_searched():
    own = find_algorithm('foresight').weights
    space = WeightSpace(own, ('snug', 'lost'))
    assert space.names == ('lost', 'snug')
    moved = dict(space.weights(0 * space.first))
    assert {name for name, value in space.start if moved[name] != value} == {'lost', 'snug'}


def test_time_ends_the_search_between_two_trials(folder):
    seconds = iter(range(100))
    limits = Limits(until_s=30.0, clock=lambda: float(next(seconds)))
    few = settings(
        algorithm=f'{folder / "mine.py"}:mine', boxes=(f'draw:{folder / "boxes.csv"}',),
        profile=PROFILES['paper'], stream_bins=3.0, streams=1,
    )  # fmt: skip
    space = WeightSpace(find_algorithm(few.algorithm).weights)
    book = TrialBook(few, Workers(), None)
    found = search(few, space, book, limits, lambda _: None)
    assert 1 <= len(found.generations) < 6
    assert found.weights != space.start


@pytest.mark.parametrize(('after', 'verdict'), [
    ((60.0, 61.0), 'no better'), ((61.0, 66.0), 'maybe better'), ((63.0, 64.0), 'better'),
])  # fmt: skip
def test_the_verdict_weighs_the_gain_against_chance(after, verdict):
    assert Gain((60.0, 61.0), after).verdict == verdict


def test_a_file_that_was_made_for_something_else_is_said_to_be(folder, capsys):
    entry = TunedEntry('foresight', 'RC', (1200, 700, 1600), 'dense', 'any', (('lost', 1.0),))
    write_table(TunedTable((entry,)), folder / 'cage.json')
    given = ['--algorithm', 'foresight', '--tuned', 'cage.json', '--profile', 'dense']
    options = parse_run_options([*given, '--bin', 'LDC'])
    told = 'tuned for RC, dense, any; used for LDC, dense, upright_or_tipped'
    assert tuned_note(options) == f'{folder / "cage.json"} was {told}'
    assert tuned_note(parse_run_options(['--bin', 'LDC'])) == ''
    few = ['--algorithms', 'foresight', '--bins', '60x40x40', '--boxes', 'boxes.csv']
    assert main(['bench', *few, '--profile', 'dense', '--tuned', 'cage.json']) == 0
    told = 'tuned for RC, dense, any; used for 60x40x40, dense, upright_or_tipped'
    expected = f'note: cage.json was {told}'
    assert expected in capsys.readouterr().err


def test_a_run_refuses_weights_that_are_not_for_its_algorithm(folder, capsys):
    entry = TunedEntry('foresight', 'RC', (1200, 700, 1600), 'dense', 'any', (('lost', 1.0),))
    write_table(TunedTable((entry,)), folder / 'cage.json')
    assert main(['run', '--algorithm', 'rollout', '--tuned', 'cage.json']) == 2
    assert "algorithm 'rollout' has no weights to tune" in capsys.readouterr().err
    few = ['--algorithms', 'rollout,dbl', '--bins', '60x40x40']
    assert main(['bench', *few, '--tuned', 'cage.json']) == 2
    assert "algorithm 'rollout' has no weights to tune" in capsys.readouterr().err
