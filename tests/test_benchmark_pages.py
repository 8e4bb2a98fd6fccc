"""The benchmark page says what its tables say, and its figures are drawn from them."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGES = ROOT / 'docs' / 'benchmarks'
CONCLUSIONS = ROOT / 'docs' / 'benchmarks.md'


def numbers(text: str) -> list[str]:
    return re.findall(r'\d+(?:\.\d+)?', text)


def test_every_number_of_the_conclusions_is_in_a_table_behind_them() -> None:
    measured = {
        float(number)
        for page in PAGES.glob('*.md')
        for row in page.read_text().splitlines()
        if row.startswith('|')
        for number in numbers(row)
    }
    measured |= {number / 1000 for number in measured}  # seconds for milliseconds
    for row in CONCLUSIONS.read_text().splitlines():
        if not row.startswith('|'):
            continue
        for cell in row.split('|')[2:]:
            for number in numbers(cell):
                digits = len(number.partition('.')[2])
                assert any(
                    abs(float(number) - value) <= 0.5 * 10**-digits + 1e-9 for value in measured
                ), f'{number} in {row}'


def test_every_table_behind_the_conclusions_is_linked_from_them() -> None:
    text = CONCLUSIONS.read_text()
    assert [
        page.name for page in PAGES.glob('*.md') if f'(benchmarks/{page.name})' not in text
    ] == []


def test_the_figures_of_the_page_can_be_drawn_from_the_tables() -> None:
    for draw in runpy.run_path(str(ROOT / 'benchmarks' / 'figures.py'))['FIGURES']:
        assert draw().axes
        assert f'images/bench_{draw.__name__}.svg' in CONCLUSIONS.read_text()
