"""Algorithms by name: built in, registered, of a file of one's own, of an installed package."""

from __future__ import annotations

import subprocess
import sys

import pytest
from planner_cases import SMALL

from pack_msgs_py.profiles import PROFILES
from pack_planner import Box, pack
from pack_planner.algorithms import BUILT_IN, algorithm, algorithm_names, find_algorithm
from pack_planner.algorithms.registry import SPECS
from pack_planner.coordination.alternatives import quick
from pack_planner.decision.policy import PolicySettings

MINE = """
from pack_planner import algorithm, nearest_box, ranked, all_spots
from beside import higher

@algorithm('mine', alternatives='first_fit')
def my_rule(problem):
    return nearest_box(problem, ranked(all_spots, higher))

def two(problem, more): return None
def fails(problem): return 1 / 0
number = 7
"""
BESIDE = 'def higher(spots, model):\n    return (-spots.corners[:, 2],)\n'


@pytest.fixture(autouse=True)
def registered(monkeypatch):
    """What a test registers is forgotten after it."""
    before = dict(SPECS)
    yield
    SPECS.clear()
    SPECS.update(before)


@pytest.fixture
def mine(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, 'path', [*sys.path])
    monkeypatch.delitem(sys.modules, 'beside', raising=False)
    (tmp_path / 'mine.py').write_text(MINE)
    (tmp_path / 'beside.py').write_text(BESIDE)
    return tmp_path / 'mine.py'


def test_a_built_in_algorithm_has_the_name_of_its_file():
    for name in BUILT_IN:
        spec = find_algorithm(name)
        assert spec.name == name and spec.is_built_in
        assert spec.decide.__module__ == f'pack_planner.algorithms.{name}'
    assert algorithm_names()[: len(BUILT_IN)] == BUILT_IN


def test_the_decorator_leaves_the_function_as_it_is_and_registers_it():
    def lazy(problem):
        return None

    assert algorithm('lazy')(lazy) is lazy
    assert find_algorithm('lazy').decide is lazy and 'lazy' in algorithm_names()
    assert find_algorithm(lazy) is find_algorithm('lazy')
    algorithm('lazy', backends=True)(lazy)
    assert find_algorithm('lazy').backends, 'a cell of a notebook may run twice'


@pytest.mark.parametrize(('name', 'function', 'said'), [
    ('mpack', lambda problem: None, "'mpack' is taken by a built-in one"),
    ('my rule', lambda problem: None, "'my rule' is no name"),
    ('mine', lambda: None, r'mine\(\) is no algorithm: it must take one Problem'),
])  # fmt: skip
def test_what_is_no_algorithm_is_not_registered(name, function, said):
    with pytest.raises(ValueError, match=said):
        algorithm(name)(function)
    assert name in BUILT_IN or name not in algorithm_names()


def test_a_file_of_ones_own_is_found_with_what_lies_beside_it(mine, monkeypatch):
    monkeypatch.chdir(mine.parent)
    spec = find_algorithm('./mine.py:my_rule')
    assert (spec.name, spec.alternatives, spec.is_built_in) == (
        'mine.py:my_rule',
        'first_fit',
        False,
    )
    assert find_algorithm('./mine.py:my_rule') is spec
    towers = pack(
        [Box(str(n), (200.0, 200.0, 200.0)) for n in range(4)], SMALL, str(mine) + ':my_rule'
    )
    assert [packed.placed.corner_mm[2] for packed in towers] == [0, 200, 0, 200]


@pytest.mark.parametrize(('where', 'said'), [
    ('mine.py:nothing', "has no 'nothing'; it has"),
    ('mine.py:two', r'mine.py:two\(problem, more\) is no algorithm'),
    ('mine.py:number', 'mine.py:number is no function but int'),
    ('nowhere.py:rule', 'nowhere.py cannot be read: No such file'),
    ('mine.py', 'or .*mine.py:FUNCTION'),
    ('broken.py:rule', r'ZeroDivisionError: division by zero \(line 2\)'),
    ('taken.py:rule', "'mpack' is taken"),
    ('half.py:rule', 'SyntaxError'),
])  # fmt: skip
def test_what_is_wrong_with_a_file_is_said(mine, where, said):
    (mine.parent / 'broken.py').write_text('\nhalf = 1 / 0\n')
    (mine.parent / 'half.py').write_text('def rule(problem:\n')
    (mine.parent / 'taken.py').write_text(
        "from pack_planner import algorithm\n@algorithm('mpack')\ndef rule(problem): return None\n"
    )
    with pytest.raises(ValueError, match=said):
        find_algorithm(f'{mine.parent}/{where}')


def test_a_file_is_read_once_and_again_when_another_version_is_asked_for(mine):
    where = f'{mine}:my_rule'
    old = find_algorithm(where)
    mine.write_text(MINE.replace('first_fit', 'best_fit'))
    assert find_algorithm(where) is old and find_algorithm(where, old.digest) is old
    script = f'from pack_planner import find_algorithm; print(find_algorithm({where!r}).digest)'
    digest = subprocess.run(
        [sys.executable, '-c', script], capture_output=True, text=True, check=True
    ).stdout.strip()
    new = find_algorithm(where, digest)
    assert new.alternatives == 'best_fit' and new.digest == digest != old.digest
    with pytest.raises(ValueError, match='has changed since it was asked for'):
        find_algorithm(where, old.digest)


def test_an_installed_package_offers_an_algorithm_by_its_name(mine, monkeypatch):
    folder = mine.parent / 'rules_of_mine-1.0.dist-info'
    folder.mkdir()
    (folder / 'METADATA').write_text('Metadata-Version: 2.1\nName: rules-of-mine\nVersion: 1.0\n')
    (folder / 'entry_points.txt').write_text(
        '[pack_planner.algorithms]\nhighest = rules_of_mine:my_rule\n'
    )
    (mine.parent / 'rules_of_mine.py').write_text(MINE)
    monkeypatch.setattr(sys, 'path', [str(mine.parent), *sys.path])
    monkeypatch.delitem(sys.modules, 'rules_of_mine', raising=False)
    assert 'highest' in algorithm_names()
    assert find_algorithm('highest').name == 'highest'
    assert find_algorithm('rules_of_mine:my_rule').name == 'rules_of_mine:my_rule'
    assert pack([Box('a', (200.0, 200.0, 200.0))], SMALL, 'highest').finish().boxes == 1


def test_alternatives_come_from_whom_the_algorithm_names(mine):
    def followers_of(which):
        return quick(PolicySettings(which, PROFILES['cell'], backend='milp'))

    assert followers_of('mpack').spec.name == 'mpack_lite'
    assert followers_of(f'{mine}:my_rule').spec.name == 'first_fit'
    assert followers_of('rollout').spec.name == 'rollout'
    assert followers_of('mpack').backend == 'search'
