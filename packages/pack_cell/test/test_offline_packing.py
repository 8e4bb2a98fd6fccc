"""How many bins the boxes of a run would need without a belt: a bound, and an offline packer."""

from __future__ import annotations

import sys
from dataclasses import replace

import pytest

from pack_cell.report import offline_packing
from pack_cell.report.offline_packing import MOST_BOXES, OfflineBins, offline_bins
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Box, parse_bin

EQ = parse_bin('EQ')
DENSE = replace(PROFILES['dense'], orientations='upright')


def boxes(count, size=(390.0, 390.0, 390.0), weight_kg=1.0, **more):
    return [Box(f'box {n}', size, weight_kg, **more) for n in range(count)]


@pytest.fixture
def no_packer(monkeypatch):
    monkeypatch.setattr(offline_packing, '_ask_packer', lambda problem, timeout_s: None)


@pytest.mark.usefixtures('no_packer')
@pytest.mark.parametrize(
    ('some', 'least'),
    [
        ([], 0),
        (boxes(8, (400.0, 400.0, 400.0)), 1),
        (boxes(9, (400.0, 400.0, 400.0)), 2),
        (boxes(51, (10.0, 10.0, 10.0), 10.0), 2),
        ([*boxes(1, destination='D1'), *boxes(2, destination='D2')], 2),
        (boxes(3 * MOST_BOXES, (80.0, 80.0, 80.0), 0.1), 3),
    ],
    ids=['none', 'volume', 'a little more', 'weight', 'destinations', 'many'],
)
def test_no_fewer_bins_hold_the_volume_and_the_weight(some, least):
    assert offline_bins(some, EQ, DENSE) == OfflineBins(least)


def test_a_packer_that_breaks_down_costs_a_figure_and_nothing_else(monkeypatch, tmp_path):
    monkeypatch.setattr(offline_packing.importlib.util, 'find_spec', lambda name: object())
    broken = tmp_path / 'python'
    for script in ('exit 136', 'echo nonsense', 'echo "[1]"', 'echo null', 'sleep 60'):
        broken.write_text(f'#!/bin/sh\n{script}\n')
        broken.chmod(0o755)
        monkeypatch.setattr(sys, 'executable', str(broken))
        monkeypatch.setattr(offline_packing, 'GRACE_S', 0.2)
        assert offline_bins(boxes(3), EQ, DENSE, limit_s=0.3) == OfflineBins(1), script
    monkeypatch.setattr(sys, 'executable', str(tmp_path / 'none'))
    assert offline_bins(boxes(3), EQ, DENSE) == OfflineBins(1)


class TestPacker:
    """With the solver itself."""

    @pytest.fixture(autouse=True)
    def _installed(self):
        pytest.importorskip('packingsolver3d')

    def test_it_needs_as_many_bins_as_there_must_be(self):
        assert offline_bins(boxes(9), EQ, DENSE, 2.0) == OfflineBins(2, 2)

    def test_it_keeps_boxes_upright_unless_another_face_may_come_up(self):
        planks = boxes(4, (790.0, 790.0, 200.0))
        standing = boxes(4, (200.0, 790.0, 790.0))
        low = parse_bin('80x80x40')
        assert offline_bins(planks, low, DENSE, 2.0).packed == 2
        assert offline_bins(standing, low, DENSE, 2.0).packed is None
        assert offline_bins(standing, low, replace(DENSE, orientations='any'), 2.0).packed == 2

    def test_it_keeps_to_the_weight_of_a_bin(self):
        light = replace(DENSE, max_bin_weight_kg=20.0)
        assert offline_bins(boxes(8, weight_kg=9.0), EQ, light, 2.0).packed == 4
