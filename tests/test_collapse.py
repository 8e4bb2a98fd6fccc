"""The benchmark that shakes bins tells falling from standing, and goes on where it stopped."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pack_msgs_py.values import Box, PlacedBox

pytest.importorskip('pybullet')
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'benchmarks'))

import collapse
from physical_bin import Offset, PhysicalBin

pytestmark = pytest.mark.physics


@pytest.fixture
def pallet() -> Iterator[PhysicalBin]:
    bin_ = PhysicalBin('80x80x80:pallet')
    yield bin_
    bin_.close()


def stand(pallet: PhysicalBin, name: str, corner: tuple[int, int, int], size: tuple[int, int, int]):
    box = Box(name, tuple(map(float, size)), weight_kg=5.0)
    return pallet.place(PlacedBox(box, corner, size), box, Offset())


def test_what_is_higher_than_a_push_of_0_3_g_allows_falls_and_what_is_lower_stands(pallet):
    stand(pallet, 'wide', (50, 50, 0), (300, 300, 400))
    stand(pallet, 'slender', (500, 500, 0), (100, 100, 600))
    shaken = pallet.shake()
    assert shaken['slender'].fell
    assert not shaken['wide'].moved


def test_film_around_a_pallet_holds_what_would_fall_from_it(pallet):
    for number, (x, y) in enumerate(((0, 0), (110, 0), (0, 110), (110, 110))):
        stand(pallet, f'{number}', (300 + x, 300 + y, 0), (100, 100, 600))
    pallet.secure()
    assert not any(change.fell for change in pallet.shake().values())


def test_what_slid_until_it_met_a_neighbour_has_not_fallen(pallet):
    stand(pallet, 'base', (100, 100, 0), (400, 400, 100))
    landed = stand(pallet, 'top', (150, 150, 100), (200, 200, 100))
    assert not landed.moved
    start = pallet.poses()['top']
    slid = collapse.replace(start, position=(start.position[0] + 0.05, *start.position[1:]))
    pallet.world.move_box('top', pallet.frame.to_cell(slid))
    change = pallet.since_rest()['top']
    assert change.moved
    assert not change.fell


def test_a_bin_that_was_built_before_is_not_built_again(tmp_path, monkeypatch, capsys):
    out = tmp_path / 'collapse.jsonl'
    few = ['--bins', 'SYN', '--rules', 'dense', '--ways', 'anywhere', '--out', str(out)]
    assert collapse.main([*few, '--each', '1']) == 0
    first = out.read_text()
    built = []

    def build(case, **options):
        built.append(case)
        return collapse.Outcome(3, 0.5, 0, 0)

    monkeypatch.setattr(collapse, 'build', build)
    assert collapse.main([*few, '--each', '2']) == 0
    assert [case.seed for case in built] == [1]
    assert out.read_text().startswith(first)
    assert '| dense, anywhere | 2 |' in capsys.readouterr().out
