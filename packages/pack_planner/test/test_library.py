"""The library: a stream of boxes in, placements, figures, arrays and a picture out."""

from __future__ import annotations

import itertools
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from planner_cases import SMALL

from pack_msgs_py.profiles import adapted
from pack_planner import (
    PROFILES,
    AlgorithmError,
    Box,
    Candidate,
    Choice,
    EngineMismatch,
    PlacedBox,
    draw_bin,
    pack,
    validate_bins,
)
from pack_planner.packing.drawing import far_to_near


def cubes(count, edge=200.0):
    return [Box(f'cube {number}', (edge, edge, edge)) for number in range(count)]


def test_placements_come_as_they_are_decided_and_boxes_are_taken_as_they_are_needed():
    taken = []

    def endless():
        for number in itertools.count():
            taken.append(number)
            yield Box(f'cube {number}', (200.0, 200.0, 200.0))

    packing = pack(endless(), SMALL, look_ahead=3, open_bins=1)
    assert taken == []
    first = next(packing)
    assert taken == [0, 1, 2]
    assert first.placed.corner_mm == (0, 0, 0) and first.target.boxes == ()
    next(packing)
    assert taken == [0, 1, 2, 3]
    assert packing.figures.boxes == 2


@pytest.mark.parametrize('algorithm', ['mpack_lite', 'rollout'])
@pytest.mark.parametrize('profile', ['cell', 'dense'])
@pytest.mark.parametrize(
    ('clearance_mm', 'resolution_mm', 'in_a_bin'), [(0.0, 10, 24), (0.0, 1, 24), (4.0, 1, 12)]
)
def test_crates_of_a_quarter_of_a_pallet_fill_it_where_margins_leave_the_room(
    algorithm, profile, clearance_mm, resolution_mm, in_a_bin
):
    upright = replace(PROFILES[profile], orientations='upright')
    rules = adapted(upright, clearance_mm=clearance_mm, resolution_mm=resolution_mm)
    crates = [Box(f'crate {n}', (600.0, 400.0, 240.0), weight_kg=8.0) for n in range(25)]
    packing = pack(crates, '120x80x150:pallet', algorithm, open_bins=1, profile=rules)
    packing.finish()
    assert len(packing.bins[0].boxes) == in_a_bin


def test_a_full_bin_is_closed_and_the_figures_say_so():
    packing = pack(cubes(15), '60x40x40', 'first_fit', look_ahead=2, open_bins=1)
    figures = packing.finish()
    assert (figures.boxes, figures.unplaced, figures.bins) == (15, 0, 2)
    assert figures.fill_closed == figures.fill_first_failure == 100.0
    assert figures.fill_all == pytest.approx(100 * (1 + 0.25) / 2)
    assert figures.statuses == {'optimal': 15}
    assert [len(filled.boxes) for filled in packing.bins] == [12, 3]
    assert [closed.target.serial for closed in packing.closings] == [1]
    assert '15 boxes in 2 bins' in str(figures) and '100.0 % of closed bins' in str(figures)


def test_a_box_that_fits_no_empty_bin_is_told_and_the_others_are_packed():
    boxes = [Box('long', (700.0, 100.0, 100.0)), *cubes(2)]
    packing = pack(boxes, SMALL)
    assert packing.finish().boxes == 2
    (left_out,) = packing.unplaced
    assert left_out.box.id == 'long' and '700x100x100 mm fits no empty' in left_out.reason


@pytest.mark.parametrize('profile', ['cell', replace(PROFILES['paper'], orientations='upright')])
def test_what_is_packed_obeys_the_rules(profile):
    boxes = [Box(str(n), (100.0 + n * 7, 90.0 + n * 5, 80.0 + n * 3), 2.0) for n in range(20)]
    packing = pack(boxes, SMALL, 'mpack_lite', 4, 2, profile)
    packing.finish()
    assert packing.violations() == []
    rules = PROFILES[profile] if isinstance(profile, str) else profile
    lifted = [
        replace(
            target,
            boxes=tuple(
                replace(placed, corner_mm=(*placed.corner_mm[:2], placed.corner_mm[2] + 50))
                for placed in target.boxes
            ),
        )
        for target in packing.bins
    ]
    assert validate_bins(lifted, rules)


def test_arrays_have_a_row_for_each_placement():
    packing = pack(cubes(14), SMALL, look_ahead=1, open_bins=1)
    packing.finish()
    arrays = packing.arrays()
    assert arrays.ids.tolist() == [f'cube {number}' for number in range(14)]
    assert arrays.bins.tolist() == [1] * 12 + [2] * 2
    assert arrays.corners.shape == arrays.sizes.shape == (14, 3)
    assert np.all(arrays.corners + arrays.sizes <= SMALL.size_mm)
    assert arrays.volumes.sum() == 14 * 200.0**3
    empty = pack([], SMALL).arrays()
    assert empty.corners.shape == (0, 3) and len(empty.ids) == 0


@pytest.mark.parametrize(('change', 'said'), [
    ({'bin_spec': 'BOX'}, "unknown bin 'BOX'"), ({'algorithm': 'magic'}, "algorithm 'magic'"),
    ({'profile': 'lab'}, "unknown profile 'lab'"), ({'look_ahead': 0}, 'look_ahead is 0'),
    ({'open_bins': 0}, 'open_bins is 0'), ({'backend': 'abacus'}, "unknown backend 'abacus'"),
    ({'stream': [*cubes(1), *cubes(1)]}, "'cube 0' comes twice"),
    ({'stream': [Box('flat', (100.0, 100.0, 0.0))]}, "'flat': size z is 0 mm"),
])  # fmt: skip
def test_what_cannot_be_packed_is_said(change, said):
    with pytest.raises(ValueError, match=said):
        pack(**{'stream': cubes(1), 'bin_spec': SMALL, **change}).finish()


def floating(problem):
    placed = PlacedBox(problem.boxes[0], (0, 0, 50), (200, 200, 200), 'xyz')
    return Choice(Candidate(placed, 0, 0.0))


def elsewhere(problem):
    placed = PlacedBox(problem.boxes[0], (0, 0, 0), (200, 200, 200), 'xyz')
    return Choice(Candidate(placed, 7, 0.0))


def not_on_offer(problem):
    placed = PlacedBox(Box('other', (200.0, 200.0, 200.0)), (0, 0, 0), (200, 200, 200), 'xyz')
    return Choice(Candidate(placed, 0, 0.0))


@pytest.mark.parametrize(('rule', 'said'), [
    (floating, "'floating' chose a placement that the rules forbid: .*support"),
    (elsewhere, 'there is no bin 7, only 0 to 1'),
    (not_on_offer, "box 'other' is not on offer"),
])  # fmt: skip
def test_a_rule_of_ones_own_that_breaks_a_packing_rule_is_named(rule, said, monkeypatch):
    monkeypatch.setattr('pack_planner.packing.loop.warm_up', lambda *_: None)
    with pytest.raises(EngineMismatch, match=said):
        pack(cubes(1), SMALL, rule, open_bins=2).finish()


def test_a_rule_of_ones_own_that_fails_is_named_with_the_line():
    def broken(problem):
        return problem.no_such_thing

    with pytest.raises(AlgorithmError, match=r"'broken' failed: AttributeError.*\(line \d+\)"):
        pack(cubes(1), SMALL, broken)
    with pytest.raises(AlgorithmError, match='returned int; it must return a Choice'):
        pack(cubes(1), SMALL, lambda problem: 3)


def test_a_picture_shows_every_box(tmp_path):
    packing = pack(cubes(7), SMALL, look_ahead=1, open_bins=1)
    packing.finish()
    (target,) = packing.bins
    figure = draw_bin(target, tmp_path / 'bin.png', names=True)
    assert (tmp_path / 'bin.png').read_bytes().startswith(b'\x89PNG')
    (axes,) = figure.axes
    assert len(axes.patches) == 3 * 7
    assert [text.get_text() for text in axes.texts] == [
        placed.box.id for placed in far_to_near(target.boxes)
    ]
    assert axes.get_title() == '60x40x40: 7 boxes, 58.3% full'


def test_no_box_of_a_picture_hides_one_that_is_drawn_later():
    packing = pack(cubes(12), SMALL, look_ahead=1, open_bins=1)
    packing.finish()
    order = far_to_near(packing.bins[0].boxes)
    for number, nearer in enumerate(order):
        for farther in order[:number]:
            # what is drawn first lies to the left of, behind, or below what is drawn over it
            assert (
                farther.far_mm[0] <= nearer.corner_mm[0]
                or farther.corner_mm[1] >= nearer.far_mm[1]
                or farther.top_mm <= nearer.corner_mm[2]
            )


def test_importing_it_waits_for_nothing_that_is_not_used():
    probe = (
        'import sys, pack_planner\n'
        'from pack_planner.algorithms import BUILT_IN\n'
        "heavy = {'numba', 'numpy', 'rclpy', 'ortools', 'matplotlib', 'conveyor_sim'}\n"
        'assert not heavy & set(sys.modules), heavy & set(sys.modules)\n'
        'from pack_planner import Box, pack\n'
        "pack([Box('a', (100.0, 100.0, 100.0))], 'EQ', 'first_fit').finish()\n"
        "heavy -= {'numba', 'numpy'}\n"
        'assert not heavy & set(sys.modules), heavy & set(sys.modules)\n'
    )
    subprocess.run([sys.executable, '-c', probe], check=True)


def test_every_name_that_it_offers_is_there():
    import pack_planner

    for name in pack_planner.__all__:
        assert getattr(pack_planner, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'magic'"):
        pack_planner.magic  # noqa: B018
