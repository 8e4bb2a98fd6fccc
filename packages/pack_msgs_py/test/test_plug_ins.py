"""Plug-ins are found where they stand and by their names, and what is wrong with them is said."""

from __future__ import annotations

import sys

import pytest

from pack_msgs_py.plug_ins import PlugInError, load_plug_in, plug_ins_by_name


def test_a_plug_in_is_found_by_module_and_attribute():
    assert load_plug_in('math:tau') == 2 * load_plug_in('math:pi')


def test_a_file_is_loaded_once_and_may_hold_dataclasses(tmp_path):
    path = tmp_path / 'mine.py'
    path.write_text(
        'from __future__ import annotations\n'
        'from dataclasses import dataclass\n\n'
        '@dataclass(frozen=True)\nclass Mine:\n    number: int\n\nMINE = Mine(7)\n'
    )
    plug_in = load_plug_in(f'{path}:MINE')
    assert plug_in.number == 7
    assert load_plug_in(f'{path}:MINE') is plug_in


@pytest.mark.parametrize(
    ('where', 'said'),
    [
        ('nothing', 'must be module:attribute'),
        ('no_such_module:thing', 'no_such_module cannot be loaded: ModuleNotFoundError'),
        ('math:tua', "math has no 'tua'"),
        ('no/such/file.py:thing', 'file.py cannot be loaded: FileNotFoundError'),
    ],
)
def test_what_cannot_be_loaded_is_named(where, said):
    with pytest.raises(PlugInError, match=said):
        load_plug_in(where)


def test_a_file_that_fails_can_be_mended_and_loaded(tmp_path):
    path = tmp_path / 'broken.py'
    path.write_text('THING = 1 / 0\n')
    with pytest.raises(PlugInError, match='ZeroDivisionError'):
        load_plug_in(f'{path}:THING')
    path.write_text('THING = 10\n')
    assert load_plug_in(f'{path}:THING') == 10


def test_entry_points_of_installed_distributions_are_known_by_name(tmp_path, monkeypatch):
    folder = tmp_path / 'someone_else-1.0.dist-info'
    folder.mkdir()
    (folder / 'METADATA').write_text('Metadata-Version: 2.1\nName: someone-else\nVersion: 1.0\n')
    (folder / 'entry_points.txt').write_text('[a.group]\nround = math:pi\n')
    monkeypatch.setattr(sys, 'path', [str(tmp_path), *sys.path])
    assert plug_ins_by_name('a.group') == {'round': 'math:pi'}
    assert plug_ins_by_name('another.group') == {}
