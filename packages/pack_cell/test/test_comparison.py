"""Runs beside each other: what differed, and by how much the figures do for sure."""

import math

import pytest
import yaml
from report_folders import ROW, closing, stacked, write_folder
from scipy import stats

from pack_cell.report_page.comparison import (
    boxes_text,
    difference_of_means,
    difference_of_pairs,
    difference_of_shares,
    findings,
    settings_that_differ,
)
from pack_cell.report_page.page import comparison_page
from pack_cell.report_page.run_folder import read_run


def run(folder, rows, **more):
    return read_run(write_folder(folder, rows, **more))


def faster(rows, by_s):
    """The same boxes, each with so much more time to spare, a little differently for each."""
    return [
        row | {'slack_s': row['slack_s'] + by_s + 0.01 * (n % 3), 'motion_s': 4.0 - by_s}
        for n, row in enumerate(rows)
    ]


def test_the_interval_of_means_is_that_of_welch():
    one, other = [60.0, 62.0, 61.0, 65.0], [66.0, 64.0, 70.0]
    change = difference_of_means(one, other)
    theirs = stats.ttest_ind(other, one, equal_var=False)
    assert change.value == pytest.approx(sum(other) / 3 - 62.0)
    middle = (change.low + change.high) / 2
    assert middle == pytest.approx(change.value)
    # Whole degrees of freedom, rounded down: a little wider.
    low, high = theirs.confidence_interval(0.95)
    assert change.low <= low and change.high >= high
    assert change.high - change.low < 1.2 * (high - low)


def test_the_interval_of_pairs_is_that_of_the_paired_t_test():
    pairs = [(4.0, 3.5), (4.2, 3.9), (3.8, 3.1), (4.1, 3.8)]
    change = difference_of_pairs(pairs)
    low, high = stats.ttest_rel(*zip(*(p[::-1] for p in pairs), strict=True)).confidence_interval()
    assert (change.low, change.high) == pytest.approx((low, high))


def test_the_interval_of_shares_is_that_of_newcombe():
    change = difference_of_shares((48, 80), (56, 70))
    assert change.value == pytest.approx(20.0)
    assert (change.low, change.high) == pytest.approx((5.24, 33.39), abs=0.01)


@pytest.mark.parametrize('values', [([], [1.0]), ([1.0], [])])
def test_without_values_there_is_no_difference(values):
    assert difference_of_means(*values) is None
    assert difference_of_pairs([]) is None
    assert difference_of_shares((0, 0), (1, 2)) is None


def test_one_bin_each_is_too_little_to_tell():
    change = difference_of_means([60.0], [70.0])
    assert (change.value, change.low, change.is_shown) == (10.0, None, False)
    assert not math.isnan(change.value)


@pytest.mark.parametrize(
    ('fed', 'told'),
    [
        ('a,600,400,200,5 b,300,200,100,2', 'the same 2 boxes as one, in the same order'),
        ('b,300,200,100,2 a,600,400,200,5', 'the same 2 boxes as one, in another order'),
        ('a,600,400,200,5 b,300,200,101,2', '1 of its 2 are the same'),
        ('', 'not written down'),
    ],
)
def test_it_says_whether_the_boxes_were_the_same(tmp_path, fed, told):
    one = run(tmp_path / 'one', [ROW], fed='a,600,400,200,5 b,300,200,100,2')
    assert told in boxes_text(one, run(tmp_path / 'other', [ROW], fed=fed))


def configured(folder, **parameters):
    """The folder of a run whose planner was given these."""
    (folder / 'config').mkdir()
    text = yaml.safe_dump({'/**': {'ros__parameters': parameters}})
    (folder / 'config' / 'planner.param.yaml').write_text(text)


def test_what_was_set_otherwise_is_listed_and_nothing_else(tmp_path):
    runs = []
    for name, profile, python in (('one', 'cell', '3.11'), ('other', 'dense', '3.12')):
        runs.append(run(tmp_path / name, [ROW], versions={'python': python, 'numpy': '2'}))
        configured(tmp_path / name, profile=profile, deadline_s=5.5, look_ahead=5)
    assert settings_that_differ(runs) == [
        ('profile', ['cell', 'dense']),
        ('version of python', ['3.11', '3.12']),
    ]


def test_parameters_that_cannot_be_read_are_as_good_as_none(tmp_path):
    runs = [run(tmp_path / name, [ROW]) for name in ('one', 'other')]
    configured(tmp_path / 'one', profile='cell')
    (tmp_path / 'one' / 'config' / 'conveyor.param.yaml').write_text('{damaged')
    assert settings_that_differ(runs) == [('profile', ['cell', '–'])]


def test_a_difference_is_told_only_where_chance_does_not_explain_it(tmp_path):
    rows = stacked(48)
    one = run(tmp_path / 'one', rows)
    assert findings([one, run(tmp_path / 'same', rows)]) == []
    told = findings([one, run(tmp_path / 'fast', faster(rows, 0.3))])
    assert any('robot time of a box' in line and 'better' in line for line in told)
    assert not any('fill' in line for line in told)


def test_the_page_of_several_runs_holds_all_of_them(tmp_path):
    rows = stacked(48)
    closings = [closing(1), closing(2)]
    runs = [
        run(tmp_path / '<one>', rows, closings=closings),
        run(tmp_path / 'two', faster(rows, 0.3), closings=closings),
    ]
    page = comparison_page(runs)
    assert '&lt;one&gt;' in page and '<one>' not in page
    assert 'robot time of a box' in page and 'All settings' in page
    assert page.count('class="cards"') == 2


def test_copies_of_one_file_in_each_run_are_no_difference(tmp_path):
    runs = []
    for name, content in (('one', 'a,1\n'), ('two', 'a,1\n'), ('three', 'b,2\n')):
        runs.append(run(tmp_path / name, [ROW]))
        copy = tmp_path / name / 'config' / 'kept' / 'boxes' / 'mine.csv'
        copy.parent.mkdir(parents=True)
        copy.write_text(content)
        text = yaml.safe_dump({'/**': {'ros__parameters': {'boxes_file': str(copy)}}})
        (tmp_path / name / 'config' / 'conveyor.param.yaml').write_text(text)
    assert settings_that_differ(runs[:2]) == []
    [(name, [first, _, third])] = settings_that_differ(runs)
    assert name == 'boxes'
    assert first != third
    assert {text.split()[0] for text in (first, third)} == {'mine.csv'}
