"""The page of a run: one file, safe, and what a person asks for is on it."""

import json
import re
import shutil
import subprocess
import time

import numpy as np
import pytest
from matplotlib.colors import rgb_to_hsv
from matplotlib.image import imread
from report_folders import REJECTED, ROW, closing, stacked, write_folder

from pack_cell.report_page.command import report_trouble
from pack_cell.report_page.key_figures import key_figures
from pack_cell.report_page.page import MOST_BOXES, run_page
from pack_cell.report_page.run_folder import ReportError, read_run

EVIL = '</script><script>alert(1)</script><b>&"\''


def page_of(folder):
    return run_page(read_run(folder))


def scenes_of(page):
    text = re.search(r'<script type="application/json" id="scenes">(.*?)</script>', page, re.S)
    return json.loads(text.group(1))


def test_the_page_is_one_file_that_asks_for_nothing_else(tmp_path):
    page = page_of(write_folder(tmp_path))
    assert not re.findall(r'(?:src|href)="(?!#|data:,)', page)
    assert 'url(' not in page and '@import' not in page and 'http' not in page


def test_names_of_other_people_are_text_wherever_they_stand(tmp_path):
    rows = [ROW | {'box_id': EVIL, 'destination': EVIL, 'bin_destination': EVIL}, REJECTED]
    rows.append(REJECTED | {'box_id': 'r', 'reason': EVIL})
    folder = write_folder(
        tmp_path, rows, command=EVIL, problems=[EVIL], boxes=EVIL, closings=[closing(1, EVIL)]
    )
    page = page_of(folder)
    assert page.count('<script') == page.count('</script') == 2
    assert '<b>&' not in page
    assert '&lt;/script&gt;' in page
    assert scenes_of(page)[0]['boxes'][0][0] == EVIL


def test_a_manager_reads_how_full_how_many_and_how_many_bins_a_day(tmp_path):
    rows = [*stacked(32), REJECTED]
    folder = write_folder(
        tmp_path, rows, closings=[closing(1), closing(2)], closed_bins=2, fill_closed=97.9,
        boxes_supplied=33, rejected=1, bins_used=2, bins_offline={'least': 2, 'packed': None},
    )  # fmt: skip
    fill, rate, bins, offline, refused, lost = key_figures(read_run(folder))
    assert (fill.value, rate.value, refused.value, lost.value) == ('97.9 %', '900', '1', '0')
    assert (bins.value, bins.more) == (
        '1,350',
        '450 in a shift of 8 hours; 16.0 boxes a bin',
    )
    assert (refused.what, refused.more) == ('of 33 boxes refused (3.0 %)', '1 oversize')
    assert (offline.value, offline.more) == ('2', 'without a belt 2 at least')
    assert lost.tone == 'good'


def test_a_lost_box_and_a_broken_rule_are_seen_at_once(tmp_path):
    folder = write_folder(tmp_path, lost=1, problems=["box 'x' was lost"])
    assert key_figures(read_run(folder))[-1].tone == 'bad'
    assert 'What went wrong' in page_of(folder)
    assert 'What went wrong' not in page_of(write_folder(tmp_path / 'good'))


def test_the_work_order_says_what_goes_where_and_which_way_up(tmp_path):
    turned = {'box_id': 'b', 'orientation': 'zxy', 'position_mm': [0, 0, 200], 'stamp_s': 12.0}
    late = {'box_id': 'c', 'position_mm': [600, 0, 0], 'stamp_s': 13.0}
    # In a long run the rows come bin by bin, not in the order of placing.
    folder = write_folder(tmp_path, [ROW | late, ROW | turned, ROW])
    rows = re.findall(r'<tr><td class="tick">.*?</tr>', page_of(folder))
    cells = [re.findall(r'<td[^>]*>([^<]*)</td>', row)[1:] for row in rows]
    assert cells == [
        ['1', 'a', '595 × 395 × 200', '5.00', '1', '0', '0', '0', 'upright'],
        ['2', 'b', '200 × 595 × 395', '5.00', '2', '0', '0', '200', 'front up, quarter turn'],
        ['3', 'c', '595 × 395 × 200', '5.00', '1', '600', '0', '0', 'upright'],
    ]


def test_the_work_order_names_article_and_order_where_they_are_known(tmp_path):
    known = {'sku': '<b>TIN</b>', 'order_id': '17', 'aisle': '4'}
    page = page_of(write_folder(tmp_path, [ROW | {'attributes': known}, *stacked(1)]))
    assert '<th class="text">article</th>' in page
    assert '&lt;b&gt;TIN&lt;/b&gt;, 17' in page and '<b>TIN' not in page
    assert 'article</th>' not in page_of(write_folder(tmp_path, stacked(2)))


def test_a_bin_says_whether_and_why_it_was_closed(tmp_path):
    rows = [ROW, ROW | {'box_id': 'b', 'bin_serial': 2}]
    folder = write_folder(tmp_path, rows, closings=[closing(1, 'nothing fits: 5 boxes too high')])
    page = page_of(folder)
    assert 'closed: nothing fits: 5 boxes too high' in page
    assert page.count('open at the end') == 2


def test_a_box_stands_in_the_picture_where_it_was_measured(tmp_path):
    moved = ROW | {'measured_position_mm': [317.5, 197.5, 100.0]}
    [scene] = scenes_of(page_of(write_folder(tmp_path, [moved])))
    assert scene['boxes'] == [['a', 20, 0, 0, 595, 395, 200]]
    assert (scene['size'], scene['walls']) == ([1200, 800, 800], 'box')


@pytest.mark.parametrize('rows', [[], [REJECTED], [ROW | {'slack_s': None, 'motion_s': None}]])
def test_a_run_that_packed_little_or_nothing_has_a_page_too(tmp_path, rows):
    folder = write_folder(tmp_path, rows, boxes_per_hour=None, fill_all=None)
    assert 'Packing report' in page_of(folder)


def test_a_thousand_boxes_are_below_3_mb_and_quick(tmp_path):
    rows = stacked(1000)
    closings = [closing(serial) for serial in range(1, 63)]
    folder = write_folder(tmp_path, rows, closings=closings, fill_closed=97.9)
    began = time.process_time()
    assert report_trouble(folder) == ''
    assert time.process_time() - began < 10
    assert (folder / 'report.html').stat().st_size < 3e6
    assert len((folder / 'report.csv').read_text().splitlines()) == 1001


def test_a_very_long_run_shows_its_last_bins(tmp_path):
    page = page_of(write_folder(tmp_path, stacked(MOST_BOXES + 100)))
    assert f'The last {MOST_BOXES // 16} of {-(-(MOST_BOXES + 100) // 16)} bins' in page
    assert len(scenes_of(page)) == MOST_BOXES // 16
    assert 'href="#bin-1"' not in page and 'href="#bin-132"' in page


@pytest.mark.parametrize(
    ('file', 'text', 'told'),
    [
        ('summary.json', '{"placed": ', 'summary.json is damaged'),
        ('summary.json', '[]', 'must hold an object'),
        ('summary.json', '{"closings": [1]}', 'closings'),
        ('placements.jsonl', '\n{"box_id": "a"}\n', 'placements.jsonl, line 2 is damaged'),
        ('placements.jsonl', json.dumps(ROW | {'bin_type': 'BUCKET'}), 'BUCKET'),
        ('placements.jsonl', json.dumps(ROW | {'orientation': 'up'}), "orientation 'up'"),
        ('placements.jsonl', json.dumps(ROW | {'position_mm': None}), 'without a position'),
    ],
)
def test_a_damaged_file_is_told_by_name_and_place(tmp_path, file, text, told):
    (write_folder(tmp_path) / file).write_text(text)
    with pytest.raises(ReportError, match=re.escape(told)):
        read_run(tmp_path)


def test_that_a_report_cannot_be_written_ends_no_run(tmp_path):
    assert 'FileNotFoundError' in report_trouble(tmp_path) or 'no folder' in report_trouble(
        tmp_path
    )
    (write_folder(tmp_path) / 'report.html').mkdir()
    assert 'report.html was not written' in report_trouble(tmp_path)


BROWSER = shutil.which('chromium') or shutil.which('google-chrome')


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason='there is no browser')
def test_a_browser_draws_the_bins_and_has_nothing_to_complain_about(tmp_path):
    folder = write_folder(tmp_path, stacked(40), closings=[closing(1), closing(2)])
    assert report_trouble(folder) == ''
    done = subprocess.run(
        [
            BROWSER, '--headless=new', '--no-sandbox', '--use-angle=swiftshader',
            '--enable-unsafe-swiftshader', '--enable-logging=stderr', '--window-size=1000,4500',
            '--virtual-time-budget=5000', f'--user-data-dir={tmp_path}/profile',
            f'--screenshot={tmp_path}/page.png', (folder / 'report.html').as_uri(),
        ],
        capture_output=True, text=True, check=True, timeout=100,
    )  # fmt: skip
    assert 'CONSOLE' not in done.stderr
    colours = rgb_to_hsv(imread(tmp_path / 'page.png')[..., :3])
    hues, counts = np.unique(
        (36 * colours[colours[..., 1] > 0.3][:, 0]).round(), return_counts=True
    )
    # Charts and layers have seven colours; no two of sixteen boxes have the same.
    assert len(hues[counts > 300]) > 12
