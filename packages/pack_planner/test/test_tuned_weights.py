"""Tuned weights: which come nearest, files that are read or refused, and that they decide."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

import pytest

from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Bin, Box, parse_bin
from pack_planner import all_spots, find_algorithm, pack
from pack_planner.algorithms import AlgorithmSpec, Problem, foresight
from pack_planner.algorithms.play_out import best_plan
from pack_planner.algorithms.ranking import nearest_box, ranked
from pack_planner.algorithms.tuned_tables import (
    check_table,
    parse_table,
    read_table,
    shipped_table,
    table_text,
    weights_for,
    write_table,
)
from pack_planner.algorithms.tuned_weights import TunedEntry, TunedTable, unlike
from pack_planner.engine import Engine
from pack_planner.parameters import PlannerParameters, settings

ANY = replace(PROFILES['dense'], orientations='any')
DEFAULT = find_algorithm('foresight').weights


def entry(kind='LDC', profile='dense', orientations='any', name='foresight', **weights):
    spec = parse_bin(kind)
    values = tuple((weights or {'lost': 1.5}).items())
    return TunedEntry(name, spec.name, spec.size_mm, profile, orientations, values)


def found(kind, profile, *entries):
    return TunedTable(entries).nearest('foresight', parse_bin(kind), profile)


def test_the_nearest_bin_is_the_one_of_like_edges_whichever_way_it_lies():
    kinds = [entry(kind) for kind in ('LDC', 'RC', 'EQ', 'PAL', 'SYN')]
    assert found('75x125x155', ANY, *kinds).bin_name == 'RC'
    assert found('120x200x85', ANY, *kinds).bin_name == 'PAL'
    assert found('75x85x80', ANY, *kinds).bin_name == 'EQ'


def test_rules_count_more_than_bins_and_support_more_than_turning():
    far, other_turning = entry('PAL'), entry('LDC', orientations='upright')
    assert found('LDC', ANY, other_turning, far) is far
    other_support = entry('LDC', 'cell')
    assert found('LDC', ANY, other_support, other_turning) is other_turning
    paper_like = entry('LDC', 'paper', 'upright')
    assert found('LDC', PROFILES['cell'], other_turning, paper_like) is paper_like
    assert found('LDC', ANY, entry('LDC', name='another')) is None


def test_what_was_tuned_for_something_else_is_told():
    assert unlike(entry('LDC'), parse_bin('LDC'), ANY) == ''
    told = unlike(entry('LDC'), parse_bin('RC'), PROFILES['cell'])
    assert told == 'tuned for LDC, dense, any; used for RC, cell, upright'


def test_of_a_file_the_nearest_entry_holds_and_of_the_shipped_ones_only_what_is_alike(monkeypatch):
    table = TunedTable((entry('RC', 'cell', 'upright', lost=2.5),))
    spec = parse_bin('LDC')
    assert weights_for(table, 'foresight', DEFAULT, spec, ANY) == replace(DEFAULT, lost=2.5)
    monkeypatch.setattr('pack_planner.algorithms.tuned_tables.shipped_table', lambda: table)
    own = replace(DEFAULT, level=0.625)  # not asked for before, so that no answer is remembered
    assert weights_for(None, 'foresight', own, spec, ANY) == own
    assert weights_for(None, 'foresight', own, spec, PROFILES['cell']).lost == 2.5


def test_every_shipped_entry_is_for_an_algorithm_that_has_such_weights():
    table = shipped_table()
    for name in {entry.algorithm for entry in table.entries}:
        check_table(table, name, find_algorithm(name).weights)
    assert not table.has('rollout')


def test_a_file_is_read_as_it_was_written(tmp_path):
    table = TunedTable((replace(entry(lost=0.25, far_ends=False), made={'seed': 3}), entry('RC')))
    write_table(table, tmp_path / 'tuned.json')
    again = read_table(tmp_path / 'tuned.json')
    assert again.entries == table.entries
    assert again.entries[0].made == {'seed': 3}
    assert again.digest == table.digest != again.plus(entry('RC', lost=9.0)).digest
    assert len(again.plus(entry('RC', lost=9.0)).entries) == 2


@pytest.mark.parametrize(('change', 'said'), [
    (lambda c: c.update(format='other'), 'holds no tuned weights'),
    (lambda c: c.update(version=2), 'has version 2, and this package reads 1'),
    (lambda c: c.pop('entries'), 'has no list of "entries"'),
    (lambda c: c['entries'].append(7), 'entry 2: 7 is no entry'),
    (lambda c: c['entries'].append(c['entries'][0]), 'two entries for foresight, LDC, dense, any'),
    (lambda c: c['entries'][0].pop('profile'), "entry 1: 'profile' is missing"),
    (lambda c: c['entries'][0].update(profile='loose'), "unknown profile 'loose'"),
    (lambda c: c['entries'][0].update(orientations='up'), "unknown orientations 'up'"),
    (lambda c: c['entries'][0]['bin'].update(size_mm=[800, 0, 800]), 'three whole numbers above 0'),
    (lambda c: c['entries'][0].update(weights=[]), 'they must be numbers by name'),
    (lambda c: c['entries'][0]['weights'].update(lost=float('nan')), 'weight lost is nan'),
    (lambda c: c['entries'][0]['weights'].update(lost='1'), "weight lost is '1'"),
    (lambda c: c['entries'][0]['weights'].update(lost=1e9), 'a number from -10000 to 10000'),
])  # fmt: skip
def test_a_bad_file_is_refused_with_what_is_wrong(change, said):
    content = json.loads(table_text(TunedTable((entry(),))))
    change(content)
    with pytest.raises(ValueError, match=r'^mine\.json') as error:
        parse_table(json.dumps(content), 'mine.json')
    assert said in str(error.value)


@pytest.mark.parametrize(('weights', 'said'), [
    ({'lust': 1.0}, "unknown weight 'lust' of foresight: use one of lost, touched"),
    ({'lost': True}, 'weight lost of foresight is True; it must be a number'),
    ({'far_ends': 1.0}, 'weight far_ends of foresight is 1.0; it must be true or false'),
])  # fmt: skip
def test_weights_that_the_algorithm_lacks_are_refused(weights, said):
    with pytest.raises(ValueError) as error:
        check_table(TunedTable((entry(**weights),), 'mine.json'), 'foresight', DEFAULT)
    assert 'mine.json, LDC, dense, any: ' + said in str(error.value)


def test_a_file_that_is_missing_or_no_text_or_no_json_is_refused(tmp_path):
    with pytest.raises(ValueError, match='cannot be read: No such file'):
        read_table(tmp_path / 'none.json')
    (tmp_path / 'bytes').write_bytes(b'\xff\xfe\x00')
    with pytest.raises(ValueError, match='cannot be read: it is no text'):
        read_table(tmp_path / 'bytes')
    (tmp_path / 'words').write_text('lost: 1')
    with pytest.raises(ValueError, match='are not JSON'):
        read_table(tmp_path / 'words')


def test_they_are_refused_for_an_algorithm_without_weights_or_another_one(tmp_path):
    path = tmp_path / 'tuned.json'
    write_table(TunedTable((entry(name='another'),)), path)
    with pytest.raises(ValueError, match="'rollout' has no weights to tune"):
        pack([], 'LDC', 'rollout', tuned=path)
    with pytest.raises(ValueError, match=r'tuned\.json is for another, not for foresight'):
        pack([], 'LDC', 'foresight', tuned=path)
    with pytest.raises(ValueError, match=r'tuned\.json is for another, not for foresight'):
        settings(replace(PlannerParameters(), algorithm='foresight', tuned=str(path)))


def test_the_node_plans_with_the_file_of_its_parameter(tmp_path):
    write_table(TunedTable((entry(),)), tmp_path / 'tuned.json')
    parameters = replace(
        PlannerParameters(), algorithm='foresight', tuned=str(tmp_path / 'tuned.json')
    )
    assert settings(parameters).tuned.entries == (entry(),)


def first_corner(**weights):
    model = Engine(ANY).model(Bin('b', 1, parse_bin('60x40x40')))
    box = Box('only', (196.0, 196.0, 200.0))
    problem = Problem(
        Engine(ANY), (box,), (model,), tuned=TunedTable((entry('60x40x40', **weights),))
    )
    return find_algorithm('foresight')(problem).candidate.placed.corner_mm


def test_they_decide_where_a_box_goes():
    assert first_corner(spread=1.0) == (0, 0, 0)
    assert first_corner(spread=-1.0) == (400, 200, 0)


def test_the_shipped_ones_hold_where_no_file_is_named(monkeypatch):
    table = TunedTable((entry('60x40x40', spread=-1.0),))
    monkeypatch.setattr('pack_planner.algorithms.tuned_tables.shipped_table', lambda: table)
    rules = replace(ANY, max_payload_kg=17.0)  # not asked for before
    (packed,) = pack([Box('only', (196.0, 196.0, 200.0))], '60x40x40', 'foresight', 1, 1, rules)
    assert packed.placed.corner_mm == (400, 200, 0)


@dataclass(frozen=True)
class Leaning:
    """Weights of a rule of one's own."""

    x: float = 1.0


def leans(problem):
    x = problem.weights_or(Leaning()).x
    return nearest_box(problem, ranked(all_spots, lambda spots, _: (x * spots.corners[:, 0],)))


def test_a_rule_of_ones_own_can_have_weights_too():
    rule = AlgorithmSpec('leans', leans, weights=Leaning())
    boxes = [Box(str(number), (200.0, 400.0, 100.0)) for number in range(2)]
    table = TunedTable((entry('60x40x40', name='leans', x=-1.0),))
    for tuned, corner in ((None, (0, 0, 100)), (table, (200, 0, 0))):
        _, second = pack(boxes, '60x40x40', rule, 1, 1, 'paper', tuned=tuned)
        assert second.placed.corner_mm == corner


def test_called_directly_an_algorithm_has_its_own_weights():
    model = Engine(ANY).model(Bin('b', 1, parse_bin('60x40x40')))
    choice = foresight.foresight(Problem(Engine(ANY), (Box('a', (196.0, 196.0, 90.0)),), (model,)))
    assert choice.candidate.placed.corner_mm == (0, 0, 0)


@pytest.mark.parametrize('profile', PROFILES)
@pytest.mark.parametrize('open_bins', [1, 2, 3])
def test_foresight_decides_by_the_weights_of_the_profile_and_the_bins(
    profile, open_bins, monkeypatch
):
    used = []

    def spied(problem, weights, alike):
        used.append(weights)
        return best_plan(problem, weights, alike)

    monkeypatch.setattr(foresight, 'best_plan', spied)
    rules = replace(PROFILES[profile], orientations='any')
    next(pack([Box('a', (196.0, 196.0, 90.0))], 'EQ', 'foresight', 1, open_bins, rules))
    own = {
        'paper': foresight.WEIGHTS_OF_PAPER,
        'cell': foresight.WEIGHTS_BY_VERTICES,
        'dense': foresight.WEIGHTS,
    }[profile]
    assert used[-1] == (own if open_bins == 1 else replace(own, room=0.0))
