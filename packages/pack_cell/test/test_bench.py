"""The benchmark: collections, protocol, records, plans, and going on after an interruption."""

from __future__ import annotations

import json
import math
import random
import re
from dataclasses import replace

import pytest

from pack_cell.bench import runner
from pack_cell.bench.figure import save, svg
from pack_cell.bench.page import page
from pack_cell.bench.paper import NAMES, paper_figures, table
from pack_cell.bench.report import below_paper, markdown, table1
from pack_cell.bench.results import ResultFile
from pack_cell.bench.runner import Workers, run
from pack_cell.bench.simulator import pack_collection
from pack_cell.bench.statistics import ci95, t975
from pack_cell.bench.streams import collection, cut_collection, drawn_collection
from pack_cell.bench.values import BenchSettings, Case, CollectionSource
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.validator import validate_bins
from pack_msgs_py.values import Bin, BinSpec, Box, PlacedBox, parse_bin
from pack_planner.algorithms import AlgorithmSpec, Choice
from pack_planner.algorithms.registry import SPECS
from pack_planner.packing import loop

SYN = parse_bin('SYN')
SMALL = BinSpec('60x40x40', (600, 400, 400))
SETTINGS = BenchSettings(PROFILES['paper'])
CARTONS = tuple(
    Box(f'carton-{i}', size)
    for i, size in enumerate(
        [(200.0, 150.0, 100.0), (293.0, 188.5, 121.0), (100.0, 100.0, 100.0), (330.0, 250.0, 90.0)]
    )
)


def case(algorithm='mpack_lite', look_ahead=3, collections=1, **source):
    return Case(
        algorithm, SMALL, look_ahead, collections, CollectionSource('test', CARTONS, **source)
    )


# collections


def test_a_syn_collection_is_ten_bins_in_whole_centimetres_shuffled():
    boxes = cut_collection(SYN, 23, random.Random(1))
    assert len(boxes) == 230 and len({box.id for box in boxes}) == 230
    assert sum(box.volume_mm3 for box in boxes) == 10 * SYN.volume_mm3
    assert all(edge % 10 == 0 for box in boxes for edge in box.size_mm)
    first_bin = sum(box.volume_mm3 for box in boxes[:23])
    assert first_bin != SYN.volume_mm3


def test_an_industrial_collection_just_fills_four_bins():
    boxes = drawn_collection(SMALL, CARTONS, random.Random(1))
    volume = sum(box.volume_mm3 for box in boxes)
    assert volume - boxes[-1].volume_mm3 < 4 * SMALL.volume_mm3 <= volume
    assert len({box.id for box in boxes}) == len(boxes)
    assert {box.size_mm for box in boxes} == {box.size_mm for box in CARTONS}


def test_every_algorithm_and_look_ahead_gets_the_same_boxes():
    boxes = collection(case('mpack_lite', 1), SETTINGS, 0)
    assert collection(case('first_fit', 5), SETTINGS, 0) == boxes
    assert collection(case(), SETTINGS, 1) != boxes
    assert collection(case(), replace(SETTINGS, seed=2), 0) != boxes


def test_a_box_file_is_packed_in_its_order_or_shuffled():
    in_order = collection(case(in_order=True), SETTINGS, 0)
    assert in_order == CARTONS
    shuffled = [collection(case(in_order=True, shuffle=s), SETTINGS, 0) for s in (1, 2, 3, 4)]
    assert all(sorted(order, key=id) == sorted(CARTONS, key=id) for order in shuffled)
    assert any(order != CARTONS for order in shuffled)


# protocol


def replay(packed, spec, boxes):
    """Bins of a plan, rebuilt from its lines alone; checks what a line claims on the way."""
    by_id = {box.id: box for box in boxes}
    standing, closed = {}, []
    for step, event in enumerate(packed.events, start=1):
        assert event['step'] == step
        serial = event['bin_serial']
        if event['event'] == 'close':
            fills = {number: content.fill_rate for number, content in standing.items()}
            assert fills[serial] == max(fills.values()), 'not the fullest bin was closed'
            closed.append(standing.pop(serial))
            continue
        box = by_id.pop(event['box']['id'])
        assert list(box.size_mm) == event['box']['size_mm']
        old = standing.get(serial, Bin(f'bin-{serial}', serial, spec))
        placed = PlacedBox(
            box, tuple(event['position_mm']), tuple(event['placed_size_mm']), event['orientation']
        )
        standing[serial] = replace(old, boxes=(*old.boxes, placed))
    return [*closed, *standing.values()], by_id


@pytest.mark.parametrize('profile', PROFILES)
@pytest.mark.parametrize('name', ['first_fit', 'o_jampack', 'mpack_lite', 'walle'])
def test_a_plan_can_be_replayed_and_breaks_no_rule(name, profile):
    settings = BenchSettings(PROFILES[profile], open_bins=2)
    boxes = collection(case(name), settings, 0)
    packed = pack_collection(case(name), settings, 0)
    bins, left = replay(packed, SMALL, boxes)
    assert validate_bins(bins, settings.profile) == []
    assert set(left) == {entry['id'] for entry in packed.unplaced}
    assert packed.closed_bins == sum(event['event'] == 'close' for event in packed.events) > 0
    closed = [content.fill_rate for content in bins[: packed.closed_bins]]
    assert packed.fills['fill_closed'] == pytest.approx(100 * sum(closed) / len(closed))
    assert packed.fills['fill_first_failure'] == pytest.approx(100 * closed[0])


def test_no_more_bins_stand_open_than_allowed():
    for open_bins in (1, 2, 3):
        packed = pack_collection(case(), replace(SETTINGS, open_bins=open_bins), 0)
        highest = closed = 0
        for event in packed.events:
            highest = max(highest, event['bin_serial'])
            assert highest - closed <= open_bins
            closed += event['event'] == 'close'


def test_the_look_ahead_is_refilled_in_the_order_of_the_stream():
    packed = pack_collection(case(look_ahead=3), SETTINGS, 0)
    arrival = [box.id for box in collection(case(), SETTINGS, 0)]
    window, following, passed_over = arrival[:3], arrival[3:], 0
    for event in packed.events:
        if event['event'] == 'place':
            assert event['box']['id'] in window
            passed_over += event['box']['id'] != window[0]
            window.remove(event['box']['id'])
            if following:
                window.append(following.pop(0))
    assert not window and passed_over


def test_a_box_that_fits_no_bin_is_reported_and_the_others_are_packed():
    boxes = (*CARTONS[:2], Box('too-long', (700.0, 100.0, 100.0)), *CARTONS[2:])
    stream = Case('mpack_lite', SMALL, 2, 1, CollectionSource('test', boxes, in_order=True))
    packed = pack_collection(stream, SETTINGS, 0)
    assert [entry['id'] for entry in packed.unplaced] == ['too-long']
    assert '700x100x100 mm fits no empty 60x40x40 bin' in packed.unplaced[0]['reason']
    assert len(packed.events) == 4
    heavy = Case(
        'first_fit',
        SMALL,
        2,
        1,
        CollectionSource('test', (Box('lead', (100.0, 100.0, 100.0), 90.0),), in_order=True),
    )
    packed = pack_collection(heavy, BenchSettings(PROFILES['cell']), 0)
    assert packed.unplaced[0]['reason'] == 'weighs 90 kg, the arm lifts 20 kg'


def test_one_box_closes_no_bin():
    stream = Case('mpack_lite', SMALL, 6, 1, CollectionSource('test', CARTONS[:1], in_order=True))
    packed = pack_collection(stream, SETTINGS, 0)
    assert packed.fills['fill_closed'] is None
    assert packed.fills['fill_all'] == pytest.approx(100 * CARTONS[0].volume_mm3 / SMALL.volume_mm3)


def test_sizes_are_rounded_up_in_the_bin_and_true_in_the_fill():
    box = Box('odd', (293.0, 188.5, 121.0))
    stream = Case('first_fit', SMALL, 1, 1, CollectionSource('test', (box,), in_order=True))
    packed = pack_collection(stream, SETTINGS, 0)
    assert sorted(packed.events[0]['placed_size_mm']) == [130, 190, 300]
    assert packed.fills['fill_all'] == pytest.approx(100 * 293 * 188.5 * 121 / SMALL.volume_mm3)


def test_an_algorithm_that_breaks_a_rule_is_found_out(monkeypatch):
    from pack_planner.engine import Candidate, EngineMismatch

    def floating(problem):
        placed = PlacedBox(problem.boxes[0], (0, 0, 50), (200, 150, 100), 'xyz')
        return Choice(Candidate(placed, 0, 0.0))

    monkeypatch.setitem(SPECS, 'floating', AlgorithmSpec('floating', floating))
    monkeypatch.setattr(loop, 'warm_up', lambda *_: None)
    with pytest.raises(EngineMismatch, match='support'):
        pack_collection(case('floating', in_order=True), SETTINGS, 0)


# records


def without_seconds(path):
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert all(line.pop('seconds') >= 0 for line in lines)
    return lines


def bench(cases, tmp_path, name='out', workers=Workers()):  # noqa: B008
    calls = []
    results = ResultFile(tmp_path / f'{name}.json', tmp_path / f'{name}.jsonl')
    try:
        records = run(cases, SETTINGS, workers, results, lambda *done: calls.append(done))
    finally:
        results.close()
    return records, calls


def test_a_record_says_what_was_asked_and_what_came_of_it(tmp_path):
    (record,), _ = bench([case(collections=3)], tmp_path)
    assert json.loads((tmp_path / 'out.json').read_text()) == [record]
    assert (record['algorithm'], record['bin'], record['look_ahead']) == (
        'mpack_lite', '60x40x40', 3
    )  # fmt: skip
    assert (record['profile'], record['boxes_source'], record['collections']) == (
        'paper', 'test', 3
    )  # fmt: skip
    lines = without_seconds(tmp_path / 'out.jsonl')
    assert record['boxes'] == record['placed'] == sum(line['event'] == 'place' for line in lines)
    assert record['closed_bins'] == sum(line['event'] == 'close' for line in lines)
    assert record['statuses'] == {'optimal': record['placed']}
    assert 0 < record['fill_all'] <= record['fill_closed'] < 100
    assert record['fill_closed_ci95'] > 0 and record['fill_first_failure'] > 0
    time = record['decision_s']
    assert 0 < time['p50'] <= time['p95'] <= time['p99'] <= time['max']
    assert record['unplaced'] == [] and record['paper'] is None
    assert record['gap'] == {'mean': 0.0, 'max': 0.0}


def test_a_budget_of_nodes_cuts_the_search_short_in_the_same_way_each_time(tmp_path):
    joint = case('mpack', look_ahead=4)
    limited = replace(SETTINGS, budget_s=1e4, node_limit=20)
    plans = []
    for name in ('once', 'again'):
        results = ResultFile(None, tmp_path / name)
        (record,) = run([joint], limited, Workers(), results, lambda *_: None)
        plans.append(without_seconds(tmp_path / name))
    assert plans[0] == plans[1]
    assert record['statuses']['budget'] > 0
    json.dumps(record, allow_nan=False)


def test_the_same_seed_gives_the_same_plan_on_one_process_and_on_two(tmp_path):
    cases = [case('mpack_lite', collections=2), case('o_best_fit', collections=2)]
    bench(cases, tmp_path, 'one')
    bench(cases, tmp_path, 'again')
    bench(cases, tmp_path, 'two', Workers(jobs=2))
    plan = without_seconds(tmp_path / 'one.jsonl')
    assert without_seconds(tmp_path / 'again.jsonl') == plan
    assert without_seconds(tmp_path / 'two.jsonl') == plan
    assert {line['algorithm'] for line in plan} == {'mpack_lite', 'o_best_fit'}


def test_an_interrupted_benchmark_goes_on_where_it_was(tmp_path, monkeypatch):
    cases = [case('first_fit', collections=2), case('mpack_lite', collections=2)]
    whole, _ = bench(cases, tmp_path, 'whole')
    plan = without_seconds(tmp_path / 'whole.jsonl')
    packed = []

    def interrupted(asked, settings, number):
        packed.append((asked.algorithm, number))
        if len(packed) == 4:
            raise KeyboardInterrupt
        return pack_collection(asked, settings, number)

    monkeypatch.setattr(runner, 'pack_collection', interrupted)
    with pytest.raises(KeyboardInterrupt):
        bench(cases, tmp_path)
    assert [record['algorithm'] for record in json.loads((tmp_path / 'out.json').read_text())] == [
        'first_fit'
    ]
    records, _ = bench(cases, tmp_path)
    assert packed[4:] == [('mpack_lite', 1)]
    assert without_seconds(tmp_path / 'out.jsonl') == plan
    assert [{**record, 'decision_s': 0} for record in records] == [
        {**record, 'decision_s': 0} for record in whole
    ]


def test_other_settings_are_another_record(tmp_path):
    bench([case('first_fit')], tmp_path)
    bench([case('first_fit', collections=2)], tmp_path)
    records, calls = bench([case('first_fit')], tmp_path)
    assert len(json.loads((tmp_path / 'out.json').read_text())) == 2
    assert [record['collections'] for record in records] == [1]
    assert calls == [(case('first_fit'), 1, 1)]


def test_a_record_whose_plan_is_gone_is_packed_again(tmp_path):
    bench([case('first_fit')], tmp_path)
    plan = without_seconds(tmp_path / 'out.jsonl')
    (tmp_path / 'out.jsonl').unlink()
    bench([case('first_fit')], tmp_path)
    assert without_seconds(tmp_path / 'out.jsonl') == plan


@pytest.mark.parametrize('text', ['{"a": 1}', '[1]', 'not json', '[{"algorithm": "x"}]'])
def test_a_file_of_something_else_is_not_overwritten(tmp_path, text):
    path = tmp_path / 'notes.json'
    path.write_text(text)
    with pytest.raises(ValueError, match='name another file'):
        ResultFile(path, None)
    assert path.read_text() == text


def test_two_runs_do_not_write_one_file(tmp_path):
    first = ResultFile(tmp_path / 'r.json', None)
    with pytest.raises(ValueError, match='is being written by another run'):
        ResultFile(tmp_path / 'r.json', None)
    first.close()
    ResultFile(tmp_path / 'r.json', None).close()
    assert list(tmp_path.iterdir()) == []


# figures and tables


def test_confidence_interval_against_a_worked_example():
    # five values of mean 3 and variance 2.5: 2.7764451 sqrt(2.5 / 5)
    assert ci95([1.0, 2.0, 3.0, 4.0, 5.0]) == pytest.approx(2.7764451 * math.sqrt(0.5))
    assert ci95([1.0]) is None
    assert round(t975(29), 3) == 2.045
    assert t975(40) == pytest.approx(2.021, abs=2e-3)
    assert t975(100) == pytest.approx(1.984, abs=1e-3)


def test_the_table_of_the_paper_is_whole():
    rows = table()
    assert len(rows) == 5 * 5 * 7 - 11, 'FF and BF have no SYN figures, MPack none for RC at 5'
    assert rows['MPackLite', 'SYN', 5] == (75.99, 5.06)
    assert set(NAMES.values()) == {name for name, _, _ in rows}


def test_paper_figures_stand_beside_the_same_question_only():
    syn = Case('first_fit', SYN, 1, 30, CollectionSource('SYN'))
    assert paper_figures(syn, SETTINGS) == {'fill': 68.71, 'seconds': 0.049}
    assert paper_figures(replace(syn, look_ahead=2), SETTINGS) is None
    assert paper_figures(syn, BenchSettings(PROFILES['cell'])) is None
    assert paper_figures(replace(syn, algorithm='walle'), SETTINGS) is None


@pytest.fixture(scope='module')
def records(tmp_path_factory):
    source = CollectionSource('SYN, cut from ten bins')
    cases = [
        Case(name, SYN, look, 2, source)
        for look in (1, 2)
        for name in ('o_first_fit', 'mpack_lite')
    ]
    results = ResultFile(None, None)
    return run(cases, replace(SETTINGS, boxes_per_bin=8), Workers(), results, lambda *_: None)


def test_table_1_has_ours_beside_the_papers(records):
    headings, rows = table1(records)
    assert headings == ('look-ahead', 'bin', 'O-FF % [paper]', 'MPackLite % [paper]')
    assert [row[:2] for row in rows] == [('1', 'SYN'), ('2', 'SYN')]
    assert rows[1][3].startswith(f'{records[3]["fill_closed"]:.2f} [74.05]')
    low = {**records[0], 'fill_closed': 60.0, 'fill_closed_ci95': 1.0}
    assert below_paper(low) and not below_paper({**low, 'fill_closed_ci95': 9.0})
    assert markdown(headings, rows).count('\n') == 3


def test_the_page_needs_nothing_from_elsewhere(records):
    text = page(records, "./cell bench --boxes '<script>.csv'")
    assert '<svg' in text and 'MPackLite' in text and 'O-FF' in text
    assert '&lt;script&gt;' in text and '<script' not in text
    assert 'src=' not in text
    assert re.findall('<link[^>]*>', text) == ['<link rel="icon" href="data:,">']
    unplaced = [{'collection': 0, 'id': 'b<1>', 'reason': 'too long'}]
    assert 'b&lt;1&gt;: too long' in page([{**records[0], 'unplaced': unplaced}], 'x')


def test_figures_are_drawn_even_without_a_closed_bin(records, tmp_path):
    save(records, tmp_path / 'deep' / 'figure.png')
    assert (tmp_path / 'deep' / 'figure.png').read_bytes().startswith(b'\x89PNG')
    none = {'fill_closed': None, 'fill_closed_ci95': None, 'paper': None}
    assert svg([{**records[0], **none}]).startswith('<svg')
