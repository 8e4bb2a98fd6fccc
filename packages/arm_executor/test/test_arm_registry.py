"""Arms by name: those of the package, and those of other people."""

from __future__ import annotations

import sys
from dataclasses import fields
from pathlib import Path

import pytest
from executor_cases import LAYOUT, make_box, make_decision

from arm_executor.arms.kind import ArmKind, ArmSetup
from arm_executor.arms.registry import ARMS, ARMS_IN_WORDS, find_arm
from arm_executor.arms.timed import TimedArm
from pack_msgs_py.codes import ErrorCode


@pytest.fixture
def installed_toy(tmp_path, monkeypatch):
    """A distribution that offers the toy arm, as pip would install it."""
    folder = tmp_path / 'toy_arm-1.0.dist-info'
    folder.mkdir()
    (folder / 'METADATA').write_text('Metadata-Version: 2.1\nName: toy-arm\nVersion: 1.0\n')
    (folder / 'entry_points.txt').write_text('[arm_executor.arms]\nquick = toy_arm:TOY\n')
    monkeypatch.setattr(sys, 'path', [str(tmp_path), *sys.path])


def test_arms_are_made_by_name():
    arm = find_arm('timed').make(ArmSetup(layout=LAYOUT, speed=0.0))
    assert isinstance(arm, TimedArm)
    with pytest.raises(ValueError, match='physics, timed'):
        find_arm('strong')


def test_an_arm_is_found_where_it_stands_and_by_entry_point(installed_toy):
    toy = find_arm('toy_arm:TOY')
    assert find_arm('quick') is toy
    assert toy.name == 'toy'


def test_an_unknown_arm_is_answered_with_those_that_are_known(installed_toy):
    known = ', '.join([*(kind.name for kind in ARMS), 'quick'])
    with pytest.raises(ValueError, match=f"'qick': use one of {known}"):
        find_arm('qick')


def test_what_is_no_kind_of_arm_is_named():
    with pytest.raises(ValueError, match=r"'toy_arm:ToyArm' is .* must be an ArmKind"):
        find_arm('toy_arm:ToyArm')


def test_an_arm_that_cannot_be_loaded_is_named():
    with pytest.raises(ValueError, match='no_such_arm cannot be loaded'):
        find_arm('no_such_arm:ARM')


def test_every_arm_is_in_the_help_with_what_it_does():
    for kind in ARMS:
        assert f'{kind.name} {kind.summary}' in ARMS_IN_WORDS


def test_the_page_about_arms_explains_every_field_of_a_kind():
    page = (Path(__file__).parents[3] / 'docs' / 'integration.md').read_text()
    for field in fields(ArmKind):
        assert f'`{field.name}`' in page, field.name


@pytest.mark.ros
@pytest.mark.parametrize('name', ['toy_arm:TOY', 'quick'])
def test_an_arm_of_somebody_else_places_a_box(start, installed_toy, name):
    bench = start(arm=name)
    box = make_box()
    bench.show(box, presented=box.id)
    _, result = bench.place(make_decision(box))
    assert (result.error_code, result.error_msg) == (ErrorCode.NONE, '')
    assert result.report.motion_time.sec == 1
    assert [placed.box.id for placed in bench.bins().bins[0].boxes] == [box.id]


@pytest.mark.ros
def test_what_an_arm_lifts_is_a_rule_of_the_cell(start):
    bench = start(arm='toy_arm:TOY')
    heavy = make_box(weight_kg=12.5)
    bench.show(heavy, presented=heavy.id)
    _, result = bench.place(make_decision(heavy))
    assert result.error_code == ErrorCode.RULE_VIOLATION
    assert 'the arm lifts 12 kg' in result.error_msg
