"""The CSV of a report: a line per box, and nothing that a spreadsheet would run."""

import csv

import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_folders import REJECTED, ROW, stacked, write_folder

from pack_cell.report_page.csv_file import COLUMNS, as_text, write_csv
from pack_cell.report_page.run_folder import read_run


def lines_of(folder):
    write_csv(folder / 'out.csv', [read_run(folder)])
    with (folder / 'out.csv').open(newline='') as file:
        return list(csv.DictReader(file))


def test_every_box_has_a_line_in_the_order_of_placing_bin_by_bin(tmp_path):
    lines = lines_of(write_folder(tmp_path, [*stacked(20), REJECTED]))
    assert [line['box'] for line in lines] == [*(f'box-{n}' for n in range(20)), 'too-long']
    assert [line['step'] for line in lines] == [*map(str, [*range(1, 17), *range(1, 5)]), '']
    assert tuple(lines[0]) == COLUMNS
    assert (lines[-1]['reason'], lines[-1]['bin']) == ('oversize: 1900 mm fit no bin', '')


def test_what_others_know_of_a_box_has_columns_and_the_rest_one_of_its_own(tmp_path):
    known = {'sku': 'TIN-7', 'order_id': '=17', 'aisle': '4', 'gift': 'yes'}
    [line] = lines_of(write_folder(tmp_path, [ROW | {'attributes': known}]))
    assert [line[key] for key in ('sku', 'order_id', 'barcode')] == ['TIN-7', "'=17", '']
    assert line['attributes'] == 'aisle=4; gift=yes'


@pytest.mark.parametrize('evil', ['=1+1', '+1', '-1', '@SUM(A1)', '\t=1', '\r=1'])
def test_a_name_that_is_a_formula_is_text(tmp_path, evil):
    [line] = lines_of(write_folder(tmp_path, [ROW | {'box_id': evil}]))
    assert line['box'] == "'" + evil


def test_a_number_below_zero_stays_a_number(tmp_path):
    [line] = lines_of(write_folder(tmp_path, [ROW | {'slack_s': -0.25}]))
    assert float(line['slack_s']) == -0.25


@given(st.text(min_size=1))
def test_no_text_begins_like_a_formula_and_none_is_lost(text):
    shown = as_text(text)
    assert shown[0] not in '=+-@\t\r\n'
    assert shown.removeprefix("'") == text.removeprefix("'")
