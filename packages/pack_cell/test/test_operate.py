"""The verbs of an operator: which cell they find, what they refuse, what a shell completes."""

from __future__ import annotations

import subprocess

import pytest

from pack_cell.cli import build_parser
from pack_cell.operate.completion import completion_script
from pack_cell.operate.options import (
    OPERATING,
    OPERATOR_VERBS,
    box_size,
    corner,
    placed_box_of,
)
from pack_cell.options.parsers import BadValue
from pack_cell.watching.finding import NoCell, domain_of_cell, held_domains, namespace_of_cell

HEADER = 'Num       RefCount Protocol Flags    Type St Inode Path\n'
LINE = '0000000000000000: 00000002 00000000 00000000 0002 01 22222 @packing-cell-domain-{}\n'


@pytest.fixture
def sockets(tmp_path, monkeypatch):
    """Domains that are held, as Linux lists them."""
    monkeypatch.delenv('ROS_DOMAIN_ID', raising=False)

    def make(*domains):
        path = tmp_path / 'unix'
        path.write_text(HEADER + ''.join(LINE.format(number) for number in domains))
        return path

    return make


def test_the_only_cell_of_the_machine_is_found(sockets):
    assert held_domains(sockets(101, 0)) == [0, 101]
    assert domain_of_cell(None, sockets(101)) == 101


def test_without_one_a_launched_cell_is_looked_for_in_domain_0(sockets):
    assert domain_of_cell(None, sockets()) == 0


def test_of_several_cells_somebody_must_say_which(sockets):
    with pytest.raises(NoCell, match='domains 0, 101: say which with --domain'):
        domain_of_cell(None, sockets(101, 0))
    assert domain_of_cell(7, sockets(101, 0)) == 7


def test_what_is_asked_for_and_the_environment_come_first(sockets, monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '42')
    assert domain_of_cell(None, sockets(101)) == 42
    assert domain_of_cell(7, sockets(101)) == 7
    monkeypatch.setenv('ROS_DOMAIN_ID', 'north')
    with pytest.raises(NoCell, match="'north'"):
        domain_of_cell(None, sockets(101))


@pytest.mark.parametrize(
    ('asked', 'seen', 'said'),
    [
        (None, set(), 'no cell runs in ROS domain 3: start one with cell run'),
        (None, {'/a', '/b'}, '/a, /b: say which with --namespace'),
        ('c', {'/a'}, 'no cell in namespace /c of ROS domain 3; namespaces with one: /a'),
    ],
)
def test_a_cell_that_is_not_clear_is_refused_with_what_there_is(asked, seen, said):
    with pytest.raises(NoCell, match=said):
        namespace_of_cell(asked, seen, 3)


def test_the_namespace_may_be_written_with_or_without_its_slash():
    assert namespace_of_cell('a', {'/a', '/b'}, 0) == '/a'
    assert namespace_of_cell('/b/', {'/a', '/b'}, 0) == '/b'
    assert namespace_of_cell(None, {'/'}, 0) == '/'


@pytest.mark.parametrize('text', ['300x200', 'axbxc', '0x1x1', '1x1x1e9', '1x1xnan'])
def test_a_size_that_is_none_is_refused_with_its_text(text):
    with pytest.raises(BadValue, match=text.split('x')[0]):
        box_size(text)


def test_a_corner_is_whole_millimetres():
    assert corner('0,300,-5') == (0, 300, -5)
    with pytest.raises(BadValue, match=r"'1\.5,0,0' is not a corner"):
        corner('1.5,0,0')


def test_a_box_put_into_a_bin_takes_the_room_of_its_orientation():
    parse = build_parser().parse_args
    given = parse(['insert', 'x', '300.5x200x150', '--bin', 'A', '--at', '0,0,0',
                   '--orientation', 'yxz'])  # fmt: skip
    assert placed_box_of(given).size_mm == (200, 301, 150)
    with pytest.raises(ValueError, match='needs --at'):
        placed_box_of(parse(['insert', 'x', '300x200x150', '--bin', 'A']))


@pytest.mark.parametrize('verb', [verb.name for verb in OPERATOR_VERBS])
def test_every_verb_takes_who_and_why_and_says_what_it_does(verb, capsys):
    with pytest.raises(SystemExit) as ended:
        build_parser().parse_args([verb, '--help'])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert '--who' in text and '--why' in text and '--timeout' in text


@pytest.mark.parametrize('shell', ['bash', 'zsh'])
def test_a_shell_completes_every_verb(shell):
    script = completion_script(build_parser(with_script=True), shell)
    assert all(verb in script for verb in (*OPERATING, 'run', 'echo', 'setup'))


def test_bash_completes_a_verb_that_was_begun(tmp_path):
    path = tmp_path / 'cell.bash'
    path.write_text(completion_script(build_parser(with_script=True), 'bash'))
    asked = (
        f'source {path}; COMP_WORDS=(cell pau); COMP_CWORD=1; '
        '_shtab_cell cell pau cell; echo "${COMPREPLY[*]}"'
    )
    done = subprocess.run(['bash', '-c', asked], capture_output=True, text=True, timeout=30)
    assert done.stdout.split() == ['pause'], done.stderr
